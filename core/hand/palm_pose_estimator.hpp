#pragma once
// Pose of the human hand from the landmarks of its palm, and one face for both kinds of sensor.
#include <variant>

#include "core/hand/hand_model.hpp"
#include "core/hand/hand_pose_estimator.hpp"
#include "core/hand/landmark_layout.hpp"

namespace embody::hand {

/// How a set of points lies relative to a known one.
struct PalmFit {
  Pose X_WM{Pose::Identity()};
  double error_m{0.0};     ///< weighted root mean square distance
  double scale{1.0};       ///< size of the measured set relative to the model's; not applied
  bool determined{false};  ///< false: fewer than three points, or they span no plane; nothing else is set
};

/// A palm landmark and its place on the model.
struct PalmPair {
  Eigen::Vector3d p_W{0.0, 0.0, 0.0};
  Eigen::Vector3d p_M{0.0, 0.0, 0.0};
  double weight{0.0};
};
using PalmPairs = StaticVector<PalmPair, kPalmLandmarks.size()>;

/// X_WM = argmin sum w ||p_W - X_WM p_M||^2 over rigid motions, by the singular value decomposition of the weighted
/// covariance (Kabsch 1976; scale: Umeyama 1991, eq. 42). Pairs with a weight of zero do not count. Fixed size, no
/// heap, about 2 us.
[[nodiscard]] PalmFit fit_palm(const PalmPairs& pairs) noexcept;

struct PalmPoseConfig {
  double least_confidence{0.3};   ///< landmarks that are less sure are not used
  double fit_tolerance_m{0.025};  ///< the palm may differ from the model's by so much, root mean square
  double thumb_weight{0.25};      ///< of the thumb's base, which moves with the thumb, relative to the others
};

/// Steps once per landmark frame (slots of landmark_layout()), in the order of the frames.
class PalmPoseEstimator {
 public:
  explicit PalmPoseEstimator(const HandModel& model, const PalmPoseConfig& config = {}) noexcept;

  /// X_WM from the palm's landmarks, each weighted by its confidence, and X_WH = X_WM. Not valid, with the last pose
  /// kept, when fewer than three of them are seen, they span no plane, or they do not fit the palm. No heap. t_decoded
  /// and t_estimated are the caller's.
  [[nodiscard]] HandPose step(const MarkerFrame& frame) noexcept;

  /// Size of the person's palm relative to the model's: median over the first second of frames (at least 10, at most
  /// 128), whether they fitted or not. 0 before that. Nothing is scaled: a value far from 1 says that the subject's
  /// shape should be set.
  [[nodiscard]] double palm_scale() const noexcept { return palm_scale_; }

 private:
  void note_scale(double scale, TimePoint t_capture) noexcept;

  std::array<Eigen::Vector3d, kPalmLandmarks.size()> p_M_;
  PalmPoseConfig config_;
  HandPose last_;
  StaticVector<double, 128> scales_;
  TimePoint t_first_{};
  double palm_scale_{0.0};
};

/// The pose estimator of whichever sensor is in use.
class PoseEstimator {
 public:
  PoseEstimator(const HandPoseEstimator& glove) noexcept : kind_(glove) {}  // NOLINT(google-explicit-constructor)
  PoseEstimator(const PalmPoseEstimator& landmarks) noexcept
      : kind_(landmarks) {}  // NOLINT(google-explicit-constructor)

  [[nodiscard]] HandPose step(const MarkerFrame& frame) noexcept {
    auto* palm = std::get_if<PalmPoseEstimator>(&kind_);
    return palm != nullptr ? palm->step(frame) : std::get_if<HandPoseEstimator>(&kind_)->step(frame);
  }
  /// As PalmPoseEstimator::palm_scale(); 0 with a marker glove.
  [[nodiscard]] double palm_scale() const noexcept {
    const auto* palm = std::get_if<PalmPoseEstimator>(&kind_);
    return palm != nullptr ? palm->palm_scale() : 0.0;
  }
  /// What became of the glove's back markers in the last frame; null with landmarks.
  [[nodiscard]] const TriadCheck* triad() const noexcept {
    const auto* glove = std::get_if<HandPoseEstimator>(&kind_);
    return glove != nullptr && !glove->follows_body() ? &glove->triad() : nullptr;
  }

 private:
  std::variant<HandPoseEstimator, PalmPoseEstimator> kind_;
};

}  // namespace embody::hand
