#include "core/embodiment/onboarding.hpp"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "core/hand/hand_model.hpp"
#include "core/math/so3_jacobian.hpp"

namespace embody {
namespace {

using Eigen::Vector3d;
using robot::SerialFinger;

constexpr double kTipHeight_m = 0.010;     // of the tip point over the tip, dorsally
constexpr double kMiddleHeight_m = 0.015;  // of the middle point over the first phalanx
constexpr double kMiddlePlace = 0.22;      // of the finger's length, from the knuckle
constexpr double kLeastPhalanx_m = 0.02;
constexpr double kLeastPad_m = 0.005;

/// Unit vector across `along` against the closing motion: out of the back of the finger.
Vector3d dorsal_P(const robot::HandAnatomy& anatomy, const SerialFinger& chain, const Vector3d& along) {
  const auto across = [&](const Vector3d& v) { return Vector3d(v - v.dot(along) * along); };
  Vector3d dorsal = across(-chain.v_closing_P.normalized());
  if (!(dorsal.norm() > 1e-3)) dorsal = across(-anatomy.X_PQ.linear().col(1));
  return dorsal.norm() > 1e-3 ? Vector3d(dorsal.normalized()) : Vector3d::Zero();
}

/// From the knuckle to the next joint that is a phalanx away, else to the tip.
Vector3d first_phalanx_P(const std::vector<Pose>& X_PL, const robot::RobotModel& model, const SerialFinger& chain) {
  for (std::size_t i = chain.knuckle + 1; i < chain.joints.size(); ++i) {
    Vector3d p = X_PL[model.joints[chain.joints[i]].child_link].translation() - chain.p_knuckle_P;
    if (p.norm() > kLeastPhalanx_m) return p;
  }
  return chain.p_tip_P - chain.p_knuckle_P;
}

ContactPad make_pad(const robot::RobotModel& model, const robot::HandAnatomy& anatomy, const SerialFinger& chain,
                    const Pose& X_PL) {
  const Vector3d link = chain.p_tip_P - chain.p_last_P;
  const Vector3d along = link.normalized();
  ContactPad pad;
  pad.link = model.links[chain.last_link].name;
  pad.radius_m = std::min(kDefaultPadRadius_m, 0.25 * link.norm());
  pad.from_m = X_PL.inverse() * Vector3d(chain.p_last_P + link / 3.0);
  pad.to_m = X_PL.inverse() * Vector3d(chain.p_tip_P - pad.radius_m * along);
  pad.facing = -(X_PL.linear().transpose() * dorsal_P(anatomy, chain, along));
  return pad;
}

FingerPoints make_points(const robot::RobotModel& model, const robot::HandAnatomy& anatomy, const SerialFinger& chain,
                         const std::vector<Pose>& X_PL) {
  FingerPoints points;
  const Vector3d last = chain.p_tip_P - chain.p_last_P;
  const Vector3d along = last.norm() > kLeastPad_m ? Vector3d(last.normalized()) : chain.direction_P();
  points.link = model.links[chain.tip_link].name;
  points.tip_m =
      X_PL[chain.tip_link].inverse() * Vector3d(chain.p_tip_P + kTipHeight_m * dorsal_P(anatomy, chain, along));
  const std::size_t middle_link = model.joints[chain.joints[chain.knuckle]].child_link;
  const Vector3d phalanx = first_phalanx_P(X_PL, model, chain);
  const double length_m = (chain.p_tip_P - chain.p_knuckle_P).norm();
  const Vector3d direction = phalanx.norm() > 1e-6 ? Vector3d(phalanx.normalized()) : Vector3d::Zero();
  const Vector3d middle_P = chain.p_knuckle_P + std::min(kMiddlePlace * length_m, 0.6 * phalanx.norm()) * direction +
                            kMiddleHeight_m * dorsal_P(anatomy, chain, direction);
  points.middle_link = model.links[middle_link].name;
  points.middle_m = X_PL[middle_link].inverse() * middle_P;
  if (last.norm() > kLeastPad_m) points.pads.push_back(make_pad(model, anatomy, chain, X_PL[chain.last_link]));
  return points;
}

void add_motors(const robot::RobotModel& model, const SerialFinger& chain, EmbodimentConfig& config) {
  for (const std::size_t j : chain.joints) {
    const std::size_t source = model.joints[j].mimic ? model.joints[j].mimic->joint : j;
    const std::string& name = model.joints[source].name;
    if (std::find(config.motors.begin(), config.motors.end(), name) != config.motors.end()) continue;
    const robot::JointRange range = robot::motor_range(model, source);
    if (!(range.lower < range.upper)) continue;
    config.motors.push_back(name);
    config.motor_lower_rad.push_back(range.lower);
    config.motor_upper_rad.push_back(range.upper);
  }
}

/// Exponential coordinates of a pose: math::exp_se3() of them is the pose.
Vector6 log_se3(const Pose& X) {
  Vector6 S;
  S.head<3>() = math::log_so3(X.linear());
  S.tail<3>() = math::left_jacobian_so3(S.head<3>()).inverse() * X.translation();
  return S;
}

}  // namespace

FlatHandMatch match_flat_hand(const robot::HandAnatomy& anatomy) {
  const hand::HandData human = hand::builtin_hand(hand::Skeleton::kBoneLengths, anatomy.side);
  std::vector<Vector3d> human_M, robot_P;
  const auto count =
      std::count_if(anatomy.fingers.begin() + 1, anatomy.fingers.end(), [](const auto& f) { return f.has_value(); });
  for (std::size_t f = 0; f < kFingers; ++f) {
    if (!anatomy.fingers[f]) continue;
    const std::size_t knuckle = hand::first_joint(static_cast<Finger>(f)) + (f == 0 ? 1 : 0);
    human_M.push_back(human.joints_M.col(static_cast<Eigen::Index>(knuckle)));
    robot_P.push_back(anatomy.fingers[f]->p_knuckle_P);
    if (f == 0 && count > 1) continue;
    human_M.push_back(human.tips_M.col(static_cast<Eigen::Index>(f)));
    robot_P.push_back(anatomy.fingers[f]->p_tip_P);
  }
  const auto n = static_cast<Eigen::Index>(human_M.size());
  Eigen::Matrix3Xd from(3, n), to(3, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    from.col(i) = human_M[static_cast<std::size_t>(i)];
    to.col(i) = robot_P[static_cast<std::size_t>(i)];
  }
  FlatHandMatch match;
  match.X_PM.matrix() = Eigen::umeyama(from, to, false);
  match.rms_m = std::sqrt(((match.X_PM * from) - to).squaredNorm() / static_cast<double>(n));
  return match;
}

Result<EmbodimentConfig> propose_config(const robot::RobotModel& model, const robot::HandAnatomy& anatomy,
                                        const OnboardingOptions& options) {
  EmbodimentConfig config;
  config.name = options.name.empty() ? model.name : options.name;
  config.urdf = options.urdf;
  config.root_link = model.links.front().name;
  config.side = config.file_side = anatomy.side;
  config.X_PM = log_se3(match_flat_hand(anatomy).X_PM);
  const std::vector<Pose> X_PL = robot::link_poses(model, robot::open_posture(model));
  for (std::size_t f = 0; f < kFingers; ++f) {
    if (!anatomy.fingers[f]) continue;
    config.fingers[f] = make_points(model, anatomy, *anatomy.fingers[f], X_PL);
    add_motors(model, *anatomy.fingers[f], config);
  }
  if (config.motors.empty()) {
    return make_error(Errc::kUnsupported, "no finger joint of '%.60s' has a range to move in", model.name.c_str());
  }
  if (config.motors.size() > kMaxHandJoints) {
    return make_error(Errc::kUnsupported, "'%.60s' has %zu independent finger joints; at most %zu can be driven",
                      model.name.c_str(), config.motors.size(), kMaxHandJoints);
  }
  return config;
}

Result<Onboarding> onboard_hand(const robot::RobotModel& model, const OnboardingOptions& options) {
  Onboarding result;
  Result<robot::HandAnatomy> anatomy = robot::find_hand_anatomy(model);
  if (!anatomy) return anatomy.error();
  result.anatomy = std::move(*anatomy);
  Result<EmbodimentConfig> config = propose_config(model, result.anatomy, options);
  if (!config) return config.error();
  result.config = std::move(*config);
  result.score = score_hand(model, result.anatomy, result.config, options);
  result.score.fit_m = match_flat_hand(result.anatomy).rms_m;
  result.check_by_eye = onboarding_notes(model, result.anatomy, result.config, result.score);
  return result;
}

}  // namespace embody
