#pragma once
// Ten seconds of a made-up person's free finger motion in a made-up glove, with the truth: what the calibration has to
// find out.
#include <map>
#include <string>
#include <vector>

#include "core/hand/calibration.hpp"
#include "tests/unit/math/random_values.hpp"

namespace embody::test {

struct FreeMotionConfig {
  double noise_m{0.001};       ///< of every finger marker, per axis, standard deviation
  double back_noise_m{0.001};  ///< of the markers on the back of the hand
  double dropped{0.03};        ///< share of the time that a finger marker is not seen, in gaps of 1 to 40 frames
  double swapped{0.01};        ///< share of the frames with two finger labels exchanged, in runs of 1 to 30 frames
  double vigour{1.0};          ///< of the motion; 0: the fingers stand still
  std::size_t frames{1000};    ///< at 100 Hz
};

struct FreeMotion {
  hand::Shape shape{hand::Shape::Zero()};
  Pose X_HM{Pose::Identity()};
  hand::HandPoints points;  ///< [finger][point]: true place of each marker, kBone
  std::vector<std::array<hand::Vector9, kFingers>> q_rad;
  std::vector<MarkerFrame> frames;
};

/// Person, glove and motion drawn from the calibration's own prior about the nominal values. The hand wanders in W; its
/// triad is rigid but for the noise.
[[nodiscard]] FreeMotion free_motion(const hand::HandData& data, const hand::GloveLayout& glove,
                                     const hand::HandPoints& nominal, const Pose& X_HM,
                                     const hand::CalibrationPrior& prior, const FreeMotionConfig& config,
                                     std::uint64_t seed);

/// How far calibrations are from the truth, collected over trials.
struct CalibrationErrors {
  std::vector<double> length;      ///< of the flat finger from knuckle to tip marker, relative; by trial and finger
  std::vector<double> distance_m;  ///< from each marker to its joint; by trial and marker
  std::size_t known{0};            ///< numbers (shape, X_HM, places) that the motion says something about,
  std::size_t inside{0};           ///< of those: with the truth within two stated standard deviations
  std::size_t prior_only{0};       ///< numbers that only the prior knows
  struct Group {
    std::size_t known{0}, inside{0}, prior_only{0};
  };
  std::map<std::string, Group> groups;  ///< the same by kind of number

  void add(const hand::HandData& data, const FreeMotion& truth, const hand::Calibration& found,
           const hand::CalibrationPrior& prior);
};

}  // namespace embody::test
