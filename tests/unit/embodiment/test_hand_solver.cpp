// The solver of the embodiment mapping on the shipped hands: against SLSQP, against known answers, at kinks and limits.
#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <limits>

#include "core/embodiment/embodiment_mapping.hpp"
#include "core/embodiment/mirror_config.hpp"
#include "core/robot/mirror.hpp"
#include "tests/support/heap_counter.hpp"
#include "tests/unit/math/random_values.hpp"
#include "tests/unit/robot/hand_files.hpp"

namespace embody {
namespace {

using Eigen::Index;
using Eigen::Vector3d;
using Points = std::array<std::array<Vector3d, 2>, kFingers>;
using Variables = HandProblem::Variables;

constexpr double kPi = 3.14159265358979323846;
constexpr double kLeastCost_m2 = 1e-9;  // a few hundredths of a millimetre: below, ratios mean nothing

test::RandomValues seeded(std::uint64_t seed) {
  std::cout << "seed " << seed << "\n";
  return test::RandomValues(seed);
}

EmbodimentMapping make(const robot::RobotModel& model, const EmbodimentConfig& config) {
  auto mapping = EmbodimentMapping::create(model, config);
  if (!mapping) throw std::runtime_error(config.name + ": " + mapping.error().detail.c_str());
  return std::move(*mapping);
}

EmbodimentConfig everything_on(EmbodimentConfig config) {
  config.orientation_m = 0.01;
  config.pinch_m = 0.02;
  config.temporal_m_rad = 0.005;
  config.collision_margin_m = 0.003;
  return config;
}

/// A hand state whose points are `p_P` seen from the robot hand; its last phalanges lead to the tips.
HandState state_of(const EmbodimentMapping& mapping, const Points& p_P) {
  HandState state;
  state.valid = true;
  state.quality.fill(FingerQuality::kOptimal);
  state.confidence.fill(1.0);
  const Pose X_MP = mapping.X_PM().inverse();
  for (std::size_t f = 0; f < kFingers; ++f) {
    if (!p_P[f][0].allFinite()) continue;
    for (std::size_t i = 0; i < 2; ++i) state.p_M[f][i] = X_MP * p_P[f][i];
    const Vector3d along_M = (state.p_M[f][0] - state.p_M[f][1]).normalized();
    state.distal_M[f] = {state.p_M[f][0] - 0.025 * along_M, state.p_M[f][0]};
  }
  return state;
}

std::span<const double> motors_of(const FingerTarget& target) {
  return {target.q_rad.data(), target.joint_count};
}

/// Smooth curves through the ranges of all motors, into the limits now and then.
class Trajectory {
 public:
  Trajectory(const EmbodimentMapping& mapping, test::RandomValues& random) : mapping_(mapping) {
    for (std::size_t m = 0; m < mapping.motor_count(); ++m) {
      waves_.push_back({random(0.0, 2.0 * kPi), random(0.5, 2.5), random(0.0, 2.0 * kPi), random(0.5, 2.5)});
    }
  }
  [[nodiscard]] std::vector<double> motors(double t_s) const {
    std::vector<double> r;
    for (std::size_t m = 0; m < waves_.size(); ++m) {
      const auto& [phase, speed, phase2, speed2] = waves_[m];
      const double wave = 0.75 * std::sin(phase + speed * t_s) + 0.3 * std::sin(phase2 + speed2 * t_s);
      const double share = std::clamp(0.5 + 0.5 * wave, 0.0, 1.0);
      r.push_back(mapping_.lower_rad(m) + share * (mapping_.upper_rad(m) - mapping_.lower_rad(m)));
    }
    return r;
  }

