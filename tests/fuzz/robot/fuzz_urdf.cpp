// Any text as a robot description: it is refused with a sentence, or becomes a hand that can be onboarded and driven,
// or is refused there.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "core/embodiment/embodiment_mapping.hpp"
#include "core/embodiment/onboarding.hpp"
#include "core/robot/urdf_model.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace embody;
  const auto model = robot::load_urdf({reinterpret_cast<const char*>(data), size});
  if (!model) {
    if (model.error().detail.empty()) std::abort();
    return 0;
  }
  OnboardingOptions quick;
  quick.robot_samples = 20;
  quick.human_samples = 5;
  const auto proposal = onboard_hand(*model, quick);
  if (!proposal) {
    if (proposal.error().detail.empty()) std::abort();
    return 0;
  }
  auto mapping = EmbodimentMapping::create(*model, proposal->config);
  if (!mapping) return 0;
  HandState state;
  state.valid = true;
  state.quality.fill(FingerQuality::kOptimal);
  FingerTarget target;
  mapping->step(state, target);
  for (std::size_t m = 0; m < target.joint_count; ++m) {
    if (!(target.q_rad[m] >= mapping->lower_rad(m) && target.q_rad[m] <= mapping->upper_rad(m))) std::abort();
  }
  return 0;
}
