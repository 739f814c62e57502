#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "core/robot/ur_kinematics.hpp"
#include "tests/support/heap_counter.hpp"

namespace embody::robot {
namespace {

constexpr double kPi = std::numbers::pi;

Vector6 joints(double q1, double q2, double q3, double q4, double q5, double q6) {
  return (Vector6() << q1, q2, q3, q4, q5, q6).finished();
}

/// Largest difference of two poses: m, and rotation-matrix elements.
double pose_error(const Pose& X_WA, const Pose& X_WB) {
  return (X_WA.matrix() - X_WB.matrix()).cwiseAbs().maxCoeff();
}

double wrapped_distance(const Vector6& a, const Vector6& b) {
  double distance = 0.0;
  for (int i = 0; i < 6; ++i) distance = std::fmax(distance, std::abs(std::remainder(a[i] - b[i], 2.0 * kPi)));
  return distance;
}

class RandomJoints {
 public:
  explicit RandomJoints(unsigned seed) : engine_(seed) {
    testing::Test::RecordProperty("seed", static_cast<int>(seed));
  }
  Vector6 operator()(double range = kPi) {
    std::uniform_real_distribution<double> uniform(-range, range);
    return Vector6::NullaryExpr([&](Eigen::Index) { return uniform(engine_); });
  }

