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
  for (const std::string& name : spec.motors) {
    const Result<std::size_t> joint = claim(name);
    if (!joint) return joint.error();
    hand.couplings_[*joint] = {hand.motor_joints_.size(), 1.0, 0.0};
    hand.motor_joints_.push_back(*joint);
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
    const Coupling& leader = hand.couplings_[mimic.joint];
    hand.couplings_[i] = {leader.motor, mimic.multiplier * leader.multiplier,
                          mimic.multiplier * leader.offset + mimic.offset};
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
    q[i] = c.motor == kNoIndex ? c.offset : c.multiplier * r[c.motor] + c.offset;
  }
}

void HandKinematics::update(std::span<const double> r, Workspace& workspace) const noexcept {
  std::array<double, kMaxHandLinks> q{};  // a tree has fewer joints than links
  joint_angles(r, q);
  workspace.X_PL[0] = math::Pose::Identity();
  for (std::size_t i = 0; i < couplings_.size(); ++i) {
    const Joint& joint = model_.joints[i];
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
    J.col(static_cast<int>(couplings_[j].motor)) += couplings_[j].multiplier * slope;
  }
  return J;
}

}  // namespace embody::robot
