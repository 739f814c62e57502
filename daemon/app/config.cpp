// Checks that need more than one key.
#include "daemon/app/config.hpp"

#include <algorithm>
#include <set>

namespace embody::config {

std::string GloveConfig::problem() const {
  const auto known = [this](const std::string& name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  if (std::set<std::string>(names.begin(), names.end()).size() != names.size()) return "names has a marker twice";
  for (const std::string& name : names) {
    if (name.empty() || name.size() > 48) return "names: a marker name has 1 to 48 characters";
  }
  if (back.top == back.left || back.top == back.right || back.left == back.right) {
    return "back: top, left and right are three different markers";
  }
  for (const std::string& name : {back.top, back.left, back.right}) {
    if (!known(name)) return "back: marker '" + name + "' is not in names";
  }
  std::set<std::pair<Finger, FingerPoint>> points;
  for (const FingerMarkerConfig& item : finger_markers) {
    if (!known(item.marker)) return "finger_markers: marker '" + item.marker + "' is not in names";
    if (!points.emplace(item.finger, item.point).second) {
      return "finger_markers: marker '" + item.marker + "' shows a point that another marker shows already";
    }
  }
  return {};
}

std::string ArmLimitsConfig::problem() const {
  for (std::size_t i = 0; i < joint_lower_rad.size(); ++i) {
    if (joint_lower_rad[i] >= joint_upper_rad[i]) {
      return "joint_lower_rad must be below joint_upper_rad (entry " + std::to_string(i + 1) + ")";
    }
  }
  for (std::size_t i = 0; i < workspace_min_m.size(); ++i) {
    if (workspace_min_m[i] >= workspace_max_m[i]) {
      return "workspace_min_m must be below workspace_max_m (entry " + std::to_string(i + 1) + ")";
    }
  }
  return {};
}

std::string HandConfig::problem() const {
  if (embodiment.urdf.empty()) return "urdf is missing: name the robot description or a hand file";
  if (embodiment.motors.empty()) return "motors is empty: name the joints that have a motor";
  if (embodiment.motors.size() > kMaxHandJoints) return "motors has more than 32 joints";
  if (embodiment.motor_lower_rad.size() != embodiment.motors.size() ||
      embodiment.motor_upper_rad.size() != embodiment.motors.size()) {
    return "motor_lower_rad and motor_upper_rad need one number per entry of motors";
  }
  for (std::size_t i = 0; i < embodiment.motors.size(); ++i) {
    if (embodiment.motor_lower_rad[i] >= embodiment.motor_upper_rad[i]) {
      return "motor_lower_rad must be below motor_upper_rad (" + embodiment.motors[i] + ")";
    }
  }
  return {};
}

std::string SafetyConfig::problem() const {
  if (stop_after <= hold_after) return "stop_after_ms must be greater than hold_after_ms";
  return {};
}

std::string PriorityConfig::problem() const {
  if (watchdog <= std::max({arm, tracker, hand, fingers})) return "watchdog must have the highest priority";
  return {};
}

std::string LinksConfig::problem() const {
  if (retry_longest < retry_first) return "retry_longest_ms must not be below retry_first_ms";
  return {};
}

}  // namespace embody::config
