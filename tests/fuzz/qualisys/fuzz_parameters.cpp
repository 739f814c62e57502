// Any text: refused with a sentence, or labels and bodies that are distinct, bounded and not empty; and what is said
// about a setup that was parsed is a sentence too.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>

#include "drivers/qualisys/codec.hpp"
#include "drivers/qualisys/setup_check.hpp"

namespace {

using namespace embody::qualisys;

void check_names(std::vector<std::string> names, std::size_t most) {
  if (names.size() > most) std::abort();
  for (const auto& name : names) {
    if (name.empty() || name.size() > kMaxNameLength) std::abort();
  }
  std::sort(names.begin(), names.end());
  if (std::adjacent_find(names.begin(), names.end()) != names.end()) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto parameters = parse_parameters({reinterpret_cast<const char*>(data), size});
  if (!parameters) {
    if (parameters.error().detail.empty()) std::abort();
    return 0;
  }
  if (!std::isfinite(parameters->frequency_hz)) std::abort();
  check_names(parameters->labels, kMaxDataMarkers);
  std::vector<std::string> bodies;
  for (const auto& body : parameters->bodies) bodies.push_back(body.name);
  check_names(bodies, kMaxDataBodies);
  const Wanted wanted{{"hand_top", "hand_left"}, {"hand_left"}, "hand"};
  if (const auto status = check_setup(*parameters, wanted); status) {
    const DataMap map = make_map(*parameters, wanted);
    if (map.label_of_slot[0] >= map.labels || map.body >= map.bodies) std::abort();
    if (map.body_among_enabled >= map.enabled_bodies) std::abort();
  } else if (status.error().detail.empty()) {
    std::abort();
  }
  if (!check_unchanged(*parameters, *parameters)) std::abort();
  return 0;
}
