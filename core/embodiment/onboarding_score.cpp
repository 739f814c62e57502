// How well a proposed robot hand can follow: estimated by sampling, with fixed seeds.
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "core/embodiment/onboarding.hpp"
#include "core/hand/finger_estimator.hpp"

namespace embody {
namespace {

using Eigen::Vector3d;

constexpr std::uint64_t kRobotSeed = 1, kHumanSeed = 2;
constexpr std::size_t kPinchStarts = 4;
constexpr double kPinchGain_m = 1e-4;   // steps that gain less are not worth their time
constexpr double kPinchTouch_m = 5e-4;  // near enough

/// Uniform in [low, high): the engine is fixed by the standard, std::uniform_real_distribution is not.
double uniform(std::mt19937_64& engine, double low, double high) {
  return low + (high - low) * (static_cast<double>(engine() >> 11) * 0x1p-53);
}

using Motors = std::vector<double>;

/// Finger tips as functions of the motors.
class Tips {
 public:
  Tips(const robot::RobotModel& model, const robot::HandAnatomy& anatomy, const EmbodimentConfig& config)
      : model_(model), anatomy_(anatomy), config_(config), q_(robot::open_posture(model)) {
    for (const std::string& motor : config.motors) joints_.push_back(*model.find_joint(motor));
    for (std::size_t f = 0; f < kFingers; ++f) {
      points_[f] = anatomy.fingers[f] ? config.fingers[f].tip_m : Vector3d::Zero();
    }
  }
  void move(const Motors& r) {
    for (std::size_t i = 0; i < joints_.size(); ++i) q_[joints_[i]] = r[i];
    robot::follow_mimics(model_, q_);
    X_PL_ = robot::link_poses(model_, q_);
  }
  /// The point that follows the human finger, in P.
  [[nodiscard]] Vector3d point(std::size_t f) const { return X_PL_[anatomy_.fingers[f]->tip_link] * points_[f]; }
  /// The centre of the tip, in P.
  [[nodiscard]] Vector3d centre(std::size_t f) const {
    return X_PL_[anatomy_.fingers[f]->tip_link] * anatomy_.fingers[f]->p_tip_L;
  }
  [[nodiscard]] double thumb_distance(std::size_t f, const Motors& r) {
    move(r);
    return (centre(f) - centre(0)).norm();
  }
  [[nodiscard]] Motors random(std::mt19937_64& engine) const {
    Motors r;
    for (std::size_t i = 0; i < joints_.size(); ++i) {
      r.push_back(uniform(engine, config_.motor_lower_rad[i], config_.motor_upper_rad[i]));
    }
    return r;
  }
  /// Does the motor move the finger or the thumb?
  [[nodiscard]] bool moves(std::size_t motor, std::size_t f) const {
    const auto follows = [&](std::size_t j) {
      const auto& mimic = model_.joints[j].mimic;
      return (mimic ? mimic->joint : j) == joints_[motor];
    };
    return std::any_of(anatomy_.fingers[f]->joints.begin(), anatomy_.fingers[f]->joints.end(), follows) ||
           std::any_of(anatomy_.fingers[0]->joints.begin(), anatomy_.fingers[0]->joints.end(), follows);
  }
  [[nodiscard]] double clamped(std::size_t motor, double value) const {
    return std::clamp(value, config_.motor_lower_rad[motor], config_.motor_upper_rad[motor]);
  }
  [[nodiscard]] double width(std::size_t motor) const {
    return config_.motor_upper_rad[motor] - config_.motor_lower_rad[motor];
  }

