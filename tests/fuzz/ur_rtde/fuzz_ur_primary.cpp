// Any bytes through the client's side of the primary interface: framing, robot messages, geometry and its comparison.
#include <cmath>
#include <cstdlib>

#include "drivers/ur_rtde/primary_codec.hpp"
#include "drivers/ur_rtde/ur_models.hpp"

namespace {

using namespace embody;

void check(bool property) {
  if (!property) std::abort();
}

void decode(const ur::PrimaryMessage& message) {
  if (const auto said = ur::decode_robot_message(message.contents)) {
    check(said->title.size() + said->text.size() <= message.contents.size());
  }
  if (const auto kinematics = ur::decode_kinematics(message.contents)) {
    for (std::size_t i = 0; i < 6; ++i) check(std::isfinite(kinematics->a_m[i]) && std::isfinite(kinematics->d_m[i]));
    for (const ur::UrModel& model : robot::kUrModels) (void)ur::check_model(model, *kinematics, model.software_major);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  ur::Bytes stream = std::as_bytes(std::span(data, size));
  while (true) {
    const ur::PrimaryMessage message = ur::parse_primary(stream);
    if (message.framing != ur::PrimaryFraming::kComplete) break;
    check(message.size >= ur::kPrimaryHeader && message.size <= stream.size());
    decode(message);
    stream = stream.subspan(message.size);
  }
  // Without the framing, too: the fuzzer need not find the right size first.
  decode({ur::PrimaryFraming::kComplete, ur::kRobotState, std::as_bytes(std::span(data, size)), size});
  return 0;
}
