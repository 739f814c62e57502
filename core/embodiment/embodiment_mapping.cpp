#include "core/embodiment/embodiment_mapping.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace embody {
namespace {

using robot::HandKinematics;
using robot::Joint;
using robot::JointType;
using robot::kNoIndex;
using robot::RobotModel;

constexpr double kTurn = 2.0 * std::numbers::pi;
constexpr double kFlatCost = 1e-12;  // m^2: below, the angle does not matter: keep the last one

Error config_error(const char* key, const char* what) {
  return make_error(Errc::kInvalidArgument, "embodiment configuration: %s %s", key, what);
}

Status check(const RobotModel& model, const EmbodimentConfig& config) {
  if (model.links.empty() || model.links[0].name != config.root_link) {
    return config_error("root_link", "is not the root of the URDF");
  }
  if (!config.X_PM.allFinite()) return config_error("X_PM", "is not finite");
  if (!std::isfinite(config.finger_zero_offset_rad)) return config_error("finger_zero_offset_rad", "is not finite");
  if (config.motors.empty() || config.motors.size() > kMaxHandJoints) {
    return config_error("motors", "must name 1 to 32 joints");
  }
  for (const auto* limits : {&config.motor_lower_rad, &config.motor_upper_rad}) {
    const bool finite = std::all_of(limits->begin(), limits->end(), [](double x) { return std::isfinite(x); });
    if (limits->size() != config.motors.size() || !finite) {
      return config_error("motor_lower_rad and motor_upper_rad", "need one finite angle per motor");
    }
  }
  return {};
}

/// The kinematics of the configured hand; points in the order thumb tip, thumb middle, index tip, ... without the
/// fingers that the hand lacks.
Result<HandKinematics> make_kinematics(const RobotModel& model, const EmbodimentConfig& config) {
  robot::HandKinematicsSpec spec;
  spec.motors = config.motors;
  if (!config.thumb_joint.empty()) {
    const double angle = config.thumb_mode == ThumbMode::kOpposed ? config.thumb_opposed_rad : config.thumb_lateral_rad;
    spec.fixed_joints.push_back({config.thumb_joint, angle});
    const auto joint = model.find_joint(config.thumb_joint);
    if (joint && !(angle >= model.joints[*joint].lower - 1e-6 && angle <= model.joints[*joint].upper + 1e-6)) {
      return config_error("thumb_opposed_rad or thumb_lateral_rad", "is outside the limits of thumb_joint");
    }
  }
  for (const std::string& name : config.zero_offset_joints) {
    spec.zero_offsets.push_back({name, config.finger_zero_offset_rad});
  }
  for (const FingerPoints& finger : config.fingers) {
    if (finger.link.empty()) continue;
    spec.points.push_back({finger.link, finger.tip_m});
    spec.points.push_back({finger.link, finger.middle_m});
  }
  return HandKinematics::create(model, spec);
}

/// Range of a motor such that its joint and every joint that mimics it stay within their limits.
std::pair<double, double> motor_range(const HandKinematics& hand, std::size_t motor, double lower, double upper) {
  for (std::size_t j = 0; j < hand.couplings().size(); ++j) {
    const robot::Coupling& c = hand.couplings()[j];
    if (c.motor != motor || c.multiplier == 0.0) continue;
    const double a = (hand.model().joints[j].lower - c.offset) / c.multiplier;
    const double b = (hand.model().joints[j].upper - c.offset) / c.multiplier;
    lower = std::max(lower, std::min(a, b));
    upper = std::min(upper, std::max(a, b));
  }
  return {lower, upper};
}

/// Maximises U cos(k r) + V sin(k r) over [lower, upper]; among equal maxima the one nearest to `last`.
double best_angle(double U, double V, double k, double lower, double upper, double last) noexcept {
  if (!(std::hypot(U, V) > kFlatCost)) return last;
  const double peak = std::atan2(V, U) / k, period = kTurn / k;
  double r = peak + period * std::round((last - peak) / period);
  if (r > upper) r -= period * std::ceil((r - upper) / period);
  if (r < lower) r += period * std::ceil((lower - r) / period);
  if (r <= upper) return r;
  const auto gain = [&](double x) noexcept { return U * std::cos(k * x) + V * std::sin(k * x); };
  return gain(lower) >= gain(upper) ? lower : upper;  // without a peak inside, an end is best
}

}  // namespace

