// Touching and not colliding finger tips: options pinch_m and collision_margin_m on the shipped hands.
#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <limits>
#include <optional>

#include "core/embodiment/embodiment_mapping.hpp"
#include "tests/unit/math/random_values.hpp"
#include "tests/unit/robot/hand_files.hpp"

namespace embody {
namespace {

using Eigen::Vector3d;
using Points = std::array<std::array<Vector3d, 2>, kFingers>;
using Motors = std::vector<double>;

/// Half the thickness of human finger tips, m: thumb and another.
constexpr double kThumbRadius = 0.0095, kFingerRadius = 0.0075;

test::RandomValues seeded(std::uint64_t seed) {
  std::cout << "seed " << seed << "\n";
  return test::RandomValues(seed);
}

EmbodimentMapping make(const std::string& name, double pinch_m, double collision_margin_m) {
  EmbodimentConfig config = test::hand_config(name);
  config.pinch_m = pinch_m;
  config.collision_margin_m = collision_margin_m;
  auto mapping = EmbodimentMapping::create(test::hand_model(name), config);
  if (!mapping) throw std::runtime_error(name + ": " + mapping.error().detail.c_str());
  return std::move(*mapping);
}

bool has(const EmbodimentMapping& mapping, std::size_t finger) {
  return !mapping.config().fingers[finger].link.empty();
}

Finger finger_of(std::size_t f) {
  return static_cast<Finger>(f);
}

Motors blend(const Motors& a, const Motors& b, double share) {
  Motors r = a;
  for (std::size_t m = 0; m < r.size(); ++m) r[m] += share * (b[m] - a[m]);
  return r;
}

/// Which motors move which fingers.
class Anatomy {
 public:
  explicit Anatomy(const EmbodimentMapping& mapping) : motors_(mapping.motor_count()) {
    Motors low, high;
    for (std::size_t m = 0; m < motors_; ++m) low.push_back(mapping.lower_rad(m));
    const Points before_P = mapping.finger_points(low);
    for (std::size_t m = 0; m < motors_; ++m) {
      high = low;
      high[m] = mapping.upper_rad(m);
      const Points after_P = mapping.finger_points(high);
      for (std::size_t f = 0; f < kFingers; ++f) moves_[m][f] = has(mapping, f) && after_P[f] != before_P[f];
    }
    for (std::size_t f = 0; f < kFingers; ++f) {
      for (std::size_t g = 0; g < kFingers; ++g) {
        pairs_[f][g] = f < g && has(mapping, f) && has(mapping, g) && movable(f, g);
      }
    }
  }
  [[nodiscard]] bool moves(std::size_t motor, std::size_t finger) const { return moves_[motor][finger]; }
  /// Whether these are two fingers in order and the gap between them can change.
  [[nodiscard]] bool is_pair(std::size_t a, std::size_t b) const { return pairs_[a][b]; }

 private:
  /// The Mia's middle, ring and little finger share their motor; a gripper's one motor moves both fingers.
  [[nodiscard]] bool movable(std::size_t a, std::size_t b) const {
    for (std::size_t m = 0; m < motors_; ++m) {
      if (moves_[m][a] != moves_[m][b]) return true;
    }
    return motors_ == 1;
  }

