#pragma once
// From the configuration to the objects of core: shared by the daemon and the simulated lab, so both mean the same.
#include "core/embodiment/embodiment_mapping.hpp"
#include "core/hand/hand_state_filter.hpp"
#include "core/hand/palm_pose_estimator.hpp"
#include "core/teleop/arm_controller.hpp"
#include "core/teleop/pose_monitor.hpp"
#include "core/teleop/pose_predictor.hpp"
#include "daemon/app/operator_models.hpp"

namespace embody {

/// Everything that the data path is made of.
struct Models {
  hand::GloveLayout glove;  ///< slots of a frame: of the marker glove, or of the landmarks
  hand::PoseEstimator hand_pose;
  hand::FingerEstimator fingers;
  hand::HandStateFilter filter;
  teleop::PoseMonitor monitor;
  teleop::PosePredictor predictor;
  EmbodimentMapping embodiment;
  teleop::ArmControllerConfig arm;
};

/// The robot hand's URDF, mirrored when the hand that is driven is of the other side. Errors: of the file (its name is
/// in the sentence), kMalformed, kUnsupported.
[[nodiscard]] Result<robot::RobotModel> load_hand_model(const EmbodimentConfig& hand);
/// The mapping onto that hand. Errors as load_hand_model() and EmbodimentMapping::create().
[[nodiscard]] Result<EmbodimentMapping> make_embodiment(const EmbodimentConfig& hand);

/// Reads the hand's URDF and the operator's hand model and builds the models. Errors: kNotFound, kMalformed,
/// kInvalidArgument; the sentence names the file or key.
[[nodiscard]] Result<Models> make_models(const config::EmbodyConfig& config);

}  // namespace embody
