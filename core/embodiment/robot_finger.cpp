#include "core/embodiment/robot_finger.hpp"

#include <algorithm>
#include <cmath>

namespace embody {
namespace {

using robot::Coupling;
using robot::Joint;
using robot::JointType;
using robot::kNoIndex;
using robot::RobotModel;

/// Joints from the root to a link, root first.
std::vector<std::size_t> path_to(const RobotModel& model, std::size_t link) {
  std::vector<std::size_t> path;
  for (std::size_t j = model.links[link].parent_joint; j != kNoIndex;
       j = model.links[model.joints[j].parent_link].parent_joint) {
    path.push_back(j);
  }
  std::reverse(path.begin(), path.end());
  return path;
}

/// Pose of a joint that stands still.
Pose fixed_pose(const Joint& joint, double q) {
  Pose X = joint.X_PC;
  if (joint.type == JointType::kPrismatic) {
    X.translation() += X.linear() * (q * joint.axis);
  } else if (joint.type != JointType::kFixed) {
    X.linear() = X.linear() * Eigen::AngleAxisd(q, joint.axis).toRotationMatrix();
  }
  return X;
}

}  // namespace

Result<RobotFinger> RobotFinger::create(const robot::HandKinematics& hand, const FingerPoints& points) {
  const RobotModel& model = hand.model();
  const auto tip_link = model.find_link(points.link);
  if (!tip_link) {
    return make_error(Errc::kNotFound, "robot hand: the URDF has no link '%.60s'", points.link.c_str());
  }
  RobotFinger chain;
  struct Frame {
    std::size_t link, joint;
    Pose X_JL;
  };
  std::vector<Frame> frames{{0, kNoIndex, Pose::Identity()}};  // links on the way and what they hang on
  Pose X = Pose::Identity();                                   // the present link in the last moving joint's frame
  for (const std::size_t j : path_to(model, *tip_link)) {
    const Joint& joint = model.joints[j];
    const Coupling& coupling = hand.couplings()[j];
    if (joint.type == JointType::kFixed || coupling.motor == kNoIndex) {
      X = X * fixed_pose(joint, coupling.value(0.0) + hand.zero_offsets()[j]);
    } else {
      X = X * joint.X_PC;
      const MovingJoint moving{X.linear(),
                               X.translation(),
                               joint.axis,
                               coupling,
                               hand.zero_offsets()[j],
                               joint.lower,
                               joint.upper,
                               joint.type == JointType::kPrismatic};
      if (!chain.joints_.push_back(moving)) {
        return make_error(Errc::kUnsupported, "robot hand: more than %zu joints move link '%.60s'", kMaxChainJoints,
                          points.link.c_str());
      }
      if (std::find(chain.motors_.begin(), chain.motors_.end(), coupling.motor) == chain.motors_.end()) {
        chain.motors_.push_back(coupling.motor);
      }
      X = Pose::Identity();
    }
    frames.push_back({joint.child_link, chain.joints_.empty() ? kNoIndex : chain.joints_.size() - 1, X});
  }
  const auto attach = [&](const std::string& link, const Eigen::Vector3d& p_L, Attachment& out) -> Status {
    const auto index = model.find_link(link);
    if (!index) return make_error(Errc::kNotFound, "robot hand: the URDF has no link '%.60s'", link.c_str());
    if (!p_L.allFinite()) return Error{Errc::kInvalidArgument, "robot hand: a point is not finite"};
    for (const Frame& frame : frames) {
      if (frame.link != *index) continue;
      out.joint = frame.joint;
      out.p_J = frame.X_JL * p_L;
      return {};
    }
    return make_error(Errc::kUnsupported, "robot hand: link '%.60s' is not between the palm and '%.60s'", link.c_str(),
                      points.link.c_str());
  };
  Status status = attach(points.link, points.tip_m, chain.tip_);
  if (status)
    status = attach(points.middle_link.empty() ? points.link : points.middle_link, points.middle_m, chain.middle_);
  if (status && !points.pads.empty()) {
    const ContactPad& pad = points.pads.front();
    status = attach(pad.link, pad.from_m, chain.pad_from_);
    if (status) status = attach(pad.link, pad.to_m, chain.pad_to_);
    chain.pad_radius_m_ = pad.radius_m;
    chain.has_pad_ = true;
  }
  if (!status) return status.error();
  return chain;
}

void RobotFinger::update(std::span<const double> r, std::span<const double> piece, Posture& posture) const noexcept {
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    const MovingJoint& joint = joints_[i];
    const std::size_t motor = joint.coupling.motor;
    const double q = std::clamp(joint.coupling.value(r[motor]), joint.lower, joint.upper) + joint.zero;
    Eigen::Matrix3d R = joint.R_parent;
    Eigen::Vector3d p = joint.p_parent;
    if (i > 0) {
      p = posture.p_PJ[i - 1] + posture.R_PJ[i - 1] * p;
      R = posture.R_PJ[i - 1] * joint.R_parent;
    }
    const Eigen::Vector3d axis = R * joint.axis;
    posture.axes_P[i] = joint.coupling.slope(piece[motor]) * axis;
    posture.p_PJ[i] = joint.prismatic ? (p + q * axis).eval() : p;
    posture.R_PJ[i] = joint.prismatic ? R : (R * Eigen::AngleAxisd(q, joint.axis).toRotationMatrix()).eval();
  }
}

Eigen::Vector3d RobotFinger::position(const Attachment& point, const Posture& posture) const noexcept {
  if (point.joint == kNoIndex) return point.p_J;
  return posture.p_PJ[point.joint] + posture.R_PJ[point.joint] * point.p_J;
}

}  // namespace embody