 private:
  const robot::RobotModel& model_;
  const robot::HandAnatomy& anatomy_;
  const EmbodimentConfig& config_;
  robot::JointValues q_;
  std::vector<std::size_t> joints_;
  std::vector<Pose> X_PL_;
  std::array<Vector3d, kFingers> points_;
};

struct Samples {
  std::array<Eigen::Matrix3Xd, kFingers> tips_P;
  std::array<std::vector<std::pair<double, Motors>>, kFingers> pinches;  ///< best first
};

void keep_best(std::vector<std::pair<double, Motors>>& best, double distance, const Motors& r) {
  if (best.size() == kPinchStarts && distance >= best.back().first) return;
  best.emplace_back(distance, r);
  std::sort(best.begin(), best.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  if (best.size() > kPinchStarts) best.pop_back();
}

Samples sample_robot(Tips& tips, const robot::HandAnatomy& anatomy, int count) {
  Samples samples;
  for (auto& points : samples.tips_P) points.resize(3, count);
  std::mt19937_64 engine(kRobotSeed);
  for (int i = 0; i < count; ++i) {
    const Motors r = tips.random(engine);
    tips.move(r);
    for (std::size_t f = 0; f < kFingers; ++f) {
      if (!anatomy.fingers[f]) continue;
      samples.tips_P[f].col(i) = tips.point(f);
      if (f > 0) keep_best(samples.pinches[f], (tips.centre(f) - tips.centre(0)).norm(), r);
    }
  }
  return samples;
}

/// Pattern search from the best samples: one motor at a time, steps from an eighth of its range down to a thousandth.
double least_pinch(Tips& tips, std::size_t finger, const std::vector<std::pair<double, Motors>>& starts) {
  double least = std::numeric_limits<double>::infinity();
  for (auto [distance, r] : starts) {
    for (double step = 0.125; step > 1e-3 && least > kPinchTouch_m && distance > kPinchTouch_m;) {
      bool better = false;
      for (std::size_t motor = 0; motor < r.size(); ++motor) {
        if (!tips.moves(motor, finger)) continue;
        for (const double sign : {-1.0, 1.0}) {
          Motors trial = r;
          trial[motor] = tips.clamped(motor, r[motor] + sign * step * tips.width(motor));
          const double there = tips.thumb_distance(finger, trial);
          if (there >= distance - kPinchGain_m) continue;
          distance = there;
          r = trial;
          better = true;
        }
      }
      if (!better) step *= 0.5;
    }
    least = std::min(least, distance);
  }
  return least;
}

double reach(const hand::HandModel& human, Finger finger, const Pose& X_PM, const Eigen::Matrix3Xd& robot_P,
             int count) {
  const auto f = static_cast<std::size_t>(finger);
  const hand::FingerEstimatorConfig anatomy;
  std::mt19937_64 engine(kHumanSeed + 10 * f);
  int reached = 0;
  for (int i = 0; i < count; ++i) {
    hand::Vector9 q_rad;
    for (Eigen::Index k = 0; k < 9; ++k) q_rad(k) = uniform(engine, anatomy.lower_rad[f](k), anatomy.upper_rad[f](k));
    if (human.side() == Side::kLeft) hand::mirror_angles(q_rad);
    const Vector3d tip_P = X_PM * human.finger_points(finger, q_rad)[0];
    const double nearest2 = (robot_P.colwise() - tip_P).colwise().squaredNorm().minCoeff();
    if (nearest2 <= kReachTolerance_m * kReachTolerance_m) ++reached;
  }
  return static_cast<double>(reached) / static_cast<double>(count);
}

double human_length(const hand::HandModel& human, std::size_t f) {
  const std::size_t knuckle = hand::first_joint(static_cast<Finger>(f)) + (f == 0 ? 1 : 0);
  return (human.rest_tips()[f] - human.rest_joints()[knuckle]).norm();
}

}  // namespace

OnboardingScore score_hand(const robot::RobotModel& model, const robot::HandAnatomy& anatomy,
                           const EmbodimentConfig& config, const OnboardingOptions& options) {
  const hand::HandData data = hand::builtin_hand(hand::Skeleton::kBoneLengths, anatomy.side);
  const hand::HandModel human(data, hand::Shape::Zero(), hand::default_points(data));
  const Pose X_PM = math::exp_se3(config.X_PM);
  Tips tips(model, anatomy, config);
  const Samples samples = sample_robot(tips, anatomy, std::max(1, options.robot_samples));
  OnboardingScore score;
  double robot_m = 0.0, human_m = 0.0;
  for (std::size_t f = 0; f < kFingers; ++f) {
    if (!anatomy.fingers[f]) continue;
    FingerScore& finger = score.fingers[f].emplace();
    finger.length_m = (anatomy.fingers[f]->p_tip_P - anatomy.fingers[f]->p_knuckle_P).norm();
    finger.human_length_m = human_length(human, f);
    finger.reach = reach(human, static_cast<Finger>(f), X_PM, samples.tips_P[f], std::max(1, options.human_samples));
    if (f == 0) continue;
    finger.pinch_m = least_pinch(tips, f, samples.pinches[f]);
    robot_m += finger.length_m;
    human_m += finger.human_length_m;
  }
  score.scale = human_m > 0.0 ? robot_m / human_m : 1.0;
  return score;
}

}  // namespace embody
