#pragma once
// The human side of the data path, built from the configuration: what the daemon, the calibration and the evaluation
// have in common.
#include "core/hand/finger_estimator.hpp"
#include "daemon/app/config.hpp"

namespace embody {

/// Hand, sensor and person. With a tracker of landmarks the layout and the points are those of the landmarks.
struct OperatorModels {
  hand::HandData data;                     ///< at zero shape
  hand::Shape shape{hand::Shape::Zero()};  ///< of the person
  hand::GloveLayout layout;                ///< slots of a frame
  hand::HandPoints points;                 ///< [0] tip, [1] middle, then the glove's own
  Pose X_HM{Pose::Identity()};
  hand::FingerEstimatorConfig fingers;

  /// @post satisfies HandModel's precondition: make_operator_models() has checked the points.
  [[nodiscard]] hand::HandModel hand_model() const { return {data, shape, points}; }
};

/// Reads the hand model's file if one is named. Errors: kNotFound, kPermission, kMalformed, kIo, kInvalidArgument; the
/// sentence names the file or key.
[[nodiscard]] Result<OperatorModels> make_operator_models(const config::EmbodyConfig& config);

}  // namespace embody
