// The Mia's thumb with thumb_mode "automatic": which branch of its motor is taken, and that noise does not make it
// chatter.
#include <gtest/gtest.h>

#include <cmath>
#include <iostream>

#include "core/embodiment/embodiment_mapping.hpp"
#include "tests/unit/math/random_values.hpp"
#include "tests/unit/robot/hand_files.hpp"

namespace embody {
namespace {

using Eigen::Vector3d;
using Points = std::array<std::array<Vector3d, 2>, kFingers>;
using Motors = std::array<double, 3>;  // thumb flexion, crank of index and thumb, the other fingers

constexpr std::size_t kCrank = 1;
constexpr Duration kFrame = std::chrono::milliseconds(10);
constexpr Duration kDwell = std::chrono::milliseconds(1000);

test::RandomValues seeded(std::uint64_t seed) {
  std::cout << "seed " << seed << "\n";
  return test::RandomValues(seed);
}

EmbodimentConfig automatic() {
  EmbodimentConfig config = test::hand_config("mia");
  config.thumb_mode = ThumbMode::kAutomatic;
  config.thumb_opposed_from_rad = 0.0731;  // as shipped
  return config;
}

EmbodimentMapping make(const EmbodimentConfig& config) {
  auto mapping = EmbodimentMapping::create(test::hand_model("mia"), config);
  if (!mapping) throw std::runtime_error(mapping.error().detail.c_str());
  return std::move(*mapping);
}

/// A mapping with a clock that runs on by a frame at each step.
class Session {
 public:
  explicit Session(const EmbodimentConfig& config) : mapping_(make(config)) {}

  [[nodiscard]] const EmbodimentMapping& mapping() const { return mapping_; }
  [[nodiscard]] Points points(const Motors& r) const { return mapping_.finger_points(r); }
  [[nodiscard]] TimePoint now() const { return t_; }

  Motors step(const Points& p_P) {
    HandState state;
    state.valid = true;
    state.quality.fill(FingerQuality::kOptimal);
    state.confidence.fill(1.0);
    t_ += kFrame;
    state.t_capture = t_;
    for (std::size_t f = 0; f < kFingers; ++f) {
      for (std::size_t i = 0; i < 2; ++i) state.p_M[f][i] = mapping_.X_PM().inverse() * p_P[f][i];
      state.distal_M[f] = {state.p_M[f][1], state.p_M[f][0]};
    }
    FingerTarget target;
    mapping_.step(state, target);
    EXPECT_TRUE(target.valid);
    return {target.q_rad[0], target.q_rad[1], target.q_rad[2]};
  }

  Motors hold(const Points& p_P, Duration duration) {
    Motors r = step(p_P);
    for (const TimePoint end = t_ + duration; t_ < end;) r = step(p_P);
    return r;
  }

 private:
  EmbodimentMapping mapping_;
  TimePoint t_{std::chrono::seconds(100)};
};

Points blend(const Points& a, const Points& b, double share) {
  Points out;
  for (std::size_t f = 0; f < kFingers; ++f) {
    for (std::size_t i = 0; i < 2; ++i) out[f][i] = (1.0 - share) * a[f][i] + share * b[f][i];
  }
  return out;
}

Points with_noise(const Points& p_P, double sigma_m, test::RandomValues& random) {
  Points out = p_P;
  for (auto& finger : out) {
    for (Vector3d& p : finger) {  // the sum of twelve uniform numbers is nearly normal
      for (double& x : p) {
        double sum = -6.0;
        for (int i = 0; i < 12; ++i) sum += random(0.0, 1.0);
        x += sigma_m * sum;
      }
    }
  }
  return out;
}

/// Random posture with the crank clearly on one side.
Motors random_motors(test::RandomValues& random, bool lateral) {
  const double crank = random(0.3, 1.3);
  return {random(0.1, 1.0), lateral ? -crank : crank, random(0.1, 1.3)};
}

/// Goal between two postures that both branches fit equally well.
Points half_way(const Motors& opposed, const Motors& lateral) {
  const Session any(automatic());
  const Points a = any.points(opposed), b = any.points(lateral);
  EmbodimentConfig only_opposed = automatic(), only_lateral = automatic();
  only_opposed.thumb_mode = ThumbMode::kOpposed;
  only_lateral.thumb_mode = ThumbMode::kLateral;
  double low = 0.0, high = 1.0;
  for (int i = 0; i < 40; ++i) {
    const Points middle = blend(a, b, 0.5 * (low + high));
    Session one(only_opposed), other(only_lateral);
    one.step(middle);
    other.step(middle);
    double lead = 0.0;  // of the opposed branch
    for (const HandGroup& group : one.mapping().groups()) lead -= group.solution.cost_m2;
    for (const HandGroup& group : other.mapping().groups()) lead += group.solution.cost_m2;
    (lead > 0.0 ? low : high) = 0.5 * (low + high);
  }
  return blend(a, b, low);
}

/// Watches the sign of the crank.
struct Changes {
  int count{0};
  Duration shortest{Duration::max()};  // between two of them