 private:
  std::mt19937_64 engine_;
};

const Vector6 kBent = joints(0.3, -1.2, 1.8, -2.1, -1.4, 0.7);
const Vector6 kUpright = joints(0, -kPi / 2, 0, -kPi / 2, 0, 0);

TEST(UrForwardKinematics, MatchesTheNominalUr10ePosesComputedIndependently) {
  struct Case {
    Vector6 q, pose;  // pose: position (m), rotation vector (rad)
  };
  const Case cases[] = {
      {Vector6::Zero(), joints(-1.18425, -0.2907, 0.06085, 1.570796, 0, 0)},
      {kUpright, joints(0, -0.2907, 1.4848, 0, -2.221441, 2.221441)},
      {joints(0, -kPi / 2, kPi / 2, -kPi / 2, -kPi / 2, 0), joints(-0.6914, -0.17415, 0.67685, 2.221441, 2.221441, 0)},
      {kBent, joints(-0.711882, -0.423239, 0.305995, 2.470204, 1.626768, 0.029219)},
  };
  for (const Case& c : cases) {
    const Pose X_BE = math::pose_from(c.pose.head<3>(), c.pose.tail<3>());
    EXPECT_LE(pose_error(forward_kinematics(c.q), X_BE), 2e-6) << c.q.transpose();
  }
}

TEST(UrInverseKinematics, FindsTheEightSolutionsOfABentArm) {
  const Vector6 expected[] = {kBent,
                              joints(0.3, -0.842496, 1.248785, 1.235303, 1.4, -2.441593),
                              joints(0.3, 0.356224, -1.248785, 2.534153, 1.4, -2.441593),
                              joints(0.3, 0.512481, -1.8, -0.212481, -1.4, 0.7),
                              joints(-2.419702, 2.614155, 1.807194, -2.844445, 1.755452, 1.12852),
                              joints(-2.419702, -1.950004, -1.807194, -0.949083, 1.755452, 1.12852),
                              joints(-2.419702, 2.79807, 1.241396, 0.67903, -1.755452, -2.013073),
                              joints(-2.419702, -2.293395, -1.241396, 1.970103, -1.755452, -2.013073)};
  const UrSolutions solutions = inverse_kinematics(forward_kinematics(kBent), 0.0);
  ASSERT_EQ(solutions.size(), 8U);
  for (const Vector6& q : expected) {
    double nearest = std::numeric_limits<double>::infinity();
    for (const Vector6& solution : solutions) nearest = std::fmin(nearest, wrapped_distance(q, solution));
    EXPECT_LE(nearest, 2e-6) << q.transpose();
  }
}

TEST(UrInverseKinematics, EverySolutionOfRandomPosesReachesThePoseAndOneIsTheOriginal) {
  RandomJoints random_joints(/*seed=*/7);
  std::size_t with_eight = 0;
  for (int i = 0; i < 10'000; ++i) {
    const Vector6 q = random_joints();
    const Pose X_BE = forward_kinematics(q);
    const UrSolutions solutions = inverse_kinematics(X_BE, q[5]);
    double nearest = std::numeric_limits<double>::infinity();
    for (const Vector6& solution : solutions) {
      ASSERT_LE(pose_error(forward_kinematics(solution), X_BE), 1e-9) << "pose " << i << ": " << q.transpose();
      ASSERT_LE(solution.cwiseAbs().maxCoeff(), kPi + 1e-12);
      nearest = std::fmin(nearest, wrapped_distance(q, solution));
    }
    if (manipulability(q) > 1e-4) {
      ASSERT_LE(nearest, 1e-6) << "pose " << i << ": " << q.transpose();
    }
    with_eight += solutions.size() == 8 ? 1U : 0U;
  }
  EXPECT_GT(with_eight, 7'000U);  // most poses have all eight
}

TEST(UrInverseKinematics, IsExactForEveryModel) {
  RandomJoints random_joints(/*seed=*/8);
  for (const UrModel& model : kUrModels) {
    for (int i = 0; i < 1'000; ++i) {
      const Vector6 q = random_joints();
      const Pose X_BE = forward_kinematics(q, model.geometry);
      const UrSolutions solutions = inverse_kinematics(X_BE, q[5], model.geometry);
      ASSERT_FALSE(solutions.empty()) << model.name << " " << q.transpose();
      for (const Vector6& solution : solutions) {
        ASSERT_LE(pose_error(forward_kinematics(solution, model.geometry), X_BE), 1e-9) << model.name;
      }
    }
  }
}

TEST(UrInverseKinematics, StaysExactHoweverCloseTheArmIsToASingularity) {
  RandomJoints random_joints(/*seed=*/31);
  for (int i = 0; i < 5'000; ++i) {
    Vector6 q = random_joints();
    const double small = std::pow(10.0, -(i % 18));  // down to where a double no longer sees it
    q[i % 2 == 0 ? 2 : 4] = (q[0] > 0.0 ? 1.0 : -1.0) * small;
    if (i % 3 == 0) q[4] = kPi - small;
    const Pose X_BE = forward_kinematics(q);
    const UrSolutions solutions = inverse_kinematics(X_BE, q[5]);
    ASSERT_FALSE(solutions.empty()) << "pose " << i << ": " << q.transpose();
    for (const Vector6& solution : solutions) {
      ASSERT_LE(pose_error(forward_kinematics(solution), X_BE), 1e-9) << "pose " << i << ": " << q.transpose();
    }
  }
}

TEST(UrInverseKinematics, SolvesTheUprightPoseThatIsSingularThreeTimes) {
  const Pose X_BE = forward_kinematics(kUpright);
  const UrSolutions solutions = inverse_kinematics(X_BE, 0.0);
  ASSERT_GE(solutions.size(), 1U);
  for (const Vector6& q : solutions) EXPECT_LE(pose_error(forward_kinematics(q), X_BE), 1e-9);
  const Result<Vector6> nearest = solve_nearest(X_BE, kUpright);
  ASSERT_TRUE(nearest.ok());
  EXPECT_LE((*nearest - kUpright).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(UrInverseKinematics, KeepsJointSixWhenTheWristIsSingular) {
  const Vector6 q = joints(0.3, -1.2, 1.8, -2.1, 0.0, 1.234);
  const Result<Vector6> same = solve_nearest(forward_kinematics(q), q);
  ASSERT_TRUE(same.ok());
  EXPECT_LE((*same - q).cwiseAbs().maxCoeff(), 1e-9);
  Vector6 other = q;
  other[3] += 0.2;  // joints 4 and 6 share the turn: the pose is the same for another split
  other[5] -= 0.2;
  const Result<Vector6> kept = solve_nearest(forward_kinematics(q), other);
  ASSERT_TRUE(kept.ok());
  EXPECT_DOUBLE_EQ((*kept)[5], other[5]);
  EXPECT_LE(pose_error(forward_kinematics(*kept), forward_kinematics(q)), 1e-9);
}

TEST(UrInverseKinematics, FindsNothingOutOfReachInsideTheShoulderCylinderOrForInvalidPoses) {
  Pose X_BE = forward_kinematics(kBent);
  X_BE.translation() = Eigen::Vector3d(1.5, 0.0, 0.2);
  EXPECT_TRUE(inverse_kinematics(X_BE, 0.0).empty());
  EXPECT_EQ(solve_nearest(X_BE, kBent).error().code, Errc::kNotFound);
  X_BE = Pose::Identity();
  X_BE.translation() = Eigen::Vector3d(0.05, 0.05, 0.6);  // wrist centre 0.07 m beside the base axis, d4 is 0.174 m
  EXPECT_TRUE(inverse_kinematics(X_BE, 0.0).empty());
  X_BE.translation().x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(inverse_kinematics(X_BE, 0.0).empty());
  EXPECT_EQ(solve_nearest(X_BE, kBent).error().code, Errc::kInvalidArgument);
  Vector6 q_near = kBent;
  q_near[2] = std::numeric_limits<double>::infinity();
  EXPECT_EQ(solve_nearest(forward_kinematics(kBent), q_near).error().code, Errc::kInvalidArgument);
}

TEST(UrSolveNearest, ReturnsTheJointAnglesItStartedFromOverTheWholeRangeOfTwoTurns) {
  RandomJoints random_joints(/*seed=*/11);
  for (int i = 0; i < 5'000; ++i) {
    const Vector6 q = random_joints(2.0 * kPi);
    const Result<Vector6> nearest = solve_nearest(forward_kinematics(q), q);
    ASSERT_TRUE(nearest.ok()) << q.transpose();
    ASSERT_LE(pose_error(forward_kinematics(*nearest), forward_kinematics(q)), 1e-9);
    if (manipulability(q) > 1e-4) {
      ASSERT_LE((*nearest - q).cwiseAbs().maxCoeff(), 1e-6) << q.transpose();
    }
  }
}

TEST(UrSolveNearest, StaysInsideTheLimitsOrSaysThatItCannot) {
  RandomJoints random_joints(/*seed=*/13);
  UrJointRange range;
  range.lower_rad = joints(-1.0, -2.5, -2.5, -3.0, -3.0, -4.0);
  range.upper_rad = joints(2.0, 0.5, 2.5, 3.0, 3.0, 0.0);
  int solved = 0, refused = 0;
  for (int i = 0; i < 5'000; ++i) {
    const Result<Vector6> q = solve_nearest(forward_kinematics(random_joints()), random_joints(2.0 * kPi), range);
    if (!q) {
      ASSERT_EQ(q.error().code, Errc::kNotFound);
      ++refused;
      continue;
    }
    ASSERT_TRUE(((*q - range.lower_rad).array() >= 0.0).all() && ((range.upper_rad - *q).array() >= 0.0).all())
        << q->transpose();
    ++solved;
  }
  EXPECT_GT(solved, 500);
  EXPECT_GT(refused, 500);
}

TEST(UrSolveNearest, IsNeverFartherThanAnyOtherSolution) {
  RandomJoints random_joints(/*seed=*/17);
  UrJointRange range;
  range.weights = joints(5, 4, 3, 2, 1, 0.5);
  for (int i = 0; i < 2'000; ++i) {
    const Pose X_BE = forward_kinematics(random_joints());
    const Vector6 q_near = random_joints();
    const Result<Vector6> best = solve_nearest(X_BE, q_near, range);
    ASSERT_TRUE(best.ok());
    const double best_cost = (range.weights.array() * (*best - q_near).array().square()).sum();
    for (Vector6 q : inverse_kinematics(X_BE, q_near[5])) {
      for (int j = 0; j < 6; ++j) q[j] = q_near[j] + std::remainder(q[j] - q_near[j], 2.0 * kPi);
      if (q.cwiseAbs().maxCoeff() > 2.0 * kPi) continue;
      ASSERT_LE(best_cost, (range.weights.array() * (q - q_near).array().square()).sum() + 1e-9);
    }
  }
}

TEST(UrSolveNearest, FollowsASmoothPathThroughTheWristSingularityWithoutChangingTheBranch) {
  RandomJoints random_joints(/*seed=*/19);
  for (int path = 0; path < 4; ++path) {
    const Vector6 phase = random_joints(), frequency = random_joints(0.4).cwiseAbs().array() + 0.3;
    const Vector6 amplitude = joints(3.0, 0.3, 0.3, 1.5, 2.5, 5.5);  // joint 5 crosses 0, joint 6 needs two turns
    const Vector6 centre = joints(0.3, -1.2, 1.8, -2.1, 0.0, 0.0);
    const auto path_at = [&](double t) -> Vector6 {
      return centre + amplitude.cwiseProduct((frequency * t + phase).array().sin().matrix());
    };
    Vector6 q = path_at(0.0);
    for (int tick = 1; tick <= 2'500; ++tick) {
      const Vector6 q_path = path_at(0.004 * tick);
      const Result<Vector6> next = solve_nearest(forward_kinematics(q_path), q);
      ASSERT_TRUE(next.ok());
      ASSERT_LE((*next - q_path).cwiseAbs().maxCoeff(), 1e-6) << "path " << path << ", tick " << tick;
      q = *next;
    }
  }
}

TEST(UrJacobian, EqualsFiniteDifferencesOfTheFlangePose) {
  RandomJoints random_joints(/*seed=*/23);
  constexpr double kStep = 1e-6;
  for (int i = 0; i < 1'000; ++i) {
    const Vector6 q = random_joints();
    const Matrix6 J = jacobian(q);
    for (int j = 0; j < 6; ++j) {
      const Pose X_plus = forward_kinematics(q + kStep * Vector6::Unit(j));
      const Pose X_minus = forward_kinematics(q - kStep * Vector6::Unit(j));
      Vector6 slope;
      slope << X_plus.translation() - X_minus.translation(),
          math::log_so3(X_plus.linear() * X_minus.linear().transpose());
      ASSERT_LE((slope / (2.0 * kStep) - J.col(j)).cwiseAbs().maxCoeff(), 1e-8) << q.transpose();
    }
  }
}

TEST(UrManipulability, EqualsTheDeterminantOfTheJacobian) {
  RandomJoints random_joints(/*seed=*/29);
  for (int i = 0; i < 10'000; ++i) {
    const Vector6 q = random_joints();
    ASSERT_NEAR(manipulability(q), std::abs(jacobian(q).determinant()), 1e-14) << q.transpose();
  }
  EXPECT_NEAR(manipulability(kBent), 0.27332, 1e-5);
  EXPECT_NEAR(manipulability(kUpright), 0.0, 1e-15);
}

TEST(UrKinematics, NeverAllocates) {
  const Pose X_BE = forward_kinematics(kBent);
  Pose X_far = X_BE;
  X_far.translation().x() = 3.0;
  const std::uint64_t before = test::heap_allocations();
  const bool solved = solve_nearest(X_BE, kBent).ok(), refused = !solve_nearest(X_far, kBent).ok();
  const double determinant = jacobian(kBent).determinant();
  EXPECT_EQ(test::heap_allocations(), before);
  EXPECT_TRUE(solved && refused && std::isfinite(determinant));
}

}  // namespace
}  // namespace embody::robot
