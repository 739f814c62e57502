#include "daemon/app/hand_report.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

namespace embody {
namespace {

using json = nlohmann::ordered_json;

template <class Values>
json by_joint(const Values& values, std::size_t count, std::span<const std::string> joints) {
  json named = json::object();
  for (std::size_t i = 0; i < std::min({count, values.size(), joints.size()}); ++i) named[joints[i]] = values[i];
  return named;
}

json force_json(const HandTelemetry& telemetry) {
  json fingers = json::object();
  for (std::size_t i = 0; i < kMaxHandFingers; ++i) {
    const RawForce& force = telemetry.force[i];
    if (force.measured) fingers[kFingerNames[i]] = {{"normal", force.normal}, {"tangential", force.tangential}};
  }
  return fingers;
}

}  // namespace

json hand_json(const HandDeviceState& state, std::span<const std::string> joints) {
  if (state.t_arrival == TimePoint{}) return json::object();
  const HandTelemetry& telemetry = state.telemetry;
  json hand{{"condition", kHandConditionNames[static_cast<std::size_t>(telemetry.condition)]},
            {"why_not", telemetry.why_not.view()},
            {"supply", kHandSupplyNames[static_cast<std::size_t>(telemetry.supply)]},
            {"position_rad", by_joint(state.q_rad, state.joint_count, joints)}};
  if (telemetry.t_current != TimePoint{}) {
    if (telemetry.current_in_ampere) {
      hand["current_a"] = by_joint(telemetry.current_a, telemetry.current_count, joints);
    } else {
      hand["current_raw"] = by_joint(telemetry.current_raw, telemetry.current_count, joints);
    }
  }
  if (telemetry.t_force != TimePoint{}) hand["force_raw"] = force_json(telemetry);
  return hand;
}

}  // namespace embody
