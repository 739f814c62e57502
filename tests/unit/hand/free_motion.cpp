#include "tests/unit/hand/free_motion.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "core/hand/calibration_prior.hpp"

namespace embody::test {
namespace {

using Eigen::Index;
using Eigen::Vector3d;
using namespace hand;

constexpr double kTwoPi = 6.28318530717958647693;

double normal(RandomValues& random) {
  return std::sqrt(-2.0 * std::log(1.0 - random(0.0, 1.0))) * std::cos(kTwoPi * random(0.0, 1.0));
}

Vector3d normal3(RandomValues& random) {
  return {normal(random), normal(random), normal(random)};
}

/// A smooth function of time with mean 0 and standard deviation 1: four sines of 0.15 to 1.2 Hz.
class Wave {
 public:
  explicit Wave(RandomValues& random) {
    for (Sine& sine : sines_) sine = {random(0.15, 1.2), random(0.0, kTwoPi)};
  }
  double operator()(double t_s) const {
    double sum = 0.0;
    for (const Sine& sine : sines_) sum += std::sin(kTwoPi * sine.hertz * t_s + sine.phase);
    return sum / std::sqrt(0.5 * static_cast<double>(sines_.size()));
  }

 private:
  struct Sine {
    double hertz, phase;
  };
  std::array<Sine, 4> sines_{};
};

/// Angles of one finger over time, belief by belief. The end joint follows the middle joint.
class FingerMotion {
 public:
  FingerMotion(const AnglePrior& prior, double vigour, RandomValues& random) : beliefs_(prior.beliefs()) {
    for (std::size_t i = 0; i < beliefs_.size(); ++i) {
      const AngleBelief& b = beliefs_[i];
      habit_.push_back(b.mean_rad + b.habit_sd_rad * normal(random));
      spread_.push_back(vigour * std::min(b.spread_rad, b.upper_rad > 1.0 ? 0.5 : 0.2));
      waves_.emplace_back(random);
    }
  }
  Vector9 operator()(double t_s) const {
    const auto angle = [&](std::size_t i) {
      return std::clamp(habit_[i] + spread_[i] * waves_[i](t_s), beliefs_[i].lower_rad, beliefs_[i].upper_rad);
    };
    Vector9 q = Vector9::Zero();
    for (std::size_t i = 0; i < 9; ++i) {
      if (i == 6 && beliefs_.size() > 9) continue;
      q += angle(i) * beliefs_[i].direction;
    }
    if (beliefs_.size() > 9) {  // the coupling's value is what it says beyond its share of the middle joint
      const double end = angle(9) - beliefs_[9].direction.dot(q);
      const Vector9& along = beliefs_[6].direction;
      q += std::clamp(end / beliefs_[9].direction.dot(along), beliefs_[6].lower_rad, beliefs_[6].upper_rad) * along;
    }
    return q;
  }

