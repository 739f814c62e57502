#include "core/hand/finger_estimator.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "core/hand/hand_pose_estimator.hpp"
#include "core/hand/synthetic_motion.hpp"
#include "tests/support/heap_counter.hpp"
#include "tests/unit/hand/real_recording.hpp"
#include "tests/unit/math/random_values.hpp"

namespace embody::hand {
namespace {

using Eigen::Vector3d;

// A hand pose and the markers that the model shows there, plus noise.
struct Scene {
  HandPose hand_pose;
  MarkerFrame frame;
};

Scene scene_of(const HandModel& model, const std::array<Vector9, kFingers>& q, test::RandomValues& random,
               double noise_m = 0.0) {
  Scene scene;
  scene.hand_pose.X_WM = math::pose_from(random.vector<3>(-1.0, 1.0), random.rotation(3.0));
  scene.hand_pose.valid = true;
  scene.frame.count = 13;
  for (std::size_t f = 0; f < kFingers; ++f) {
    const auto p_M = model.finger_points(static_cast<Finger>(f), q[f]);
    for (std::size_t point = 0; point < 2; ++point) {
      const Vector3d p_M_noisy = p_M[point] + noise_m * random.vector<3>(-1.0, 1.0);
      scene.frame.markers[3 + 2 * f + point] = {scene.hand_pose.X_WM * p_M_noisy, true};
    }
  }
  return scene;
}

std::array<Vector9, kFingers> natural_angles(test::RandomValues& random) {
  std::array<Vector9, kFingers> q;
  for (Vector9& finger : q) {
    finger << 0, random(-.2, .2), random(-.1, 1.0), 0, 0, random(.1, 1.0), 0, 0, random(.1, .8);
  }
  q[0] << random(-.1, .2), random(.0, .3), random(-.1, .4), random(-.1, .2), random(-.2, .2), 0, 0, 0, 0;
  return q;
}

bool converged(FingerQuality quality) {
  return quality == FingerQuality::kOptimal || quality == FingerQuality::kAtLimit;
}

Vector9 angles(const HandState& state, std::size_t finger) {
  return state.q_rad.segment<9>(static_cast<Eigen::Index>(kFingerOffset[finger]));
}

// The paper's objective, written down a second time.
double objective(const HandModel& model, const FingerEstimatorConfig& config, const Scene& scene, std::size_t f,
                 const Vector9& q) {
  const auto p_M = model.finger_points(static_cast<Finger>(f), q);
  double sum = 0.0;
  for (std::size_t point = 0; point < 2; ++point) {
    const Marker& marker = scene.frame.markers[3 + 2 * f + point];
    if (marker.visible) sum += (scene.hand_pose.X_WM.inverse() * marker.p_W - p_M[point]).squaredNorm();
  }
  for (Eigen::Index i = 0; i < 9; ++i) {
    const double plus = std::max(config.weight_plus[f](i) * q(i), 0.0);
    const double minus = std::min(config.weight_minus[f](i) * q(i), 0.0);
    sum += plus * plus + minus * minus;
  }
  return sum;
}

TEST(FingerEstimator, RecoversTheMarkerPointsOfAnyNaturalPose) {
  const HandModel model;
  test::RandomValues random(51);
  for (int i = 0; i < 300; ++i) {
    const Scene scene = scene_of(model, natural_angles(random), random);
    FingerEstimator estimator(model, paper_glove(), {});
    HandState state;
    estimator.step(scene.frame, scene.hand_pose, state);
    ASSERT_TRUE(state.valid);
    for (std::size_t f = 0; f < kFingers; ++f) {
      ASSERT_TRUE(converged(state.quality[f])) << "pose " << i << " " << kFingerNames[f];
      ASSERT_EQ(state.visible_markers[f], 2);
      ASSERT_LT(state.residual_m[f], 4e-3) << "pose " << i << " " << kFingerNames[f];
      double distance_m = 0.0;
      for (std::size_t point = 0; point < 2; ++point) {
        const Vector3d p_M = scene.hand_pose.X_WM.inverse() * scene.frame.markers[3 + 2 * f + point].p_W;
        distance_m += 0.5 * (p_M - state.p_M[f][point]).norm();
      }
      ASSERT_NEAR(state.residual_m[f], distance_m, 1e-12) << "mean distance to the model's points";
    }
  }
}

TEST(FingerEstimator, AgreesWithSlsqpOnThePapersObjective) {
  const HandModel model;
  const FingerEstimatorConfig config;
  test::RandomValues random(52);
  for (int i = 0; i < 60; ++i) {
    auto q = natural_angles(random);
    FingerEstimator estimator(model, paper_glove(), config);
    HandState state;
    const Scene first = scene_of(model, q, random, 1e-3);
    estimator.step(first.frame, first.hand_pose, state);
    for (Vector9& finger : q) finger += random.vector<9>(-.02, .02);
    const Scene scene = scene_of(model, q, random, 2e-3);
    estimator.step(scene.frame, scene.hand_pose, state);
    for (std::size_t f = 0; f < kFingers; ++f) {
      const auto cost = [&](const Vector9& x) { return objective(model, config, scene, f, x); };
      const Vector9 reference = solve_slsqp(estimator.problem(static_cast<Finger>(f)), 2'000, 1e-14).q_rad;
      const double theirs = cost(reference);
      const double ours = cost(angles(state, f));
      ASSERT_NEAR(ours, theirs, 1e-3 * theirs) << "pose " << i << " " << kFingerNames[f];
    }
  }
}

TEST(FingerEstimator, EndsAtAMinimumOfThePapersObjectiveInTheBox) {
  const HandModel model;
  FingerEstimatorConfig config = FingerEstimatorConfig::published();
  config.max_iterations = 200;
  test::RandomValues random(53);
  for (int i = 0; i < 200; ++i) {
    const Scene scene = scene_of(model, natural_angles(random), random, 5e-3);
    FingerEstimator estimator(model, paper_glove(), config);
    HandState state;
    estimator.step(scene.frame, scene.hand_pose, state);
    for (std::size_t f = 0; f < kFingers; ++f) {
      const Vector9 q = angles(state, f);
      const double best = objective(model, config, scene, f, q);
      for (int direction = 0; direction < 30; ++direction) {
        const Vector9 nearby =
            (q + 1e-3 * random.vector<9>(-1.0, 1.0)).cwiseMax(config.lower_rad[f]).cwiseMin(config.upper_rad[f]);
        ASSERT_GE(objective(model, config, scene, f, nearby), best - 1e-12) << "pose " << i << " " << kFingerNames[f];
      }
    }
  }
}

TEST(FingerProblem, HasTheGradientOfItsCostForBothObjectivesAndSides) {
  test::RandomValues random(63);
  for (const Side side : {Side::kRight, Side::kLeft}) {
    const HandData data = builtin_hand(Skeleton::kWebXr, side);
    const HandModel model(data, random.vector<10>(-.1, .1), default_points(data));
    for (int i = 0; i < 200; ++i) {
      FingerProblem problem;
      problem.model = &model;
      problem.finger = static_cast<Finger>(i % 5);
      problem.objective = i % 2 == 0 ? FingerObjective::kPaper : FingerObjective::kPublished;
      for (std::size_t point = 0; point < 2; ++point) {
        problem.markers.push_back({point, random.vector<3>(-.1, .1), random(.1, 1.0)});
      }
      problem.weight_plus = random.vector<9>(.01, .1);
      problem.weight_minus = random.vector<9>(.01, .1);
      problem.coupling_m_rad = .03;
      problem.temporal_m_rad = random.vector<9>(.01, .1);
      problem.q_previous_rad = random.vector<9>(-1.0, 1.0);
      const Vector9 q = random.vector<9>(-1.2, 1.2);
      Vector9 gradient;
      ASSERT_EQ(problem.cost(q, gradient), problem.cost(q));
      constexpr double kStep = 1e-6;
      for (Eigen::Index k = 0; k < 9; ++k) {
        const double difference =
            (problem.cost(q + kStep * Vector9::Unit(k)) - problem.cost(q - kStep * Vector9::Unit(k))) / (2.0 * kStep);
        ASSERT_NEAR(gradient(k), difference, 1e-8) << "angle " << k << " at " << q.transpose();
      }
    }
  }
}

TEST(FingerProblem, SquaresEachAngleInThePapersPenaltyAndTheirSumInThePublishedOne) {
  const HandModel model;
  FingerProblem problem;
  problem.model = &model;
  problem.finger = Finger::kIndex;
  problem.weight_plus.setConstant(2.0);
  problem.weight_minus.setConstant(3.0);
  Vector9 q = Vector9::Zero();
  q(2) = 0.5;
  q(5) = 0.25;
  q(7) = -0.125;
  EXPECT_DOUBLE_EQ(problem.cost(q), 1.0 + 0.25 + 0.140625);
  problem.objective = FingerObjective::kPublished;
  EXPECT_DOUBLE_EQ(problem.cost(q), 1.5 * 1.5 + 0.140625);
}

TEST(FingerEstimator, NeverLeavesTheConfiguredBounds) {
  const HandModel model;
  FingerEstimatorConfig config;
  config.trust_labels = true;  // unrelated postures: every one is fitted
  config.lower_rad[2].setConstant(-.1);
  config.upper_rad[2].setConstant(.15);
  test::RandomValues random(54);
  FingerEstimator estimator(model, paper_glove(), config);
  HandState state;
  for (int i = 0; i < 300; ++i) {
    const Scene scene = scene_of(model, natural_angles(random), random, 50e-3);
    estimator.step(scene.frame, scene.hand_pose, state);
    for (std::size_t f = 0; f < kFingers; ++f) {
      ASSERT_NE(state.quality[f], FingerQuality::kHeld);
      ASSERT_TRUE((angles(state, f).array() >= config.lower_rad[f].array()).all());
      ASSERT_TRUE((angles(state, f).array() <= config.upper_rad[f].array()).all());
    }
  }
}

TEST(FingerEstimator, DoesNotDependOnWhereTheHandIs) {
  const HandModel model;
  test::RandomValues random(55);
  for (int i = 0; i < 50; ++i) {
    Scene scene = scene_of(model, natural_angles(random), random, 2e-3);
    FingerEstimator here(model, paper_glove(), {}), there(model, paper_glove(), {});
    HandState state_here, state_there;
    here.step(scene.frame, scene.hand_pose, state_here);
    const Pose X_VW = math::pose_from(random.vector<3>(-2.0, 2.0), random.rotation(3.0));
    for (Marker& marker : scene.frame.markers) marker.p_W = X_VW * marker.p_W;
    scene.hand_pose.X_WM = X_VW * scene.hand_pose.X_WM;
    there.step(scene.frame, scene.hand_pose, state_there);
    ASSERT_LT((state_here.q_rad - state_there.q_rad).cwiseAbs().maxCoeff(), 1e-3) << "pose " << i;
  }
}

TEST(FingerEstimator, HoldsAFingerWithoutVisibleMarkersAndOnlyThatOne) {
  const HandModel model;
  test::RandomValues random(56);
  auto q = natural_angles(random);
  FingerEstimator estimator(model, paper_glove(), {});
  HandState state;
  Scene scene = scene_of(model, q, random);
  scene.frame.markers[7].visible = scene.frame.markers[8].visible = false;
  estimator.step(scene.frame, scene.hand_pose, state);
  EXPECT_EQ(state.quality[2], FingerQuality::kNone) << "nothing to hold yet";
  EXPECT_EQ(angles(state, 2), Vector9::Zero());

  scene = scene_of(model, q, random);
  estimator.step(scene.frame, scene.hand_pose, state);
  const HandState before = state;
  for (Vector9& finger : q) finger(2) += 0.2;
  scene = scene_of(model, q, random);
  scene.frame.markers[7].visible = false;
  scene.frame.markers[8].p_W.x() = std::numeric_limits<double>::quiet_NaN();
  for (int i = 0; i < 3; ++i) estimator.step(scene.frame, scene.hand_pose, state);
  EXPECT_TRUE(state.valid);
  EXPECT_EQ(state.quality[2], FingerQuality::kHeld);
  EXPECT_EQ(state.visible_markers[2], 0);
  EXPECT_EQ(angles(state, 2), angles(before, 2));
  EXPECT_EQ(state.p_M[2], before.p_M[2]);
  EXPECT_EQ(state.residual_m[2], before.residual_m[2]);
  EXPECT_EQ(state.quality[1], FingerQuality::kOptimal);
  EXPECT_GT((angles(state, 1) - angles(before, 1)).norm(), 0.05);
}

TEST(FingerEstimator, KeepsTheEndJointsWhileOnlyTheMiddleMarkerIsSeen) {
  const HandModel model;
  test::RandomValues random(57);
  auto q = natural_angles(random);
  FingerEstimatorConfig config;
  config.trust_labels = true;  // the markers jump farther than a finger moves
  FingerEstimator estimator(model, paper_glove(), config);
  HandState state;
  Scene scene = scene_of(model, q, random);
  estimator.step(scene.frame, scene.hand_pose, state);
  const Vector9 before = angles(state, 1);
  q[1](2) += 0.3;
  scene = scene_of(model, q, random);
  scene.frame.markers[5].visible = false;
  for (int i = 0; i < 20; ++i) estimator.step(scene.frame, scene.hand_pose, state);
  EXPECT_EQ(state.visible_markers[1], 1);
  EXPECT_TRUE(converged(state.quality[1]));
  EXPECT_EQ(angles(state, 1).tail<6>(), before.tail<6>());
  EXPECT_NEAR(angles(state, 1)(2), before(2) + 0.3, 0.05);
  EXPECT_LT(state.residual_m[1], 1e-3);
}

TEST(FingerEstimator, HoldsEverythingAndSaysSoWithoutAValidHandPose) {
  const HandModel model;
  test::RandomValues random(58);
  FingerEstimator estimator(model, paper_glove(), {});
  HandState state;
  const Scene scene = scene_of(model, natural_angles(random), random);
  estimator.step(scene.frame, scene.hand_pose, state);
  const HandState before = state;
  Scene lost = scene_of(model, natural_angles(random), random);
  lost.frame.frame_number = 7;
  lost.hand_pose.valid = false;
  estimator.step(lost.frame, lost.hand_pose, state);
  EXPECT_FALSE(state.valid);
  EXPECT_EQ(state.frame_number, 7u);
  EXPECT_EQ(state.q_rad, before.q_rad);
  EXPECT_EQ(state.p_M, before.p_M);
  for (const FingerQuality quality : state.quality) EXPECT_EQ(quality, FingerQuality::kHeld);
}

TEST(FingerEstimator, SurvivesAbsurdMarkersAndRecovers) {
  const HandModel model;
  test::RandomValues random(59);
  const Scene good = scene_of(model, natural_angles(random), random);
  for (const bool trust : {false, true}) {
    FingerEstimatorConfig config;
    config.trust_labels = trust;
    FingerEstimator estimator(model, paper_glove(), config);
    HandState state;
    for (const double value : {1e3, 1e150, 1e300, std::numeric_limits<double>::infinity()}) {
      Scene bad = good;
      for (std::size_t slot = 3; slot < 13; ++slot) bad.frame.markers[slot].p_W.setConstant(value);
      estimator.step(bad.frame, bad.hand_pose, state);
      ASSERT_TRUE(state.q_rad.allFinite()) << value;
      if (value == 1e300) {  // its square is not finite: nothing to solve
        EXPECT_EQ(state.quality[1], trust ? FingerQuality::kHeld : state.quality[1]);
        EXPECT_TRUE(estimator.problem(Finger::kIndex).markers.empty());
      }
      for (int i = 0; i < 50; ++i) estimator.step(good.frame, good.hand_pose, state);
      for (std::size_t f = 0; f < kFingers; ++f) {
        ASSERT_TRUE(state.q_rad.allFinite());
        ASSERT_LT(state.residual_m[f], 20e-3) << value << " " << kFingerNames[f];
      }
    }
  }
}

TEST(FingerEstimator, LeavesOutWhatTheSensorIsNotSureOf) {
  const HandModel model;
  test::RandomValues random(62);
  FingerEstimatorConfig config;
  config.least_confidence = 0.3;
  FingerEstimator estimator(model, paper_glove(), config);
  HandState state;
  Scene scene = scene_of(model, natural_angles(random), random);
  estimator.step(scene.frame, scene.hand_pose, state);
  const double sure = state.confidence[2];
  scene.frame.markers[7].confidence = scene.frame.markers[8].confidence = 0.001F;  // a guess
  scene.frame.markers[9].confidence = 0.3F;
  estimator.step(scene.frame, scene.hand_pose, state);
  EXPECT_EQ(state.quality[2], FingerQuality::kHeld);
  EXPECT_LT(state.confidence[2], 0.5 * sure);
  EXPECT_EQ(state.visible_markers[3], 2) << "just sure enough";
}

TEST(FingerEstimator, ReportsACappedSolveAndGoesOnFromThereInTheNextFrame) {
  const HandModel model;
  FingerEstimatorConfig config;
  config.max_iterations = 1;
  test::RandomValues random(60);
  const Scene scene = scene_of(model, natural_angles(random), random);
  FingerEstimator estimator(model, paper_glove(), config);
  HandState state;
  estimator.step(scene.frame, scene.hand_pose, state);
  EXPECT_EQ(state.quality[1], FingerQuality::kCapped);
  const double first_m = state.residual_m[1];
  for (int i = 0; i < 50; ++i) estimator.step(scene.frame, scene.hand_pose, state);
  EXPECT_EQ(state.quality[1], FingerQuality::kOptimal);
  EXPECT_LT(state.residual_m[1], first_m);
}

TEST(FingerEstimator, DoesNotTouchTheHeap) {
  if (!test::counts_heap()) GTEST_SKIP() << "sanitizers own the heap";
  const HandModel model;
  const SyntheticMotion motion;
  HandPoseEstimator hand(paper_glove(), paper_calibration());
  for (const bool trust : {false, true}) {
    FingerEstimatorConfig config;
    config.trust_labels = trust;
    FingerEstimator estimator(model, paper_glove(), config);
    HandState state;
    std::size_t solved = 0;
    const std::uint64_t before = test::heap_allocations();
    for (std::size_t k = 300; k < 400; ++k) {  // the hand closes; markers drop out
      const MarkerFrame frame = motion.frame(k).markers;
      estimator.step(frame, hand.step(frame), state);
      for (const FingerQuality quality : state.quality) solved += converged(quality);
    }
    EXPECT_EQ(test::heap_allocations(), before);
    EXPECT_GT(solved, 450u);
  }
}

TEST(FingerEstimator, ConvergesOnARealRecordingWithAResidualOfAFewMillimetres) {
  const GloveLayout glove = paper_glove();
  const auto frames = test::read_recording(EMBODY_SOURCE_DIR "/../shared/data/small_pillow.tsv", glove);
  if (frames.empty()) GTEST_SKIP() << "the real recording ../shared/data/small_pillow.tsv is not here";
  for (const Skeleton skeleton : {Skeleton::kBoneLengths, Skeleton::kWebXr}) {
    const HandData data = builtin_hand(skeleton, Side::kRight);
    const HandModel model(data, Shape::Zero(), default_points(data));
    HandPoseEstimator hand(glove, paper_calibration());
    FingerEstimator fingers(model, glove, FingerEstimatorConfig::published());
    HandState state;
    std::array<double, kFingers> residual_m{};
    std::size_t solved = 0, optimal = 0;
    for (const MarkerFrame& frame : frames) {
      fingers.step(frame, hand.step(frame), state);
      for (std::size_t f = 0; f < kFingers; ++f) {
        residual_m[f] += state.residual_m[f] / static_cast<double>(frames.size());
        if (state.quality[f] == FingerQuality::kHeld) continue;
        ++solved;
        optimal += converged(state.quality[f]);
      }
    }
    EXPECT_GE(static_cast<double>(optimal), 0.995 * static_cast<double>(solved));
    for (std::size_t f = 0; f < kFingers; ++f) EXPECT_LT(residual_m[f], 3e-3) << kFingerNames[f];
  }
}

}  // namespace
}  // namespace embody::hand