Result<EmbodimentMapping> EmbodimentMapping::create(const RobotModel& model, const EmbodimentConfig& config) {
  if (const Status status = check(model, config); !status) return status.error();
  Result<HandKinematics> kinematics = make_kinematics(model, config);
  if (!kinematics) return kinematics.error();
  EmbodimentMapping mapping(std::move(*kinematics));
  mapping.X_PM_ = math::exp_se3(config.X_PM);
  mapping.motor_names_ = config.motors;
  for (std::size_t m = 0; m < config.motors.size(); ++m) {
    const auto [lower, upper] =
        motor_range(mapping.kinematics_, m, config.motor_lower_rad[m], config.motor_upper_rad[m]);
    if (!(lower <= upper)) {
      return make_error(Errc::kInvalidArgument, "embodiment configuration: motor '%.60s' has an empty range",
                        config.motors[m].c_str());
    }
    mapping.motors_.push_back({lower, upper, 0.0});
    mapping.last_rad_[m] = std::clamp(0.0, lower, upper);
  }
  for (std::size_t j = 0; j < model.joints.size(); ++j) {
    if (model.joints[j].type == JointType::kFixed) continue;
    mapping.urdf_joints_.push_back(j);
    mapping.urdf_joint_names_.push_back(model.joints[j].name);
  }
  if (const Status status = mapping.find_circles(config); !status) return status.error();
  return mapping;
}

Status EmbodimentMapping::find_circles(const EmbodimentConfig& config) {
  HandKinematics::Workspace workspace;
  kinematics_.update(std::array<double, robot::kMaxMotors>{}, workspace);
  std::size_t point = 0;
  for (std::size_t finger = 0; finger < kFingers; ++finger) {
    if (config.fingers[finger].link.empty()) continue;
    for (Circle& circle : circles_[finger]) {
      const std::span<const std::size_t> joints = kinematics_.point_joints(point);
      if (joints.size() != 1 || kinematics_.model().joints[joints[0]].type == JointType::kPrismatic) {
        return make_error(Errc::kUnsupported,
                          "embodiment configuration: [%s] link '%.60s' must turn about exactly one motor-driven joint",
                          kFingerNames[finger], config.fingers[finger].link.c_str());
      }
      const Joint& joint = kinematics_.model().joints[joints[0]];
      const robot::Coupling& coupling = kinematics_.couplings()[joints[0]];
      Motor& motor = motors_[coupling.motor];
      const double ratio = std::abs(coupling.multiplier);
      if (ratio == 0.0 || (motor.ratio != 0.0 && std::abs(motor.ratio - ratio) > 1e-12)) {
        return make_error(Errc::kUnsupported,
                          "embodiment configuration: [%s] joint '%.60s' must follow its motor with the same, non-zero "
                          "ratio as the motor's other fingers",
                          kFingerNames[finger], joint.name.c_str());
      }
      motor.ratio = ratio;
      const Pose& X_PC = workspace.X_PL[joint.child_link];
      const Eigen::Vector3d axis = X_PC.linear() * joint.axis;
      const Eigen::Vector3d d = kinematics_.point(point, workspace) - X_PC.translation();
      circle.motor = coupling.motor;
      circle.u = d - axis.dot(d) * axis;
      circle.v = std::copysign(1.0, coupling.multiplier) * axis.cross(circle.u);
      circle.centre = X_PC.translation() + axis.dot(d) * axis;
      ++point;
    }
  }
  return {};
}

