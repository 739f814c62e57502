#include "core/robot/mirror.hpp"

namespace embody::robot {
namespace {

const Eigen::Vector3d kS{-1.0, 1.0, 1.0};  // diagonal of S

}  // namespace

Eigen::Vector3d mirrored(const Eigen::Vector3d& p) noexcept {
  return kS.cwiseProduct(p);
}

math::Pose mirrored(const math::Pose& X_AB) noexcept {
  math::Pose X = math::Pose::Identity();
  X.linear() = kS.asDiagonal() * X_AB.linear() * kS.asDiagonal();
  X.translation() = mirrored(Eigen::Vector3d(X_AB.translation()));
  return X;
}

math::Vector6 mirrored_exponential(const math::Vector6& w_v) noexcept {
  math::Vector6 out;
  out << -kS.cwiseProduct(w_v.head<3>()), kS.cwiseProduct(w_v.tail<3>());
  return out;
}

RobotModel mirrored(const RobotModel& model) {
  RobotModel out = model;
  for (Joint& joint : out.joints) {
    joint.X_PC = mirrored(joint.X_PC);
    // A reflection turns a right-handed turn into a left-handed one: S R(a, q) S = R(-S a, q). A slide has no sense.
    const Eigen::Vector3d axis = mirrored(joint.axis);
    joint.axis = joint.type == JointType::kPrismatic ? axis : Eigen::Vector3d(-axis);
  }
  return out;
}

}  // namespace embody::robot