 private:
  const StaticVector<AngleBelief, kAngleBeliefs>& beliefs_;
  std::vector<double> habit_, spread_;
  std::vector<Wave> waves_;
};

void drop(FreeMotion& motion, const GloveLayout& glove, double share, RandomValues& random) {
  constexpr double kMeanGap = 20.5;
  for (const FingerMarker& marker : glove.finger_markers) {
    for (std::size_t k = 0; k < motion.frames.size(); ++k) {
      if (random(0.0, 1.0) > share / kMeanGap) continue;
      const auto end = std::min(motion.frames.size(), k + 1 + static_cast<std::size_t>(random(0.0, 40.0)));
      for (; k < end; ++k) motion.frames[k].markers[marker.slot].visible = false;
    }
  }
}

void swap_labels(FreeMotion& motion, const GloveLayout& glove, double share, RandomValues& random) {
  constexpr double kMeanRun = 15.5;
  const auto any_slot = [&] {
    const auto count = static_cast<double>(glove.finger_markers.size());
    return glove.finger_markers[static_cast<std::size_t>(random(0.0, count))].slot;
  };
  for (std::size_t k = 0; k < motion.frames.size(); ++k) {
    if (random(0.0, 1.0) > share / kMeanRun) continue;
    const std::size_t a = any_slot(), b = any_slot();
    const auto end = std::min(motion.frames.size(), k + 1 + static_cast<std::size_t>(random(0.0, 30.0)));
    for (; k < end; ++k) std::swap(motion.frames[k].markers[a], motion.frames[k].markers[b]);
  }
}

}  // namespace

FreeMotion free_motion(const HandData& data, const GloveLayout& glove, const HandPoints& nominal, const Pose& X_HM,
                       const CalibrationPrior& prior, const FreeMotionConfig& config, std::uint64_t seed) {
  RandomValues random(seed);
  FreeMotion motion;
  for (Index i = 0; i < motion.shape.size(); ++i) motion.shape(i) = prior.shape_sd(i) * normal(random);
  motion.points = nominal;
  for (auto& finger : motion.points) {
    for (HandPoint& point : finger) {
      point.stretches = false;
      point.offset_m += prior.marker_sd_m * normal3(random);
    }
  }
  motion.X_HM = X_HM * math::pose_from(prior.X_HM_translation_sd_m * normal3(random),
                                       prior.X_HM_rotation_sd_rad * normal3(random));
  const HandModel model(data, motion.shape, motion.points);
  const std::array<Vector3d, 3> triad_H{Vector3d(0, 0, .0447), Vector3d(.0322, 0, .0037), Vector3d(0, 0, 0)};

  std::vector<AnglePrior> priors;
  for (std::size_t f = 0; f < kFingers; ++f) priors.emplace_back(static_cast<Finger>(f), data.side);
  std::vector<FingerMotion> fingers;
  for (const AnglePrior& of_finger : priors) fingers.emplace_back(of_finger, config.vigour, random);
  std::vector<Wave> wander;
  for (int i = 0; i < 6; ++i) wander.emplace_back(random);
  for (std::size_t k = 0; k < config.frames; ++k) {
    const double t_s = 0.01 * static_cast<double>(k + 1);
    MarkerFrame frame;
    frame.frame_number = k + 1;
    frame.t_capture = TimePoint{std::chrono::milliseconds(10 * (k + 1))};
    frame.count = glove.names.size();
    const Pose X_WH = math::pose_from(0.1 * Vector3d(wander[0](t_s), wander[1](t_s), wander[2](t_s)),
                                      0.3 * Vector3d(wander[3](t_s), wander[4](t_s), wander[5](t_s)));
    const Pose X_WM = X_WH * motion.X_HM;
    for (std::size_t i = 0; i < 3; ++i) {
      frame.markers[glove.back_slots[i]] = {X_WH * triad_H[i] + config.back_noise_m * normal3(random), true};
    }
    std::array<Vector9, kFingers>& q = motion.q_rad.emplace_back();
    for (std::size_t f = 0; f < kFingers; ++f) q[f] = fingers[f](t_s);
    for (const FingerMarker& marker : glove.finger_markers) {
      const FingerChain chain = model.chain(marker.finger, q[static_cast<std::size_t>(marker.finger)]);
      const Vector3d p_M = model.point(marker.finger, marker.point, chain);
      frame.markers[marker.slot] = {X_WM * p_M + config.noise_m * normal3(random), true};
    }
    motion.frames.push_back(frame);
  }
  drop(motion, glove, config.dropped, random);
  swap_labels(motion, glove, config.swapped, random);
  return motion;
}

void CalibrationErrors::add(const HandData& data, const FreeMotion& truth, const Calibration& found,
                            const CalibrationPrior& prior) {
  const auto count = [this](const char* name, double error, double sd, bool only_prior) {
    Group& group = groups[name];
    const bool hit = std::abs(error) <= 2.0 * sd;
    for (auto& [all, in, unknown] :
         {std::tie(known, inside, prior_only), std::tie(group.known, group.inside, group.prior_only)}) {
      all += only_prior ? 0 : 1;
      in += !only_prior && hit ? 1 : 0;
      unknown += only_prior ? 1 : 0;
    }
  };
  constexpr std::array<const char*, 10> kShapeNames{"scale",  "breadth", "palm length", "thumb", "index",
                                                    "middle", "ring",    "little",      "girth", "distal"};
  for (Index i = 0; i < truth.shape.size(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    count(kShapeNames[k], found.shape(i) - truth.shape(i), found.shape_sd(i), found.shape_prior_only[k]);
  }
  const Pose off = truth.X_HM.inverse() * found.X_HM;
  const Vector3d turned = math::log_so3(off.linear());
  for (Index i = 0; i < 3; ++i) {
    count("X_HM turn", turned(i), found.X_HM_sd(i), false);
    count("X_HM place", off.translation()(i), found.X_HM_sd(3 + i), false);
  }
  const HandModel true_hand(data, truth.shape, truth.points), found_hand(data, found.shape, truth.points);
  for (const CalibratedMarker& marker : found.markers) {
    const auto f = static_cast<std::size_t>(marker.finger);
    const std::size_t point = (marker.slot - 3) % 2;
    const Vector3d& place = truth.points[f][point].offset_m;
    for (Index i = 0; i < 3; ++i) {
      count(point == 0 ? "tip marker" : "mid marker", marker.offset_m(i) - place(i), marker.sd_m(i),
            marker.sd_m(i) > 0.9 * prior.marker_sd_m);
    }
    distance_m.push_back(std::abs(marker.offset_m.norm() - place.norm()));
    if (point != 0) continue;
    const auto from_knuckle = [&marker](const HandModel& hand, const Vector3d& offset_m) {
      return (hand.rest_joints()[marker.joint] + offset_m - hand.rest_joints()[first_joint(marker.finger)]).norm();
    };
    length.push_back(std::abs(from_knuckle(found_hand, marker.offset_m) / from_knuckle(true_hand, place) - 1.0));
  }
}

}  // namespace embody::test