 private:
  const EmbodimentMapping& mapping_;
  std::vector<std::array<double, 4>> waves_;
};

/// Smooth displacement of every point, up to 8 mm, and white noise of 0.3 mm.
void disturb(Points& p_P, double t_s, test::RandomValues& random) {
  for (std::size_t f = 0; f < kFingers; ++f) {
    for (std::size_t i = 0; i < 2; ++i) {
      const double k = 1.0 + 0.37 * static_cast<double>(2 * f + i);
      p_P[f][i] += 0.008 * Vector3d(std::sin(k * t_s), std::sin(1.3 * k * t_s + 1.0), std::cos(0.7 * k * t_s));
      p_P[f][i] += random.vector<3>(-3e-4, 3e-4);
    }
  }
}

/// Cost of the last step against the reference solver's on the same problems from the same starts within the same
/// reach: the worst group.
double worst_ratio(const EmbodimentMapping& mapping) {
  double worst = 0.0;
  for (const HandGroup& group : mapping.groups()) {
    HandProblem problem = mapping.problem(group);
    const auto ranges = group.within_reach();
    const HandSolution best = solve_slsqp(problem, {ranges.begin(), ranges.size()}, group.start, 2000, 1e-14);
    worst = std::max(worst, std::max(group.solution.cost_m2, kLeastCost_m2) / std::max(best.cost_m2, kLeastCost_m2));
  }
  return worst;
}

struct Comparison {
  int frames{0}, costly{0}, capped{0};
  double worst{0.0};

