#pragma once
// From the configuration to the objects of core: shared by the daemon and the simulated lab, so both mean the same.
#include "core/embodiment/embodiment_mapping.hpp"
#include "core/hand/finger_estimator.hpp"
#include "core/hand/hand_pose_estimator.hpp"
#include "core/teleop/arm_controller.hpp"
#include "daemon/app/config.hpp"

namespace embody {

/// Everything that the data path is made of.
struct Models {
  hand::GloveLayout glove;
  hand::HandPoseEstimator hand_pose;
  hand::FingerEstimator fingers;
  EmbodimentMapping embodiment;
  teleop::ArmControllerConfig arm;
};

/// Reads the hand's URDF and builds the models. Errors: kNotFound, kMalformed, kInvalidArgument; the sentence names the
/// file or key.
[[nodiscard]] Result<Models> make_models(const config::EmbodyConfig& config);

}  // namespace embody
