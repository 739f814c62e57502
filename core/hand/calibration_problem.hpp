#pragma once
// The maximum a posteriori problem of the calibration and one damped Gauss-Newton step of it.
// Over the hand (shape b, marker places o, X_HM, habits) and, frame by frame, the nuisances z (slip of H, finger angles
// q) it minimises
//   sum rho(||p(q, b, o) - X_MH p_H||^2) / s^2 + angle priors + slip's prior + log det A   (frames, over redundancy)
//   + priors on b, o, X_HM and habits,
// where A is the curvature in q of one finger: with it, minimising is (Laplace's approximation of) integrating over q.
// Without it hundreds of nuisances pull the hand to where angles need to move least: finger tips 20 mm too far out.
// Angles of different fingers meet only through the hand and the slip, so the normal equations are a tree of arrows:
// 9 x 9 blocks (finger, frame) under 6 x 6 blocks (frame) under one block (hand), solved by Schur complements (Triggs
// et al. 2000, Bundle Adjustment, section 6).
#include <Eigen/Cholesky>
#include <optional>
#include <vector>

#include "core/hand/calibration.hpp"
#include "core/hand/calibration_frames.hpp"
#include "core/hand/calibration_prior.hpp"

namespace embody::hand {

/// What is to be found.
struct CalibrationVariables {
  struct Frame {
    Vector6 slip{Vector6::Zero()};  ///< pose of the true M in the M that the back markers give: rotation, translation
    std::array<Vector9, kFingers> q_rad{};
  };
  Shape shape{Shape::Zero()};
  Pose X_HM{Pose::Identity()};
  std::array<Habit, kFingers> habit_rad{};
  std::vector<Eigen::Vector3d> offset_m;  ///< of each marker on its bone
  std::vector<Frame> frames;
};

/// A marker of the glove as the calibration knows it.
struct CalibrationMarker {
  std::size_t slot{0};
  Finger finger{Finger::kThumb};
  std::size_t joint{0};
  std::size_t point{0};  ///< among the markers of its finger
  Eigen::Vector3d nominal_m{0.0, 0.0, 0.0};
};

/// rho(e) for e = squared distance: what keeps drop-outs, swaps and ghosts harmless.
struct RobustLoss {
  bool gated{false};     ///< min(e, c^2) instead of Geman & McClure's e / (1 + e / c^2)
  double scale_m{0.04};  ///< c

  [[nodiscard]] double rho(double e) const noexcept {
    const double c2 = scale_m * scale_m;
    return gated ? (e < c2 ? e : c2) : e / (1.0 + e / c2);
  }
  [[nodiscard]] double weight(double e) const noexcept {
    const double c2 = scale_m * scale_m;
    if (gated) return e < c2 ? 1.0 : 0.0;
    return 1.0 / ((1.0 + e / c2) * (1.0 + e / c2));
  }
};

class CalibrationProblem {
 public:
  // The hand's variables: shape, X_HM (rotation, translation about M's axes), habits by finger, places by marker.
  static constexpr Eigen::Index kPoseBegin = 10, kHabitBegin = 16;
  static constexpr Eigen::Index kPlacesBegin = kHabitBegin + static_cast<Eigen::Index>(kFingers * kAngleBeliefs);

  /// @pre check_points(data, points); every marker's finger and point exist, at most kMaxFingerPoints per finger.
  CalibrationProblem(const HandData& data, const GloveLayout& glove, const HandPoints& points, const Pose& X_HM,
                     const CalibrationPrior& prior, const CalibrationFrames& frames);

  /// Nominal values and resting fingers.
  [[nodiscard]] CalibrationVariables nominal() const;
  [[nodiscard]] double cost(const CalibrationVariables& at) const;

  /// Frees fingers from wrong postures: each finger of each frame is fitted again from its habit and from its postures
  /// in the frames before and after, and keeps the best. Returns how many changed by more than rounding.
  std::size_t restart_angles(CalibrationVariables& at) const;

  /// A few damped steps of each finger of each frame on its own, the hand and slips held.
  void settle_angles(CalibrationVariables& at) const;

  /// The normal equations at `at`, with `damping` times the diagonal added, solved. False: not positive definite.
  [[nodiscard]] bool step(const CalibrationVariables& at, double damping, CalibrationVariables& next);

  struct Certainty {
    /// Of the hand's variables: the greater, variable by variable, of Laplace's approximation and the sandwich of
    /// scores summed over stretches of the recording.
    Eigen::VectorXd sd;
    double redundancy{1.0};  ///< frames that say what one says: how much scores of the same time agree
    std::array<Habit, kFingers> spread_rad{};  ///< about the habit, of each belief, expected over the posterior
    double noise_m{0.0};                       ///< of a marker, per axis: residuals over their degrees of freedom
  };
  /// Laplace's approximation at `at`. The noise counts only markers of weight > 1/2.
  [[nodiscard]] Certainty certainty(const CalibrationVariables& at);