  std::size_t motors_;
  std::array<std::array<bool, kFingers>, kMaxHandJoints> moves_{};
  std::array<std::array<bool, kFingers>, kFingers> pairs_{};
};

/// From apart to a touch of two tips.
struct Approach {
  Motors apart, touching;
};

/// Lowers the gap of two tips motor by motor from a random posture of the two fingers (or of the whole hand; else the
/// others are at rest), until they touch; nothing if they do not get there, and then `nearest_m` tells how near they
/// came.
std::optional<Approach> find_touch(const EmbodimentMapping& mapping, const Anatomy& anatomy, std::size_t a,
                                   std::size_t b, bool whole_hand, test::RandomValues& random, double& nearest_m) {
  const auto gap_m = [&](const Motors& r) { return mapping.pad_gap_m(finger_of(a), finger_of(b), r); };
  Motors r;
  for (std::size_t m = 0; m < mapping.motor_count(); ++m) {
    const double lower = mapping.lower_rad(m), upper = mapping.upper_rad(m);
    const bool free = whole_hand || anatomy.moves(m, a) || anatomy.moves(m, b);
    r.push_back(free ? random(lower, upper) : std::clamp(0.0, lower, upper));
  }
  Approach approach{r, r};
  double gap = gap_m(r);
  if (gap < 0.02) return {};
  for (double step = 0.2; step > 1e-4;) {
    bool lower = false;
    for (std::size_t m = 0; m < r.size(); ++m) {
      for (const double way : {-step, step}) {
        Motors next = r;
        next[m] = std::clamp(r[m] + way, mapping.lower_rad(m), mapping.upper_rad(m));
        const double there = gap_m(next);
        if (!(there < gap)) continue;
        if (there <= 0.0) {  // between r and next
          double low = 0.0, high = 1.0;
          for (int i = 0; i < 60; ++i)
            (gap_m(blend(r, next, 0.5 * (low + high))) > 0.0 ? low : high) = 0.5 * (low + high);
          approach.touching = blend(r, next, low);
          nearest_m = 0.0;
          return approach;
        }
        r = next;
        gap = there;
        lower = true;
      }
    }
    nearest_m = std::min(nearest_m, gap);
    if (!lower) step *= 0.5;
  }
  return {};
}

/// Up to `count` approaches of a pair; prints how near it comes when there are none.
std::vector<Approach> find_touches(const EmbodimentMapping& mapping, const std::string& name, std::size_t a,
                                   std::size_t b, std::size_t count, bool whole_hand, test::RandomValues& random) {
  const Anatomy anatomy(mapping);
  std::vector<Approach> found;
  double nearest_m = std::numeric_limits<double>::infinity();
  for (int start = 0; start < 100 && found.size() < count; ++start) {
    if (auto approach = find_touch(mapping, anatomy, a, b, whole_hand, random, nearest_m))
      found.push_back(std::move(*approach));
  }
  if (found.empty()) {
    std::cout << name << " " << kFingerNames[a] << "-" << kFingerNames[b] << ": cannot touch, nearest "
              << 1e3 * nearest_m << " mm\n";
  }
  return found;
}

/// A person's hand: points `p_P` as seen from the robot, and the gap between thumb and one finger.
HandState human(const EmbodimentMapping& mapping, const Points& p_P, std::size_t finger, double gap_m) {
  HandState state;
  state.valid = true;
  state.quality.fill(FingerQuality::kOptimal);
  state.confidence.fill(1.0);
  const Vector3d along(0.0, 0.02, 0.0);
  for (std::size_t f = 0; f < kFingers; ++f) {
    if (has(mapping, f)) {
      for (std::size_t i = 0; i < 2; ++i) state.p_M[f][i] = mapping.X_PM().inverse() * p_P[f][i];
    }
    Vector3d base_M(0.0, 0.0, 0.2 * static_cast<double>(f));  // far from each other
    if (f == finger) base_M = Vector3d(kThumbRadius + kFingerRadius + gap_m, 0.0, 0.0);
    state.distal_M[f] = {base_M, base_M + along};
  }
  return state;
}

/// Constant displacement of every point, up to 10 mm.
Points offsets(test::RandomValues& random) {
  Points out;
  for (auto& finger : out) {
    for (Vector3d& p : finger) p = random(0.0, 0.01) * random.rotation(1.0).normalized();
  }
  return out;
}

struct Sweep {
  double touch_m{0.0};         // gap while the human tips touch
  double largest_step_m{0.0};  // of the gap between frames
};

/// Closes from apart to a touch within `closing` frames, holds it, and opens again; the human's gap is that of the
/// robot's own posture.
Sweep sweep(EmbodimentMapping mapping, const Approach& approach, std::size_t finger, const Points& offset,
            int closing) {
  const int holding = 50;
  Sweep result;
  FingerTarget target;
  std::optional<double> last_m;
  for (int n = 0; n <= 2 * closing + holding; ++n) {
    const double share = std::clamp(std::min(n, 2 * closing + holding - n) / static_cast<double>(closing), 0.0, 1.0);
    const Motors r = blend(approach.apart, approach.touching, share);
    Points p_P = mapping.finger_points(r);
    for (std::size_t f = 0; f < kFingers; ++f) {
      for (std::size_t i = 0; i < 2; ++i) p_P[f][i] += offset[f][i];
    }
    const double human_gap_m = std::max(0.0, mapping.pad_gap_m(Finger::kThumb, finger_of(finger), r));
    HandState state = human(mapping, p_P, finger, human_gap_m);
    state.t_capture = TimePoint(std::chrono::milliseconds(10 * n));
    mapping.step(state, target);
    EXPECT_TRUE(target.valid);
    const double gap_m = mapping.pad_gap_m(Finger::kThumb, finger_of(finger), target.q_rad);
    if (last_m) result.largest_step_m = std::max(result.largest_step_m, std::abs(gap_m - *last_m));
    last_m = gap_m;
    if (n == closing + holding) result.touch_m = gap_m;
  }
  return result;
}

struct Extent {
  double low{std::numeric_limits<double>::infinity()}, high{-std::numeric_limits<double>::infinity()};
  void add(double x) {
    low = std::min(low, x);
    high = std::max(high, x);
  }
};

std::ostream& operator<<(std::ostream& out, const Extent& extent) {
  return out << 1e3 * extent.low << " .. " << 1e3 * extent.high << " mm";
}

TEST(Pinch, TouchesWhenThePersonDoesForEveryPairThatCanTouch) {
  test::RandomValues random = seeded(61);
  int jumps = 0, sweeps = 0;
  for (const std::string name : test::kHandFiles) {
    const EmbodimentMapping plain = make(name, 0.0, 0.0), pinching = make(name, 0.02, 0.0);
    for (std::size_t f = 1; f < kFingers; ++f) {
      if (!has(plain, f)) continue;
      Extent with, without;
      double step_m = 0.0, slow_step_m = 0.0;
      int missed = 0;
      const std::vector<Approach> approaches = find_touches(plain, name, 0, f, 12, false, random);
      for (const Approach& approach : approaches) {
        const Points offset = offsets(random);
        const Sweep one = sweep(pinching, approach, f, offset, 200), other = sweep(plain, approach, f, offset, 200);
        const Sweep slower = sweep(pinching, approach, f, offset, 1000);
        with.add(one.touch_m);
        without.add(other.touch_m);
        step_m = std::max(step_m, one.largest_step_m);
        slow_step_m = std::max(slow_step_m, slower.largest_step_m);
        missed += std::abs(one.touch_m) <= 1e-3 ? 0 : 1;
        const double plain_step_m = sweep(plain, approach, f, offset, 1000).largest_step_m;  // the paper's own jumps
        jumps += slower.largest_step_m <= std::max(plain_step_m, 0.4 * one.largest_step_m) + 1e-4 ? 0 : 1;
        ++sweeps;
      }
      if (approaches.empty()) continue;
      std::cout << name << " thumb-" << kFingerNames[f] << ": gap at the touch " << with << ", without the option "
                << without << "; largest step of the gap in 200 frames " << 1e3 * step_m << " mm, in 1000 "
                << 1e3 * slow_step_m << " mm; " << missed << " missed of " << approaches.size() << "\n";
      EXPECT_EQ(missed, 0) << name << " " << kFingerNames[f];
      EXPECT_GE(with.low, -1e-4) << name << " " << kFingerNames[f];
      EXPECT_LE(step_m, 4e-3) << name << " " << kFingerNames[f];
    }
  }
  std::cout << jumps << " of " << sweeps << " sweeps with a step of the gap that a slower hand does not make smaller\n";
  EXPECT_LE(jumps, 0.05 * sweeps) << "steps from one minimum to another are to stay rare";
}

/// Least gap between any two tips but those of one pair (all pairs: a == b) that can move apart, m.
double least_gap_m(const EmbodimentMapping& mapping, const Anatomy& anatomy, std::span<const double> r, std::size_t a,
                   std::size_t b) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t f = 0; f < kFingers; ++f) {
    for (std::size_t g = f + 1; g < kFingers; ++g) {
      if ((f == a && g == b) || !anatomy.is_pair(f, g)) continue;
      least = std::min(least, mapping.pad_gap_m(finger_of(f), finger_of(g), r));
    }
  }
  return least;
}

