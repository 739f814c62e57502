#include "core/robot/hand_kinematics.hpp"

#include <algorithm>
#include <cmath>

namespace embody::robot {
namespace {

Error unknown(const char* kind, const std::string& name) {
  return make_error(Errc::kNotFound, "robot hand: the URDF has no %s '%.60s'", kind, name.c_str());
}

/// Index of an independent, moving joint.
Result<std::size_t> find_independent(const RobotModel& model, const std::string& name) {
  const auto joint = model.find_joint(name);
  if (!joint) return unknown("joint", name);
  if (model.joints[*joint].type == JointType::kFixed || model.joints[*joint].mimic) {
    return make_error(Errc::kInvalidArgument, "robot hand: joint '%.60s' is fixed or mimics another, it has no motor",
                      name.c_str());
  }
  return *joint;
}

/// The knots, checked against each other and against the limits of the joint.
Result<Coupling> make_coupling(const NamedCoupling& named, std::size_t motor, const Joint& joint) {
  constexpr double kRounding = 1e-6;  // of numbers in files
  if (named.knots.size() < 2 || named.knots.size() > kMaxKnots) {
    return make_error(Errc::kInvalidArgument, "robot hand: the coupling of joint '%.60s' needs 2 to %zu knots",
                      named.joint.c_str(), kMaxKnots);
  }
  Coupling coupling;
  coupling.motor = motor;
  for (const Knot& knot : named.knots) {
    const bool increasing = coupling.knots.empty() || knot.motor > coupling.knots[coupling.knots.size() - 1].motor;
    if (!std::isfinite(knot.motor) || !std::isfinite(knot.joint) || !increasing) {
      return make_error(Errc::kInvalidArgument, "robot hand: the coupling of joint '%.60s': motor_rad must increase",
                        named.joint.c_str());
    }
    if (!(knot.joint >= joint.lower - kRounding && knot.joint <= joint.upper + kRounding)) {
      return make_error(Errc::kInvalidArgument,
                        "robot hand: the coupling of joint '%.60s' leaves the joint's limits (%g)", named.joint.c_str(),
                        knot.joint);
    }
    coupling.knots.push_back(knot);
  }
  return coupling;
}

math::Pose joint_motion(const Joint& joint, double q) noexcept {
  math::Pose X = math::Pose::Identity();
  if (joint.type == JointType::kPrismatic) {
    X.translation() = q * joint.axis;
  } else if (joint.type != JointType::kFixed) {
    X.linear() = Eigen::AngleAxisd(q, joint.axis).toRotationMatrix();
  }
  return X;
}

}  // namespace

Result<HandKinematics> HandKinematics::create(const RobotModel& model, const HandKinematicsSpec& spec) {
  if (model.links.size() > kMaxHandLinks || spec.points.size() > kMaxHandPoints || spec.motors.size() > kMaxMotors) {
    return make_error(Errc::kUnsupported, "robot hand: more than %zu links, %zu points or %zu motors", kMaxHandLinks,
                      kMaxHandPoints, kMaxMotors);
  }
  HandKinematics hand;
  hand.model_ = model;
  hand.couplings_.resize(model.joints.size());
  hand.zero_offsets_.resize(model.joints.size(), 0.0);
  std::vector<bool> named(model.joints.size(), false);
  const auto claim = [&](const std::string& name) -> Result<std::size_t> {
    const Result<std::size_t> joint = find_independent(model, name);
    if (joint && named[*joint]) {
      return make_error(Errc::kInvalidArgument, "robot hand: joint '%.60s' is named twice", name.c_str());
    }
    if (joint) named[*joint] = true;
    return joint;
  };
  hand.motor_count_ = spec.motors.size();
  std::vector<bool> moves(spec.motors.size(), false);
  for (const NamedCoupling& named_coupling : spec.couplings) {
    const Result<std::size_t> joint = claim(named_coupling.joint);
    if (!joint) return joint.error();
    const auto motor = std::find(spec.motors.begin(), spec.motors.end(), named_coupling.motor);
    if (motor == spec.motors.end()) return unknown("motor", named_coupling.motor);
    const auto m = static_cast<std::size_t>(motor - spec.motors.begin());
    const Result<Coupling> coupling = make_coupling(named_coupling, m, model.joints[*joint]);
    if (!coupling) return coupling.error();
    hand.couplings_[*joint] = *coupling;
    moves[m] = true;
  }
  for (std::size_t m = 0; m < spec.motors.size(); ++m) {
    if (std::count(spec.motors.begin(), spec.motors.end(), spec.motors[m]) > 1) {
      return make_error(Errc::kInvalidArgument, "robot hand: motor '%.60s' is named twice", spec.motors[m].c_str());
    }
    const auto own = model.find_joint(spec.motors[m]);
    if (moves[m] && (!own || named[*own])) continue;  // moves other joints, or its own through knots
    const Result<std::size_t> joint = claim(spec.motors[m]);
    if (!joint) return joint.error();
    hand.couplings_[*joint] = {m, 1.0, 0.0, {}};
  }
  for (const NamedAngle& fixed : spec.fixed_joints) {
    const Result<std::size_t> joint = claim(fixed.joint);
    if (!joint) return joint.error();
    if (!std::isfinite(fixed.angle_rad))
      return Error{Errc::kInvalidArgument, "robot hand: a fixed angle is not finite"};
    hand.couplings_[*joint].offset = fixed.angle_rad;
  }
  for (std::size_t i = 0; i < model.joints.size(); ++i) {
    if (!model.joints[i].mimic) continue;
    const Mimic& mimic = *model.joints[i].mimic;
    hand.couplings_[i] = hand.couplings_[mimic.joint].scaled(mimic.multiplier, mimic.offset);
  }
  for (const NamedAngle& zero : spec.zero_offsets) {
    const auto joint = model.find_joint(zero.joint);
    if (!joint) return unknown("joint", zero.joint);
    if (!std::isfinite(zero.angle_rad)) return Error{Errc::kInvalidArgument, "robot hand: a zero offset is not finite"};
    hand.zero_offsets_[*joint] = zero.angle_rad;
  }
  for (const LinkPoint& spec_point : spec.points) {
    const auto link = model.find_link(spec_point.link);
    if (!link) return unknown("link", spec_point.link);
    if (!spec_point.p_L.allFinite()) return Error{Errc::kInvalidArgument, "robot hand: a point is not finite"};
    Point point{*link, spec_point.p_L, {}};
    for (std::size_t j = model.links[*link].parent_joint; j != kNoIndex;
         j = model.links[model.joints[j].parent_link].parent_joint) {
      if (hand.couplings_[j].motor != kNoIndex) point.joints.push_back(j);
    }
    std::reverse(point.joints.begin(), point.joints.end());
    hand.points_.push_back(std::move(point));
  }
  return hand;
}

void HandKinematics::joint_angles(std::span<const double> r, std::span<double> q) const noexcept {
  for (std::size_t i = 0; i < couplings_.size(); ++i) {
    const Coupling& c = couplings_[i];
    q[i] = c.value(c.motor == kNoIndex ? 0.0 : r[c.motor]);
    if (c.motor != kNoIndex) q[i] = std::clamp(q[i], model_.joints[i].lower, model_.joints[i].upper);
  }
}

void HandKinematics::update(std::span<const double> r, Workspace& workspace) const noexcept {
  std::array<double, kMaxHandLinks> q{};  // a tree has fewer joints than links
  joint_angles(r, q);
  workspace.X_PL[0] = math::Pose::Identity();
  for (std::size_t i = 0; i < couplings_.size(); ++i) {
    const Joint& joint = model_.joints[i];
    const Coupling& c = couplings_[i];
    const bool free = c.motor != kNoIndex && q[i] == c.value(r[c.motor]);  // not stopped by a limit
    workspace.slopes[i] = free ? c.slope(r[c.motor]) : 0.0;
    workspace.X_PL[joint.child_link] =
        workspace.X_PL[joint.parent_link] * joint.X_PC * joint_motion(joint, q[i] + zero_offsets_[i]);
  }
}

Eigen::Vector3d HandKinematics::point(std::size_t point, const Workspace& workspace) const noexcept {
  return workspace.X_PL[points_[point].link] * points_[point].p_L;
}

HandKinematics::Jacobian HandKinematics::jacobian(std::size_t point, const Workspace& workspace) const noexcept {
  Jacobian J = Jacobian::Zero(3, static_cast<int>(motor_count()));
  const Eigen::Vector3d p_P = this->point(point, workspace);
  for (const std::size_t j : points_[point].joints) {
    const Joint& joint = model_.joints[j];
    const math::Pose& X_PC = workspace.X_PL[joint.child_link];  // turning about its own axis leaves the axis alone
    const Eigen::Vector3d axis = X_PC.linear() * joint.axis;
    const Eigen::Vector3d slope =
        joint.type == JointType::kPrismatic ? axis : axis.cross(p_P - X_PC.translation()).eval();
    J.col(static_cast<int>(couplings_[j].motor)) += workspace.slopes[j] * slope;
  }
  return J;
}

}  // namespace embody::robot
