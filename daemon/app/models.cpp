#include "daemon/app/models.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>

#include "core/robot/urdf_model.hpp"

namespace embody {
namespace {

Vector6 vector6(const std::array<double, 6>& values) {
  return Eigen::Map<const Vector6>(values.data());
}
Eigen::Vector3d vector3(const std::array<double, 3>& values) {
  return Eigen::Map<const Eigen::Vector3d>(values.data());
}

Result<std::size_t> slot_of(const config::GloveConfig& glove, const std::string& marker) {
  const auto found = std::find(glove.names.begin(), glove.names.end(), marker);
  if (found != glove.names.end()) return static_cast<std::size_t>(found - glove.names.begin());
  return make_error(Errc::kNotFound, "[glove] names no marker '%s': add it to `names`", marker.c_str());
}

Result<hand::GloveLayout> make_glove(const config::GloveConfig& glove) {
  hand::GloveLayout layout;
  for (const std::string& name : glove.names) layout.names.push_back(FixedString<48>(std::string_view(name)));
  const std::array<const std::string*, 3> back{&glove.back.top, &glove.back.left, &glove.back.right};
  for (std::size_t i = 0; i < back.size(); ++i) {
    const Result<std::size_t> slot = slot_of(glove, *back[i]);
    if (!slot) return slot.error();
    layout.back_slots[i] = *slot;
  }
  for (const config::FingerMarkerConfig& marker : glove.finger_markers) {
    const Result<std::size_t> slot = slot_of(glove, marker.marker);
    if (!slot) return slot.error();
    layout.finger_markers.push_back({marker.finger, static_cast<int>(marker.point), *slot});
  }
  return layout;
}

hand::FingerEstimator make_fingers(const config::EmbodyConfig& config, const hand::GloveLayout& glove) {
  hand::HandModelConfig model;
  model.skeleton =
      config.subject.skeleton == config::Skeleton::kA ? hand::Skeleton::kBoneLengths : hand::Skeleton::kWebXr;
  model.attachments = hand::default_attachments(model.skeleton);
  model.shape = Eigen::Map<const Eigen::Matrix<double, 10, 1>>(config.subject.shape.data());
  hand::FingerEstimatorConfig estimator;
  estimator.lower_rad.fill(hand::Vector9::Constant(config.record_mapping.lower_rad));
  estimator.upper_rad.fill(hand::Vector9::Constant(config.record_mapping.upper_rad));
  estimator.max_iterations = config.record_mapping.max_iterations;
  return {hand::HandModel(model), glove, estimator};
}

Result<EmbodimentMapping> make_embodiment(const EmbodimentConfig& hand) {
  std::ifstream file(hand.urdf, std::ios::binary);
  if (!file) return make_error(Errc::kNotFound, "cannot read %s: %s", hand.urdf.c_str(), std::strerror(errno));
  std::string text(robot::kMaxUrdfBytes + 1, '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(file.gcount()));
  const Result<robot::RobotModel> model = robot::load_urdf(text);
  if (!model) {
    return make_error(model.error().code, "%s: %s", hand.urdf.c_str(), model.error().detail.c_str());
  }
  return EmbodimentMapping::create(*model, hand);
}

teleop::ArmControllerConfig make_arm(const config::EmbodyConfig& config, const Pose& X_PM) {
  const config::ArmConfig& arm = config.arm;
  teleop::ArmControllerConfig controller;
  controller.X_BW = math::pose_from(vector3(config.cell.p_WB_m), vector3(config.cell.r_WB_rad)).inverse();
  controller.X_EP = math::pose_from(vector3(config.cell.p_EP_m), vector3(config.cell.r_EP_rad));
  controller.X_PM = X_PM;
  controller.clutch = arm.clutch == config::Clutch::kAbsolute ? teleop::Clutch::kAbsolute : teleop::Clutch::kRelative;
  controller.blend_speed_m_s = arm.blend_speed_m_s;
  controller.blend_speed_rad_s = arm.blend_speed_rad_s;
  controller.resample_delay = arm.resample_delay;
  controller.speed_m_s = arm.limits.speed_m_s;
  controller.speed_rad_s = arm.limits.speed_rad_s;
  controller.workspace_B = {vector3(arm.limits.workspace_min_m), vector3(arm.limits.workspace_max_m)};
  controller.joints.speed_rad_s = vector6(arm.limits.joint_speed_rad_s);
  controller.joints.acceleration_rad_s2 = vector6(arm.limits.joint_acceleration_rad_s2);
  controller.joints.lower_rad = vector6(arm.limits.joint_lower_rad);
  controller.joints.upper_rad = vector6(arm.limits.joint_upper_rad);
  return controller;
}

}  // namespace

Result<Models> make_models(const config::EmbodyConfig& config) {
  const Result<hand::GloveLayout> glove = make_glove(config.glove);
  if (!glove) return glove.error();
  Result<EmbodimentMapping> embodiment = make_embodiment(config.hand.embodiment);
  if (!embodiment) return embodiment.error();
  const Pose X_HM = math::exp_se3(vector6(config.subject.X_HM_exponential));
  const teleop::ArmControllerConfig arm = make_arm(config, embodiment->X_PM());
  return Models{*glove, hand::HandPoseEstimator(*glove, X_HM), make_fingers(config, *glove), std::move(*embodiment),
                arm};
}

}  // namespace embody
