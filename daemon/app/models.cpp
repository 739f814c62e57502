#include "daemon/app/models.hpp"

#include "core/embodiment/mirror_config.hpp"
#include "core/robot/mirror.hpp"
#include "core/robot/urdf_model.hpp"
#include "drivers/transport/file.hpp"

namespace embody {
namespace {

Vector6 vector6(const std::array<double, 6>& values) {
  return Eigen::Map<const Vector6>(values.data());
}
Eigen::Vector3d vector3(const std::array<double, 3>& values) {
  return Eigen::Map<const Eigen::Vector3d>(values.data());
}

hand::PoseEstimator make_hand_pose(const config::EmbodyConfig& config, const OperatorModels& models) {
  if (config.tracker.driver == config::TrackerDriver::kLandmarks) return hand::PalmPoseEstimator(models.hand_model());
  if (!config.tracker.rigid_body.empty()) {
    hand::BodyPoseConfig body;
    body.X_BodyH = math::pose_from(vector3(config.tracker.p_BodyH_m), vector3(config.tracker.r_BodyH_rad));
    return hand::HandPoseEstimator(body, models.X_HM);
  }
  return hand::HandPoseEstimator(models.layout, models.X_HM);
}

hand::HandStateFilter make_filter(const config::FilterConfig& config, const hand::HandModel& model) {
  hand::HandStateFilterConfig filter;
  filter.lag_at_rest = config.lag_at_rest;
  filter.lag_in_motion = config.lag_in_motion;
  filter.motion_rad_s = config.motion_rad_s;
  filter.predict = config.predict;
  filter.predict_limit_rad = config.predict_limit_rad;
  return {model, filter};
}

/// Poses of a slow sensor follow each other without a gap too.
teleop::PoseMonitor make_monitor(const config::TrackerConfig& tracker) {
  constexpr double kPeriods = 2.5, kUsualRate_hz = 50.0;
  const bool slow = tracker.driver == config::TrackerDriver::kLandmarks && tracker.landmarks.rate_hz < kUsualRate_hz;
  return slow ? teleop::PoseMonitor(from_seconds(kPeriods / tracker.landmarks.rate_hz)) : teleop::PoseMonitor();
}

teleop::PosePredictor make_predictor(const config::FilterConfig& config) {
  teleop::PosePredictorConfig predictor;
  predictor.ahead = config.predict_pose;
  predictor.limit_m = config.predict_pose_limit_m;
  predictor.limit_rad = config.predict_pose_limit_rad;
  return teleop::PosePredictor(predictor);
}

teleop::ArmControllerConfig make_arm(const config::EmbodyConfig& config, const Pose& X_PM) {
  const config::ArmConfig& arm = config.arm;
  teleop::ArmControllerConfig controller;
  controller.X_BW = math::pose_from(vector3(config.cell.p_WB_m), vector3(config.cell.r_WB_rad)).inverse();
  controller.X_EP = math::pose_from(vector3(config.cell.p_EP_m), vector3(config.cell.r_EP_rad));
  controller.X_PM = X_PM;
  controller.geometry = robot::model_of(arm.model).geometry;
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

Result<robot::RobotModel> load_hand_model(const EmbodimentConfig& hand) {
  const auto text = transport::load_text(hand.urdf, robot::kMaxUrdfBytes, "a robot model (.urdf)");
  if (!text) return text.error();
  Result<robot::RobotModel> model = robot::load_urdf(*text);
  if (!model) {
    return make_error(model.error().code, "%s: %s", hand.urdf.c_str(), model.error().detail.c_str());
  }
  if (hand.side != hand.file_side) return robot::mirrored(*model);
  return model;
}

Result<EmbodimentMapping> make_embodiment(const EmbodimentConfig& hand) {
  const Result<robot::RobotModel> model = load_hand_model(hand);
  if (!model) return model.error();
  return EmbodimentMapping::create(*model, hand.side != hand.file_side ? mirrored(hand) : hand);
}

Result<Models> make_models(const config::EmbodyConfig& config) {
  const Result<OperatorModels> models = make_operator_models(config);
  if (!models) return models.error();
  Result<EmbodimentMapping> embodiment = make_embodiment(config.hand.embodiment);
  if (!embodiment) return embodiment.error();
  const hand::HandModel model = models->hand_model();
  const teleop::ArmControllerConfig arm = make_arm(config, embodiment->X_PM());
  return Models{models->layout,
                make_hand_pose(config, *models),
                hand::FingerEstimator(model, models->layout, models->fingers),
                make_filter(config.record_mapping.filter, model),
                make_monitor(config.tracker),
                make_predictor(config.record_mapping.filter),
                std::move(*embodiment),
                arm};
}

}  // namespace embody