  void watch(double crank, TimePoint now) {
    if (crank == 0.0) return;  // 0 belongs to both branches
    const bool lateral = crank < 0.0;
    if (branch_ != 0 && lateral != (branch_ < 0)) {
      ++count;
      shortest = std::min(shortest, now - since_);
      since_ = now;
    }
    if (branch_ == 0) since_ = now;
    branch_ = lateral ? -1 : 1;
  }

 private:
  int branch_{0};
  TimePoint since_{};
};

TEST(ThumbBranch, StartsOnTheBranchOfTheFirstHand) {
  test::RandomValues random = seeded(51);
  for (int n = 0; n < 300; ++n) {
    const Motors r = random_motors(random, n % 2 == 0);
    Session session(automatic());
    const Motors found = session.step(session.points(r));
    for (std::size_t m = 0; m < 3; ++m) ASSERT_NEAR(found[m], r[m], 1e-6) << "hand " << n << ", motor " << m;
  }
}

TEST(ThumbBranch, FollowsAThumbThatGoesBesideTheIndexAndBackInFrontOfThePalm) {
  test::RandomValues random = seeded(52);
  Session session(automatic());
  for (int n = 0; n < 60; ++n) {
    const Motors r = random_motors(random, n % 2 == 0);
    const Points goal = with_noise(session.points(r), 1e-3, random);
    const Motors found = session.hold(goal, 2 * kDwell);
    ASSERT_EQ(found[kCrank] < 0.0, r[kCrank] < 0.0) << "hand " << n << ": " << found[kCrank] << " for " << r[kCrank];
    ASSERT_NEAR(found[kCrank], r[kCrank], 0.1);
  }
}

TEST(ThumbBranch, FollowsASlowHandThroughTheExtendedIndex) {
  Session session(automatic());
  Changes changes;
  double last = 1.0, worst_step = 0.0;
  for (int n = 0; n <= 2000; ++n) {  // 20 s from in front of the palm to beside the index and back
    const double crank = std::cos(2.0 * 3.14159265358979 * n / 2000.0);
    const Motors found = session.step(session.points({0.4, crank, 0.5}));
    changes.watch(found[kCrank], session.now());
    worst_step = std::max(worst_step, std::abs(found[kCrank] - last));
    last = found[kCrank];
    if (std::abs(crank) > 0.3) {
      ASSERT_NEAR(found[kCrank], crank, 1e-6) << "frame " << n;
    }
  }
  std::cout << changes.count << " changes of the branch, largest step of the crank " << worst_step << " rad\n";
  EXPECT_EQ(changes.count, 2);
  EXPECT_LE(worst_step, 0.1);
}

/// Changes of the branch over a minute of a goal under white noise.
Changes changes_under_noise(const EmbodimentConfig& config, const Points& goal, double sigma_m,
                            test::RandomValues& random) {
  Session session(config);
  Changes changes;
  for (int n = 0; n < 6000; ++n) {
    const double crank = session.step(with_noise(goal, sigma_m, random))[kCrank];
    changes.watch(crank, session.now());
  }
  return changes;
}

void print(const char* what, const Changes& changes) {
  std::cout << what << ": " << changes.count << " changes";
  if (changes.count > 0) {
    std::cout << ", the shortest stay "
              << std::chrono::duration_cast<std::chrono::milliseconds>(changes.shortest).count() << " ms";
  }
  std::cout << "\n";
}

TEST(ThumbBranch, ChangesAtMostOnceUnderNoiseOfAMillimetreHalfWayBetweenTheBranches) {
  test::RandomValues random = seeded(53);
  for (int n = 0; n < 5; ++n) {
    Motors opposed = random_motors(random, false), lateral = opposed;
    lateral[kCrank] *= -1.0;
    const Changes changes = changes_under_noise(automatic(), half_way(opposed, lateral), 1e-3, random);
    print("half way, 60 s", changes);
    EXPECT_LE(changes.count, 1);
    EXPECT_GE(changes.shortest, kDwell);
  }
}

TEST(ThumbBranch, StaysForTheDwellAtLeastHoweverFastTheHandChanges) {
  test::RandomValues random = seeded(54);
  for (const bool collisions : {false, true}) {
    EmbodimentConfig config = automatic();
    Motors opposed = random_motors(random, false);
    opposed[2] = opposed[kCrank];  // the index bends as far as the middle finger beside it
    Motors lateral = opposed;
    lateral[kCrank] *= -1.0;
    const double gap_m = make(config).pad_gap_m(Finger::kIndex, Finger::kMiddle, opposed);
    if (collisions) config.collision_margin_m = gap_m + 1e-3;  // so that fingers are solved twice in a frame
    Session session(config);
    Changes changes;
    for (int n = 0; n < 6000; ++n) {
      const Points goal = session.points(n / 30 % 2 == 0 ? opposed : lateral);  // a new side every 0.3 s
      changes.watch(session.step(with_noise(goal, 1e-3, random))[kCrank], session.now());
    }
    print(collisions ? "a new side every 0.3 s, with collisions" : "a new side every 0.3 s", changes);
    EXPECT_GE(changes.count, 10) << "nothing was tested";
    EXPECT_GE(changes.shortest, kDwell) << "with collisions: " << collisions;
  }
}

TEST(ThumbBranch, MovesTheCrankLittleWhereTheBranchesMeet) {
  test::RandomValues random = seeded(55);
  Session session(automatic());
  const Points goal = session.points({0.4, 0.0, 0.4});
  double worst = 0.0;
  for (int n = 0; n < 6000; ++n)
    worst = std::max(worst, std::abs(session.step(with_noise(goal, 1e-3, random))[kCrank]));
  print("at the extended index, 60 s", changes_under_noise(automatic(), goal, 1e-3, random));
  std::cout << "crank within " << worst << " rad\n";
  EXPECT_LE(worst, 0.1);
}

/// Sign changes of steps larger than a degree, over all motors, in 20 s of noise.
int chatter(const Points& goal, const EmbodimentConfig& config, double sigma_m, test::RandomValues& random) {
  constexpr double kDegree = 0.0174532925;
  Session session(config);
  Motors last = session.step(with_noise(goal, sigma_m, random)), direction{};
  int changes = 0;
  for (int n = 0; n < 2000; ++n) {
    const Motors r = session.step(with_noise(goal, sigma_m, random));
    for (std::size_t m = 0; m < 3; ++m) {
      const double step = r[m] - last[m];
      if (std::abs(step) < kDegree) continue;
      changes += step * direction[m] < 0.0 ? 1 : 0;
      direction[m] = step;
    }
    last = r;
  }
  return changes;
}

TEST(ThumbBranch, DoesNotChatterWithMotorsAtTheirLimits) {
  test::RandomValues random = seeded(56);
  const Session session(automatic());
  const EmbodimentMapping& mapping = session.mapping();
  int at_limits = 0, within = 0;
  for (unsigned corner = 0; corner < 8; ++corner) {
    Motors r, inside;
    for (std::size_t m = 0; m < 3; ++m) {
      const double lower = mapping.lower_rad(m), upper = mapping.upper_rad(m);
      r[m] = (corner >> m & 1U) != 0 ? upper : lower;
      inside[m] = r[m] + 0.125 * (r[m] == lower ? 1.0 : -1.0);
    }
    within += chatter(session.points(inside), automatic(), 1e-3, random);
    const Points at_limit = session.points(r), nearer = session.points(inside);
    at_limits += chatter(at_limit, automatic(), 1e-3, random);
    const Points beyond = blend(nearer, at_limit, 2.0);
    EXPECT_EQ(chatter(beyond, automatic(), 1e-3, random), 0) << "corner " << corner;
  }
  std::cout << "sign changes of steps above a degree in 8 x 20 s of 1 mm noise: " << within
            << " an eighth of a radian within the limits, " << at_limits << " exactly at them\n";
  EXPECT_LT(at_limits, within);
}

}  // namespace
}  // namespace embody