  Comparison& operator+=(const Comparison& other) {
    frames += other.frames;
    costly += other.costly;
    capped += other.capped;
    worst = std::max(worst, other.worst);
    return *this;
  }
};

/// Whether two finger tips would be more than 3 mm inside of each other: no hand goes through itself.
bool overlaps(const EmbodimentMapping& mapping, std::span<const double> r) {
  for (std::size_t a = 0; a < kFingers; ++a) {
    for (std::size_t b = a + 1; b < kFingers; ++b) {
      if (mapping.pad_gap_m(static_cast<Finger>(a), static_cast<Finger>(b), r) < -0.003) return true;
    }
  }
  return false;
}

Comparison compare(EmbodimentMapping mapping, int frames, test::RandomValues& random) {
  const Trajectory trajectory(mapping, random);
  Comparison result;
  FingerTarget target;
  for (int n = 0; n < frames; ++n) {
    const double t_s = 0.01 * n;
    const std::vector<double> r = trajectory.motors(t_s);
    if (mapping.config().collision_margin_m > 0.0 && overlaps(mapping, r)) continue;
    Points p_P = mapping.finger_points(r);
    disturb(p_P, t_s, random);
    HandState state = state_of(mapping, p_P);
    state.t_capture = TimePoint(std::chrono::milliseconds(10 * n));
    mapping.step(state, target);
    EXPECT_TRUE(target.valid);
    ++result.frames;
    const double ratio = worst_ratio(mapping);
    result.worst = std::max(result.worst, ratio);
    result.costly += ratio > 1.01 ? 1 : 0;
    for (const HandGroup& group : mapping.groups()) {
      result.capped += group.solution.converged ? 0 : 1;
    }
  }
  return result;
}

void print(const char* what, const std::string& hand, const Comparison& c) {
  std::cout << what << " " << hand << ": " << c.frames << " frames, " << c.costly << " above 1.01 x SLSQP (worst "
            << c.worst << "), " << c.capped << " groups capped\n";
}

TEST(HandSolver, CostsNoMoreThanSlsqpFromTheSameStart) {
  test::RandomValues random = seeded(31);
  for (const char* name : test::kHandFiles) {
    Comparison sum;
    for (int run = 0; run < 4; ++run) {
      sum += compare(make(test::hand_model(name), test::hand_config(name)), 300, random);
    }
    print("plain", name, sum);
    EXPECT_LE(sum.costly, 0.005 * sum.frames) << name;
  }
}

TEST(HandSolver, CostsNoMoreThanSlsqpWithTheAdditions) {
  test::RandomValues random = seeded(32);
  for (const char* name : test::kHandFiles) {
    const EmbodimentConfig plain = test::hand_config(name);
    EmbodimentConfig directed = plain, pinching = plain;
    directed.orientation_m = 0.01;
    directed.temporal_m_rad = 0.005;
    pinching.pinch_m = 0.02;
    for (const auto& [what, config] : {std::pair{"orientation and stay", directed}, std::pair{"pinch", pinching},
                                       std::pair{"everything", everything_on(plain)}}) {
      Comparison sum;
      for (int run = 0; run < 5; ++run) sum += compare(make(test::hand_model(name), config), 200, random);
      print(what, name, sum);
      // Shadow has more minima with the additions than without them; all others hold the bound of the plain objective.
      const bool many = std::string(name) == "shadow" && what != std::string("pinch");
      EXPECT_LE(sum.costly, (many ? 0.015 : 0.005) * sum.frames) << name << ", " << what;
    }
  }
}

TEST(HandSolver, RecoversTheRobotsOwnPointsAlongATrajectory) {
  test::RandomValues random = seeded(33);
  for (const bool mirror : {false, true}) {
    for (const char* name : test::kHandFiles) {
      robot::RobotModel model = test::hand_model(name);
      EmbodimentConfig config = test::hand_config(name);
      if (mirror) {
        model = robot::mirrored(model);
        config = mirrored(config);
      }
      int missed = 0, frames = 0;
      double worst_m = 0.0;
      for (int run = 0; run < 5; ++run) {
        EmbodimentMapping mapping = make(model, config);
        const Trajectory trajectory(mapping, random);
        FingerTarget target;
        for (int n = 0; n < 500; ++n, ++frames) {
          mapping.step(state_of(mapping, mapping.finger_points(trajectory.motors(0.01 * n))), target);
          const double residual_m = *std::max_element(target.residual_m.begin(), target.residual_m.end());
          worst_m = std::max(worst_m, residual_m);
          missed += residual_m < 1e-6 ? 0 : 1;
        }
      }
      std::cout << name << (mirror ? " mirrored" : "") << ": worst residual " << worst_m << " m, " << missed << " of "
                << frames << " frames missed\n";
      EXPECT_EQ(missed, 0) << name;
    }
  }
}

std::size_t motor_index(const EmbodimentMapping& mapping, const std::string& name) {
  const auto& names = mapping.motor_names();
  const auto at = std::find(names.begin(), names.end(), name);
  if (at == names.end()) throw std::runtime_error("no motor " + name);
  return static_cast<std::size_t>(at - names.begin());
}

double joint_angle(const EmbodimentMapping& mapping, const HandJointAngles& angles, const std::string& name) {
  const auto& names = mapping.urdf_joint_names();
  const auto at = std::find(names.begin(), names.end(), name);
  if (at == names.end()) throw std::runtime_error("no joint " + name);
  return angles.q_rad[static_cast<std::size_t>(at - names.begin())];
}

/// Costs around the last solution, on a dense grid of one motor, the others as solved.
struct Grid {
  double found{0.0};
  double least{std::numeric_limits<double>::infinity()};         // over the whole range
  double least_nearby{std::numeric_limits<double>::infinity()};  // within 0.02 rad
};

Grid grid_of(const EmbodimentMapping& mapping, std::size_t motor) {
  Grid grid;
  for (const HandGroup& group : mapping.groups()) {
    HandProblem problem = mapping.problem(group);
    const auto at = std::find(problem.motors().begin(), problem.motors().end(), motor);
    if (at == problem.motors().end()) continue;
    grid.found = group.solution.cost_m2;
    Variables x = group.solution.x;
    double& r = x(at - problem.motors().begin());
    const double solved = r;
    for (int k = 0; k <= 2000; ++k) {
      r = mapping.lower_rad(motor) + k / 2000.0 * (mapping.upper_rad(motor) - mapping.lower_rad(motor));
      const double cost = problem.cost(x);
      grid.least = std::min(grid.least, cost);
      if (std::abs(r - solved) < 0.02) grid.least_nearby = std::min(grid.least_nearby, cost);
    }
  }
  return grid;
}

struct Valleys {
  int solved{0}, in_the_worse{0};
};

/// Bends the Shadow's fingers by J0 and straightens them again, in `frames` frames each way, in a second or slower:
/// no joint has to turn faster than the mapping lets it.
void bend_middle_then_distal(int frames, double noise_m, test::RandomValues& random, Valleys& valleys) {
  EmbodimentMapping mapping = make(test::hand_model("shadow"), test::hand_config("shadow"));
  FingerTarget target;
  const Duration period = from_seconds(std::max(0.05, 1.0 / frames));
  for (int n = 0; n <= 2 * frames; ++n) {
    const double share = 1.0 - std::abs(1.0 - static_cast<double>(n) / frames);
    std::vector<double> r(mapping.motor_count(), 0.2);
    for (const char* finger : {"FF", "MF", "RF", "LF"}) {
      r[motor_index(mapping, std::string("rh_") + finger + "J0")] = 0.1 + 2.9 * share;
    }
    Points p_P = mapping.finger_points(r);
    for (auto& finger : p_P) {
      for (Vector3d& p : finger) p += noise_m * random.vector<3>(-1.0, 1.0);
    }
    HandState state = state_of(mapping, p_P);
    state.t_capture = TimePoint(n * period);
    mapping.step(state, target);
    ASSERT_TRUE(target.valid);
    for (const char* finger : {"FF", "MF", "RF", "LF"}) {
      const std::size_t motor = motor_index(mapping, std::string("rh_") + finger + "J0");
      const Grid grid = grid_of(mapping, motor);
      ASSERT_LE(grid.found, grid.least_nearby + 1e-15) << finger << ", J0 = " << r[motor] << ", frame " << n;
      ++valleys.solved;
      valleys.in_the_worse += grid.found > grid.least + 1e-15 ? 1 : 0;
      if (noise_m > 0.0) continue;
      ASSERT_NEAR(target.q_rad[motor], r[motor], 1e-6) << finger << ", frame " << n << " of " << frames;
      const HandJointAngles angles = mapping.urdf_joint_angles(motors_of(target));
      const bool beyond = r[motor] > 0.5 * kPi + 1e-5;
      const double J1 = joint_angle(mapping, angles, std::string("rh_") + finger + "J1");
      ASSERT_EQ(J1 > 0.0, beyond) << finger << ": the distal joint bends after the middle one only";
    }
  }
}

TEST(HandSolver, CrossesTheKinkBetweenTheShadowsMiddleAndDistalJointsBothWays) {
  test::RandomValues random = seeded(34);
  Valleys exact, noisy;
  for (const int frames : {100, 10, 3, 1}) {
    bend_middle_then_distal(frames, 0.0, random, exact);
    bend_middle_then_distal(frames, 0.004, random, noisy);
  }
  std::cout << "a better minimum beyond the kink or elsewhere on the grid: exact goals " << exact.in_the_worse << " of "
            << exact.solved << ", with 4 mm of noise " << noisy.in_the_worse << " of " << noisy.solved << "\n";
  EXPECT_EQ(exact.in_the_worse, 0);
  EXPECT_LE(noisy.in_the_worse, 0.01 * noisy.solved);
}

TEST(HandSolver, GoesToAnotherPostureAtABoundedSpeedAndComesToRest) {
  test::RandomValues random = seeded(39);
  const EmbodimentMapping fresh = make(test::hand_model("shadow"), test::hand_config("shadow"));
  const double fastest_rad = 26.0 * 0.01 + 1e-12;
  for (int n = 0; n < 50; ++n) {
    EmbodimentMapping mapping = fresh;
    FingerTarget target;
    std::vector<double> last;
    double step_rad = 0.0;
    for (const bool second : {false, true}) {
      const Points p_P = mapping.finger_points(Trajectory(mapping, random).motors(0.0));
      for (int k = 0; k < 100; ++k) {
        HandState state = state_of(mapping, p_P);
        state.t_capture = TimePoint(std::chrono::milliseconds(10 * (k + (second ? 100 : 0))));
        mapping.step(state, target);
        ASSERT_TRUE(target.valid);
        step_rad = 0.0;
        for (std::size_t m = 0; m < last.size(); ++m) {
          step_rad = std::max(step_rad, std::abs(target.q_rad[m] - last[m]));
        }
        ASSERT_LE(step_rad, fastest_rad);
        last.assign(target.q_rad.begin(), target.q_rad.begin() + static_cast<std::ptrdiff_t>(mapping.motor_count()));
      }
    }
    ASSERT_LT(step_rad, 1e-6);
  }
}

/// A hand somewhere else, of another size, turned: nothing that the robot could reach.
Points wild_points(test::RandomValues& random) {
  Points p_P;
  const double size_m = std::pow(10.0, random(-2.0, 2.0));
  for (auto& finger : p_P) {
    for (Vector3d& p : finger) p = size_m * random.vector<3>(-1.0, 1.0);
  }
  return p_P;
}

/// What must hold for every output of a hand, exactly.
void expect_lawful(const EmbodimentMapping& mapping, const robot::RobotModel& model, const FingerTarget& target) {
  ASSERT_EQ(target.joint_count, mapping.motor_count());
  for (std::size_t m = 0; m < mapping.motor_count(); ++m) {
    ASSERT_GE(target.q_rad[m], mapping.lower_rad(m)) << mapping.motor_names()[m];
    ASSERT_LE(target.q_rad[m], mapping.upper_rad(m)) << mapping.motor_names()[m];
  }
  const HandJointAngles angles = mapping.urdf_joint_angles(motors_of(target));
  for (std::size_t i = 0; i < angles.count; ++i) {
    const robot::Joint& joint = model.joints[*model.find_joint(mapping.urdf_joint_names()[i])];
    ASSERT_GE(angles.q_rad[i], joint.lower) << joint.name;
    ASSERT_LE(angles.q_rad[i], joint.upper) << joint.name;
  }
  const std::vector<double> q = test::motor_angles(model, mapping.config(), motors_of(target));
  for (std::size_t i = 0; i < angles.count; ++i) {
    const std::string& name = mapping.urdf_joint_names()[i];
    ASSERT_NEAR(angles.q_rad[i], q[*model.find_joint(name)], 1e-14) << name;
  }
}

void expect_coupled(const EmbodimentMapping& mapping, const std::string& hand, const FingerTarget& target) {
  const HandJointAngles angles = mapping.urdf_joint_angles(motors_of(target));
  const auto angle = [&](const std::string& joint) { return joint_angle(mapping, angles, joint); };
  const auto motor = [&](const std::string& name) { return target.q_rad[motor_index(mapping, name)]; };
  constexpr double kRounding = 1e-15;
  if (hand == "mia") {
    ASSERT_NEAR(angle("j_index_fle"), std::abs(motor("j_index_fle")), kRounding);
    const double expected = -0.628319 * std::clamp((0.0731 - motor("j_index_fle")) / (0.0731 + 0.6536), 0.0, 1.0);
    ASSERT_NEAR(angle("j_thumb_opp"), expected, kRounding);
    ASSERT_EQ(angle("j_ring_fle"), motor("j_mrl_fle"));
    ASSERT_EQ(angle("j_little_fle"), motor("j_mrl_fle"));
  }
  if (hand == "shadow") {
    for (const char* finger : {"FF", "MF", "RF", "LF"}) {
      const std::string prefix = std::string("rh_") + finger;
      const double bent = motor(prefix + "J0");
      ASSERT_NEAR(angle(prefix + "J1"), bent - angle(prefix + "J2"), 4.0 * kRounding) << finger;
      ASSERT_NEAR(angle(prefix + "J2"), std::min(bent, 1.570796), kRounding) << finger;
    }
    ASSERT_EQ(angle("rh_WRJ1"), 0.0);
    ASSERT_EQ(angle("rh_WRJ2"), 0.0);
  }
  if (hand == "robotiq_2f140") {
    for (std::size_t i = 0; i < angles.count; ++i) ASSERT_EQ(std::abs(angles.q_rad[i]), motor("finger_joint"));
  }
  if (hand == "barrett") {
    ASSERT_EQ(angle("finger_1_prox_joint"), -angle("finger_2_prox_joint"));
    for (const char* finger : {"finger_1", "finger_2", "finger_3"}) {
      const std::string prefix = finger;  // the URDF writes ten digits of the third
      ASSERT_NEAR(angle(prefix + "_dist_joint"), angle(prefix + "_med_joint") / 3.0, 1e-9) << finger;
    }
  }
}

TEST(HandSolver, NeverLeavesTheLimitsAndHoldsTheCouplingsForWildGoals) {
  test::RandomValues random = seeded(35);
  for (const char* name : test::kHandFiles) {
    const robot::RobotModel model = test::hand_model(name);
    for (const ThumbMode mode : {ThumbMode::kOpposed, ThumbMode::kLateral, ThumbMode::kAutomatic}) {
      for (const bool everything : {false, true}) {
        EmbodimentConfig config = test::hand_config(name);
        config.thumb_mode = mode;
        EmbodimentMapping mapping = make(model, everything ? everything_on(config) : config);
        FingerTarget target;
        for (int n = 0; n < 200; ++n) {
          mapping.step(state_of(mapping, wild_points(random)), target);
          ASSERT_TRUE(target.valid);
          expect_lawful(mapping, model, target);
          expect_coupled(mapping, name, target);
          if (HasFatalFailure()) FAIL() << name << ", hand " << n << ", everything " << everything;
        }
      }
    }
  }
}

TEST(HandSolver, KeepsTheLastAnglesWhenTheGoalIsNotFinite) {
  test::RandomValues random = seeded(36);
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  for (const char* name : test::kHandFiles) {
    EmbodimentMapping mapping = make(test::hand_model(name), everything_on(test::hand_config(name)));
    const Trajectory trajectory(mapping, random);
    FingerTarget target, again;
    for (const double bad : {nan, inf, -inf}) {
      for (int n = 0; n < 30; ++n) {
        const HandState good = state_of(mapping, mapping.finger_points(trajectory.motors(0.1 * n)));
        mapping.step(good, target);
        ASSERT_TRUE(target.valid);
        const std::array<double, kMaxHandJoints> last = target.q_rad;
        HandState broken = state_of(mapping, mapping.finger_points(trajectory.motors(0.1 * n + 1.0)));
        const auto finger = static_cast<std::size_t>(n % 2);  // thumb and index: every hand has them
        auto& p_M = n % 4 < 2 ? broken.p_M[finger][static_cast<std::size_t>(n / 4 % 2)]
                              : broken.distal_M[finger][static_cast<std::size_t>(n / 4 % 2)];
        p_M(n % 3) = bad;
        mapping.step(broken, target);
        ASSERT_FALSE(target.valid) << name;
        ASSERT_EQ(target.q_rad, last) << name;
        mapping.step(good, again);
        ASSERT_TRUE(again.valid);
      }
    }
  }
}

TEST(HandSolver, NeverAllocatesWithEveryAddition) {
  test::RandomValues random = seeded(37);
  for (const char* name : test::kHandFiles) {
    for (const ThumbMode mode : {ThumbMode::kOpposed, ThumbMode::kAutomatic}) {
      EmbodimentConfig config = everything_on(test::hand_config(name));
      config.thumb_mode = mode;
      config.collision_margin_m = 0.03;  // so that fingers are solved together
      config.pinch_m = 0.05;
      EmbodimentMapping mapping = make(test::hand_model(name), config);
      const Trajectory trajectory(mapping, random);
      FingerTarget target;
      std::uint64_t allocations = 0;
      for (int n = 0; n < 50; ++n) {
        HandState state = state_of(mapping, mapping.finger_points(trajectory.motors(0.05 * n)));
        if (n == 20) state.p_M[0][0].x() = std::numeric_limits<double>::quiet_NaN();
        if (n > 30) state = state_of(mapping, wild_points(random));
        const std::uint64_t before = test::heap_allocations();
        mapping.step(state, target);
        const HandJointAngles angles = mapping.urdf_joint_angles(motors_of(target));
        allocations += test::heap_allocations() - before;
        ASSERT_GT(angles.count, 0U);
      }
      EXPECT_EQ(allocations, 0U) << name;
    }
  }
}

TEST(HandSolver, RespectsItsCapOfIterations) {
  test::RandomValues random = seeded(38);
  for (const char* name : test::kHandFiles) {
    EmbodimentMapping mapping = make(test::hand_model(name), everything_on(test::hand_config(name)));
    FingerTarget target;
    int most = 0, capped = 0, beyond = 0;
    for (int n = 0; n < 300; ++n) {
      mapping.step(state_of(mapping, wild_points(random)), target);
      for (const HandGroup& group : mapping.groups()) {
        most = std::max(most, group.solution.iterations);
        for (const int cap : {1, 3, 8}) {
          HandProblem problem = mapping.problem(group);
          HandSolverOptions options;
          options.max_iterations = cap;
          const std::span<const MotorRange> ranges{group.ranges.begin(), group.ranges.size()};
          const HandSolution found = solve_own(problem, ranges, group.start, options);
          ASSERT_TRUE(found.valid);
          ASSERT_LE(found.cost_m2, problem.cost(group.start)) << name;  // never uphill
          capped += found.converged ? 0 : 1;
          beyond += found.iterations > cap ? 1 : 0;
        }
      }
    }
    std::cout << name << ": at most " << most << " iterations of " << HandSolverOptions{}.max_iterations << "; "
              << capped << " solves ended at a lower cap, " << beyond << " beyond it\n";
    EXPECT_LE(most, 3 * HandSolverOptions{}.max_iterations) << name;  // the stiff terms have three times the cap
    EXPECT_EQ(beyond, 0) << name;
  }
}

}  // namespace
}  // namespace embody