void EmbodimentMapping::step(const HandState& state, FingerTarget& target) noexcept {
  target.frame_number = state.frame_number;
  target.t_capture = state.t_capture;
  target.t_arrival = state.t_arrival;
  target.joint_count = motors_.size();
  target.residual_m.fill(0.0);
  target.valid = state.valid;
  std::array<bool, kFingers> follows{};  // a finger without any estimate takes no part
  std::array<bool, kMaxHandJoints> followed{}, moved{};
  target.joint_confidence.fill(1.0);  // of a motor that moves no finger
  for (std::size_t finger = 0; finger < kFingers; ++finger) {
    const std::size_t motor = circles_[finger][0].motor;
    if (motor == kNoIndex) continue;
    follows[finger] = state.quality[finger] != FingerQuality::kNone;
    moved[motor] = true;
    if (!follows[finger]) continue;
    followed[motor] = true;
    const double confidence = std::isfinite(state.confidence[finger]) ? state.confidence[finger] : 0.0;
    target.joint_confidence[motor] = std::min(target.joint_confidence[motor], confidence);
  }
  for (std::size_t m = 0; m < motors_.size(); ++m) {
    if (moved[m] && !followed[m]) target.joint_confidence[m] = 0.0;
  }
  // Per motor: cost = const - 2 (U cos(k r) + V sin(k r)), summed over the points that the motor moves.
  std::array<double, kMaxHandJoints> U{}, V{};
  std::array<std::array<Eigen::Vector3d, 2>, kFingers> p_P;
  for (std::size_t finger = 0; finger < kFingers; ++finger) {
    for (std::size_t i = 0; i < 2; ++i) {
      const Circle& circle = circles_[finger][i];
      if (!follows[finger]) continue;
      p_P[finger][i] = X_PM_ * state.p_M[finger][i];
      const Eigen::Vector3d s = p_P[finger][i] - circle.centre;
      U[circle.motor] += s.dot(circle.u);
      V[circle.motor] += s.dot(circle.v);
    }
  }
  for (std::size_t m = 0; m < motors_.size(); ++m) {
    target.valid = target.valid && std::isfinite(U[m]) && std::isfinite(V[m]);
  }
  for (std::size_t m = 0; target.valid && m < motors_.size(); ++m) {
    if (moved[m] && !followed[m]) continue;  // keeps its angle
    const Motor& motor = motors_[m];
    last_rad_[m] = best_angle(U[m], V[m], motor.ratio, motor.lower_rad, motor.upper_rad, last_rad_[m]);
  }
  std::copy_n(last_rad_.begin(), motors_.size(), target.q_rad.begin());
  if (!target.valid) return;
  const auto g_P = finger_points(last_rad_);
  for (std::size_t finger = 0; finger < kFingers; ++finger) {
    if (!follows[finger]) continue;
    const double sum_m2 =
        (p_P[finger][0] - g_P[finger][0]).squaredNorm() + (p_P[finger][1] - g_P[finger][1]).squaredNorm();
    target.residual_m[finger] = std::sqrt(sum_m2 / 2.0);
  }
}

HandJointAngles EmbodimentMapping::urdf_joint_angles(std::span<const double> r_rad) const noexcept {
  std::array<double, robot::kMaxHandLinks> all{};
  kinematics_.joint_angles(r_rad, all);
  HandJointAngles angles;
  angles.count = urdf_joints_.size();
  for (std::size_t i = 0; i < angles.count; ++i) angles.q_rad[i] = all[urdf_joints_[i]];
  return angles;
}

std::array<std::array<Eigen::Vector3d, 2>, kFingers> EmbodimentMapping::finger_points(
    std::span<const double> r_rad) const noexcept {
  std::array<std::array<Eigen::Vector3d, 2>, kFingers> p_P;
  for (std::size_t finger = 0; finger < kFingers; ++finger) {
    for (std::size_t i = 0; i < 2; ++i) {
      const Circle& circle = circles_[finger][i];
      if (circle.motor == kNoIndex) {
        p_P[finger][i].setConstant(std::numeric_limits<double>::quiet_NaN());
        continue;
      }
      const double angle = motors_[circle.motor].ratio * r_rad[circle.motor];
      p_P[finger][i] = circle.centre + std::cos(angle) * circle.u + std::sin(angle) * circle.v;
    }
  }
  return p_P;
}

}  // namespace embody
