#pragma once
// A proposal of how a new robot hand follows the human hand, from its URDF alone, and how good it is likely to be.
// Rules for what the URDF does not say: the points that follow the human finger lie on the back of the finger, 10 mm
// from the tip and 15 mm from the axis of the first phalanx, 0.22 of the finger's length from the knuckle; a pad is the
// palmar half of a capsule of 8 mm radius (a quarter of the last link's length if that is less) along the outer two
// thirds of the last link; X_PM lays the flat human hand onto the open robot hand.
#include <optional>
#include <string>
#include <vector>

#include "core/base/result.hpp"
#include "core/embodiment/embodiment_config.hpp"
#include "core/robot/hand_anatomy.hpp"

namespace embody {

inline constexpr double kDefaultPadRadius_m = 0.008;
inline constexpr double kReachTolerance_m = 0.010;

struct FingerScore {
  double length_m{0.0};        ///< robot, knuckle to tip
  double human_length_m{0.0};  ///< thumb: from its second joint
  /// Fraction of human tip positions (postures drawn evenly from the anatomical ranges of FingerEstimatorConfig, mapped
  /// by X_PM) that the robot's tip point reaches within kReachTolerance_m. A finger of one motor moves on a curve: a
  /// few percent are then the most there is.
  double reach{0.0};
  std::optional<double> pinch_m;  ///< least distance that was found between the centres of its tip and the thumb's
};

struct OnboardingScore {
  std::array<std::optional<FingerScore>, kFingers> fingers;  ///< by Finger; nothing: the hand lacks it
  double scale{1.0};  ///< robot finger length / human finger length, over the fingers other than the thumb
  double fit_m{0.0};  ///< root mean square distance of the points that X_PM was found from
};

struct OnboardingOptions {
  std::string name;  ///< empty: the URDF's
  std::string urdf;  ///< file name, for the proposal
  int robot_samples{20'000};
  int human_samples{500};
};

struct Onboarding {
  EmbodimentConfig config;
  robot::HandAnatomy anatomy;
  OnboardingScore score;
  std::vector<std::string> check_by_eye;  ///< sentences: what was guessed, and on what
};

/// Proposes a configuration. Deterministic; allocates; some 0.3 s for 20 joints.
/// Errors: as robot::find_hand_anatomy(); kUnsupported (more than 32 motors, or none).
[[nodiscard]] Result<Onboarding> onboard_hand(const robot::RobotModel& model, const OnboardingOptions& options = {});

/// The parts of onboard_hand().
/// Names, motors, limits, points and pads; X_PM from match_flat_hand().
[[nodiscard]] Result<EmbodimentConfig> propose_config(const robot::RobotModel& model, const robot::HandAnatomy& anatomy,
                                                      const OnboardingOptions& options);
struct FlatHandMatch {
  Pose X_PM{Pose::Identity()};
  double rms_m{0.0};
};
/// Rigid motion that lays knuckles and tips of the flat human hand onto those of the open robot hand with the least sum
/// of squared distances (Umeyama 1991, without scale). The thumb counts with its knuckle; when there is one finger
/// beside it, with its tip as well.
[[nodiscard]] FlatHandMatch match_flat_hand(const robot::HandAnatomy& anatomy);
/// Fills everything but `fit_m`.
[[nodiscard]] OnboardingScore score_hand(const robot::RobotModel& model, const robot::HandAnatomy& anatomy,
                                         const EmbodimentConfig& config, const OnboardingOptions& options);
[[nodiscard]] std::vector<std::string> onboarding_notes(const robot::RobotModel& model,
                                                        const robot::HandAnatomy& anatomy,
                                                        const EmbodimentConfig& config, const OnboardingScore& score);

}  // namespace embody
