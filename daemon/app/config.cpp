// Checks that need more than one key.
#include "daemon/app/config.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "core/hand/finger_estimator.hpp"

namespace embody::config {
namespace {

template <class Known>
std::string finger_markers_problem(const GloveConfig& glove, const Known& known) {
  std::set<std::string> markers;
  std::set<std::pair<Finger, FingerPoint>> points;
  std::map<Finger, std::size_t> count;
  for (const FingerMarkerConfig& item : glove.finger_markers) {
    const std::string who = "finger_markers: marker '" + item.marker + "' ";
    if (!known(item.marker)) return who + "is not in names";
    if (!markers.insert(item.marker).second) return who + "is there twice";
    for (const std::string& back : {glove.back.top, glove.back.left, glove.back.right}) {
      if (item.marker == back) return who + "is on the back of the hand already";
    }
    const bool own_point = item.point == FingerPoint::kBone || item.point == FingerPoint::kSurface;
    if (!own_point && !points.emplace(item.finger, item.point).second) {
      return who + "shows a point that another marker shows already";
    }
    const double sum = item.barycentric[0] + item.barycentric[1] + item.barycentric[2];
    if (item.point == FingerPoint::kSurface && std::abs(sum - 1.0) > 1e-6) {
      return who + "has barycentric weights whose sum is not 1";
    }
    if (++count[item.finger] > kMaxMarkersPerFinger) {
      return who + "is one too many: a finger carries at most " + std::to_string(kMaxMarkersPerFinger);
    }
  }
  return {};
}

}  // namespace

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
  return finger_markers_problem(*this, known);
}

std::string SubjectConfig::problem() const {
  for (std::size_t i = 0; i < shape.size() && model.empty(); ++i) {
    if (shape[i] < -0.5 || shape[i] > 2.0) {
      return "shape entry " + std::to_string(i + 1) + " is out of range: the built-in hand takes -0.5 to 2";
    }
  }
  const auto [a, b, c] = back_edges_m;
  const bool learnt = a == 0.0 && b == 0.0 && c == 0.0;
  if (!learnt && (a + b <= c || b + c <= a || c + a <= b)) {
    return "back_edges_m must be three zeros or the sides of a triangle";
  }
  std::set<std::string> seen;
  for (const MarkerPlaceConfig& place : markers) {
    if (place.marker.empty()) return "markers: an entry has no marker";
    if (!seen.insert(place.marker).second) return "markers: marker '" + place.marker + "' is there twice";
  }
  return {};
}

RecordMappingConfig::RecordMappingConfig() {
  const hand::FingerEstimatorConfig defaults;
  const auto copy = [](const hand::Vector9& from, std::array<double, 9>& to) {
    std::copy(from.data(), from.data() + from.size(), to.begin());
  };
  objective = defaults.objective;
  solver = defaults.solver;
  max_iterations = defaults.max_iterations;
  coupling_m_rad = defaults.coupling_m_rad;
  coupling_ratio = defaults.coupling_ratio;
  catch_up_rad_s = defaults.catch_up_rad_s;
  hold = std::chrono::duration_cast<milliseconds>(defaults.hold);
  decay = std::chrono::duration_cast<milliseconds>(defaults.decay);
  for (std::size_t f = 0; f < kFingers; ++f) {
    copy(defaults.lower_rad[f], fingers[f].lower_rad);
    copy(defaults.upper_rad[f], fingers[f].upper_rad);
    copy(defaults.weight_plus[f], fingers[f].weight_plus);
    copy(defaults.weight_minus[f], fingers[f].weight_minus);
    copy(defaults.temporal_m_rad[f], fingers[f].temporal_m_rad);
  }
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

EmbodyConfig adapted_to_sensor(EmbodyConfig config) {
  if (config.tracker.driver != TrackerDriver::kLandmarks) return config;
  const auto periods = [&](double count) {
    const double ms = std::ceil(count * 1e3 / config.tracker.landmarks.rate_hz);
    return milliseconds(static_cast<milliseconds::rep>(ms));
  };
  config.arm.resample_delay = std::max(config.arm.resample_delay, periods(1.5));
  config.safety.hold_after = std::max(config.safety.hold_after, periods(3.0));
  config.safety.stop_after = std::max(config.safety.stop_after, 2 * config.safety.hold_after);
  return config;
}

}  // namespace embody::config