TEST(CollisionMargin, KeepsTheTipsOfFingersApartThatTheGoalsBringTogether) {
  constexpr double kMargin = 0.003, kKept = 0.0025;
  test::RandomValues random = seeded(62);
  for (const std::string name : test::kHandFiles) {
    const EmbodimentMapping plain = make(name, 0.0, 0.0), careful = make(name, 0.0, kMargin);
    const Anatomy anatomy(plain);
    for (std::size_t a = 0; a < kFingers; ++a) {
      for (std::size_t b = a + 1; b < kFingers; ++b) {
        if (!anatomy.is_pair(a, b)) continue;
        Extent with, without;
        int near = 0, frames = 0;
        for (const Approach& approach : find_touches(plain, name, a, b, 8, false, random)) {
          EmbodimentMapping mapping = careful;
          FingerTarget target;
          for (int n = 0; n <= 200; ++n) {
            const Motors r = blend(approach.apart, approach.touching, n / 200.0);
            if (least_gap_m(plain, anatomy, r, a, b) < 0.005) break;  // one pair after the other
            mapping.step(human(mapping, mapping.finger_points(r), kFingers, 1.0), target);
            const double gap_m = least_gap_m(mapping, anatomy, target.q_rad, 0, 0);
            with.add(gap_m);
            without.add(mapping.pad_gap_m(finger_of(a), finger_of(b), r));
            near += gap_m < kKept ? 1 : 0;
            ++frames;
          }
        }
        if (frames == 0) continue;
        std::cout << name << " " << kFingerNames[a] << "-" << kFingerNames[b] << ": least gap " << 1e3 * with.low
                  << " mm, of the goals " << 1e3 * without.low << " mm; " << near << " of " << frames
                  << " frames too near\n";
        EXPECT_EQ(near, 0) << name << " " << kFingerNames[a] << "-" << kFingerNames[b];
      }
    }
  }
}