  [[nodiscard]] const std::vector<CalibrationMarker>& markers() const noexcept { return markers_; }
  [[nodiscard]] const AnglePrior& angle_prior(std::size_t finger) const noexcept { return angle_priors_[finger]; }
  [[nodiscard]] const CalibrationFrames& frames() const noexcept { return frames_; }
  [[nodiscard]] Eigen::VectorXd prior_sd() const;
  /// Distance of the marker to the model, m; nothing when it was not seen.
  [[nodiscard]] std::optional<double> distance_m(const CalibrationVariables& at, std::size_t frame,
                                                 std::size_t marker) const;

  void set_spreads(const std::array<Habit, kFingers>& spread_rad);
  void set_loss(const RobustLoss& loss) noexcept { loss_ = loss; }
  [[nodiscard]] const RobustLoss& loss() const noexcept { return loss_; }
  /// Each frame counts as 1 / redundancy of a frame.
  void set_redundancy(double redundancy) noexcept { redundancy_ = redundancy; }
  void set_noise(double noise_m) noexcept { noise_m_ = noise_m; }
  [[nodiscard]] double noise() const noexcept { return noise_m_; }

 private:
  static constexpr int kMaxLocal = 32 + 3 * static_cast<int>(kMaxFingerPoints);
  using Local = Eigen::Matrix<double, 9, Eigen::Dynamic, 0, 9, kMaxLocal>;
  using LocalSquare = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxLocal, kMaxLocal>;
  using LocalVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxLocal, 1>;

  // One finger in one frame. Its local variables are slip 6, shape 10, X_HM 6, habit 10, and the
  // places of its markers.
  struct FingerBlock {
    Matrix9 prior, hessian;  // of the angles: of their prior alone, and all of it
    Eigen::LLT<Matrix9> factor;
    Vector9 gradient;
    Local coupling;  // of the angles with the local variables
    LocalSquare local_hessian;
    LocalVector local_gradient;
    // What the volume of posture space needs: every marker that was seen, outliers too.
    struct Seen {
      std::size_t marker{0};
      PointJacobian J;
    };
    FingerChain chain;
    StaticVector<Seen, kMaxFingerPoints> seen;
    Matrix9 volume;
  };
  struct FrameBlock {
    std::array<FingerBlock, kFingers> fingers;
    Eigen::LLT<Eigen::Matrix<double, 6, 6>> factor;  // of the slip, fingers eliminated
    Vector6 gradient;
    Eigen::Matrix<double, 6, Eigen::Dynamic> coupling;  // with the hand
  };

  void hand_certainty(const Eigen::MatrixXd& covariance, Certainty& out) const;
  [[nodiscard]] double finger_certainty(const CalibrationVariables& at, std::size_t frame, std::size_t finger,
                                        const LocalSquare& local, Certainty& out) const;
  [[nodiscard]] HandModel model_of(const CalibrationVariables& at) const;
  [[nodiscard]] Eigen::Index hand_size() const noexcept {
    return kPlacesBegin + 3 * static_cast<Eigen::Index>(markers_.size());
  }
  [[nodiscard]] std::vector<Eigen::Index> hand_columns(std::size_t finger) const;
  void linearise(const CalibrationVariables& at, const HandModel& model, std::size_t frame, std::size_t finger,
                 FingerBlock& block) const;
  void add_volume_gradient(const HandModel& model, std::size_t finger, FingerBlock& block) const;
  [[nodiscard]] double finger_cost(const CalibrationVariables& at, const HandModel& model, std::size_t frame,
                                   std::size_t finger, const Vector9& q_rad) const;
  double settle_finger(CalibrationVariables& at, const HandModel& model, std::size_t frame, std::size_t finger,
                       int iterations, FingerBlock& block) const;
  void add_hand_prior(const CalibrationVariables& at);
  [[nodiscard]] bool eliminate(const CalibrationVariables& at, double damping);

  const HandData& data_;
  CalibrationPrior prior_;
  CalibrationFrames frames_;
  Pose X_HM_nominal_;
  std::vector<CalibrationMarker> markers_;
  std::array<std::vector<std::size_t>, kFingers> of_finger_;
  std::vector<AnglePrior> angle_priors_;
  Eigen::Matrix<double, 6, 6> slip_information_;
  RobustLoss loss_;
  double noise_m_{0.001};
  double redundancy_{1.0};

  std::vector<FrameBlock> blocks_;
  Eigen::MatrixXd scores_;  // gradients of the hand's variables, a column per frame, nuisances eliminated
  Eigen::MatrixXd hand_hessian_;
  Eigen::VectorXd hand_gradient_;
};

/// Moves `at` to the maximum a posteriori, robustly; leaves the problem with the loss and noise that it ended with.
void solve(CalibrationProblem& problem, CalibrationVariables& at, const CalibrationOptions& options);

}  // namespace embody::hand