TEST(CollisionMargin, KeepsTheTipsApartInAWholeHandThatClosesAtRandom) {
  constexpr double kMargin = 0.003, kKept = 0.0025, kDeepest = -0.003;
  test::RandomValues random = seeded(63);
  for (const std::string name : test::kHandFiles) {
    const EmbodimentMapping plain = make(name, 0.0, 0.0), careful = make(name, 0.0, kMargin);
    const Anatomy anatomy(plain);
    Extent with, without;
    int near = 0, brought = 0, frames = 0;
    for (int run = 0; run < 100; ++run) {
      Motors from, to;
      for (std::size_t m = 0; m < plain.motor_count(); ++m) {
        from.push_back(random(plain.lower_rad(m), plain.upper_rad(m)));
        to.push_back(random(plain.lower_rad(m), plain.upper_rad(m)));
      }
      if (least_gap_m(plain, anatomy, from, 0, 0) < 0.005) continue;
      EmbodimentMapping mapping = careful;
      FingerTarget target;
      for (int n = 0; n <= 200; ++n, ++frames) {
        const Motors r = blend(from, to, n / 200.0);
        const double goal_m = least_gap_m(plain, anatomy, r, 0, 0);
        if (goal_m < kDeepest) break;  // a hand through itself
        mapping.step(human(mapping, mapping.finger_points(r), kFingers, 1.0), target);
        const double gap_m = least_gap_m(mapping, anatomy, target.q_rad, 0, 0);
        with.add(gap_m);
        without.add(goal_m);
        near += gap_m < kKept ? 1 : 0;
        brought += goal_m < kKept ? 1 : 0;
      }
    }
    std::cout << name << ": least gap " << 1e3 * with.low << " mm, of the goals " << 1e3 * without.low << " mm; "
              << near << " frames too near of " << brought << " whose goals were, of " << frames << "\n";
    EXPECT_LE(near, 0.005 * brought) << name;  // three fingers may squeeze each other
  }
}

}  // namespace
}  // namespace embody
