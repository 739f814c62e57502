#include "core/hand/calibration.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>

#include "core/hand/calibration_problem.hpp"
#include "tests/unit/hand/free_motion.hpp"
#include "tests/unit/hand/real_recording.hpp"

namespace embody::hand {
namespace {

using Eigen::Vector3d;

HandData right_hand() {
  return builtin_hand(Skeleton::kBoneLengths, Side::kRight);
}

test::FreeMotion motion_of(const test::FreeMotionConfig& config, std::uint64_t seed) {
  const HandData data = right_hand();
  std::printf("free motion of seed %lu\n", static_cast<unsigned long>(seed));
  return test::free_motion(data, paper_glove(), default_points(data), paper_calibration(), {}, config, seed);
}

Result<Calibration> calibrate_on(const std::vector<MarkerFrame>& frames, const CalibrationOptions& options = {}) {
  const HandData data = right_hand();
  return calibrate(frames, paper_glove(), data, default_points(data), paper_calibration(), options);
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

TEST(Calibration, FindsLengthsDistancesAndItsOwnUncertaintyDespiteNoiseDropOutsAndSwaps) {
  const HandData data = right_hand();
  // A guard with few trials, hence with a margin; the figures themselves are those of calibration_bench.
  test::CalibrationErrors errors;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const test::FreeMotion truth = motion_of({}, seed);
    const auto found = calibrate_on(truth.frames);
    ASSERT_TRUE(found.ok()) << found.error().detail.view();
    errors.add(data, truth, *found, CalibrationPrior{});
  }
  EXPECT_LE(median(errors.length), 0.03);
  EXPECT_LE(median(errors.distance_m), 0.002);
  EXPECT_GE(static_cast<double>(errors.inside), 0.9 * static_cast<double>(errors.known));
  EXPECT_GT(errors.known, errors.prior_only);
}

TEST(Calibration, ASwapOrGhostInManyFramesMovesTheResultLessThanItsUncertainty) {
  test::FreeMotionConfig clean;
  clean.dropped = clean.swapped = 0.0;
  const test::FreeMotion truth = motion_of(clean, 7);
  std::vector<MarkerFrame> spoilt = truth.frames;
  test::RandomValues random(8);
  for (std::size_t k = 0; k < spoilt.size(); k += 25) {
    std::swap(spoilt[k].markers[5], spoilt[k].markers[11]);                             // index tip and little tip
    spoilt[k].markers[4].p_W += random(0.05, 0.3) * random.rotation(1.0).normalized();  // thumb middle: a ghost
  }
  const auto a = calibrate_on(truth.frames), b = calibrate_on(spoilt);
  ASSERT_TRUE(a.ok() && b.ok());
  for (std::size_t m = 0; m < a->markers.size(); ++m) {
    const Vector3d moved = (a->markers[m].offset_m - b->markers[m].offset_m).cwiseAbs();
    EXPECT_TRUE((moved.array() <= a->markers[m].sd_m.array()).all()) << "marker " << m << ": " << moved.transpose();
  }
}

TEST(Calibration, NamesWhatStillFingersLeaveToThePriorAndSaysWhatToMove) {
  test::FreeMotionConfig still;
  still.vigour = 0.0;
  const auto found = calibrate_on(motion_of(still, 3).frames);
  const auto moving = calibrate_on(motion_of({}, 3).frames);
  ASSERT_TRUE(found.ok() && moving.ok());
  const auto prior_only = [](const Calibration& c) {
    return std::count(c.shape_prior_only.begin(), c.shape_prior_only.end(), true);
  };
  EXPECT_GT(prior_only(*found), prior_only(*moving));
  EXPECT_TRUE(moving->shape_prior_only[static_cast<std::size_t>(HandShape::kDistalLength)]);  // moves no joint
  const auto says = [](const Calibration& c, const char* words) {
    return std::any_of(c.advice.begin(), c.advice.end(),
                       [words](const std::string& s) { return s.find(words) != std::string::npos; });
  };
  for (const char* words : {"move the index finger more", "move the ring finger more", "spread the fingers",
                            "draw circles with the thumb"}) {
    EXPECT_TRUE(says(*found, words)) << words;
    EXPECT_FALSE(says(*moving, words)) << words;
  }
  for (std::size_t f = 0; f < kFingers; ++f) EXPECT_LT(found->motion_rad[f], moving->motion_rad[f]);
}

TEST(Calibration, EndsWhereTheObjectiveIsStationaryInEveryVariableOfTheHand) {
  const HandData data = right_hand();
  const HandPoints points = default_points(data);
  const test::FreeMotion truth = motion_of({}, 5);
  auto frames = gather_frames(truth.frames, paper_glove());
  ASSERT_TRUE(frames.ok());
  frames->frames = thin_out(frames->frames, 40);
  CalibrationOptions options;
  options.max_iterations = 400;
  CalibrationProblem problem(data, paper_glove(), points, paper_calibration(), options.prior, *frames);
  CalibrationVariables at = problem.nominal();
  const double start = problem.cost(at);
  solve(problem, at, options);
  EXPECT_LT(problem.cost(at), start);
  CalibrationVariables next;
  for (int i = 0; i < 60; ++i) {  // the very end: noise and spreads stand still now
    if (!problem.step(at, 0.1, next)) break;
    problem.settle_angles(next);
    if (problem.cost(next) < problem.cost(at)) at = next;
  }
  const Eigen::VectorXd sd = problem.certainty(at).sd;
  const auto slope = [&](auto&& move, Eigen::Index i) {  // of the cost, per standard deviation
    const double h = 1e-3 * sd(i);
    CalibrationVariables ahead = at, behind = at;
    move(ahead, h);
    move(behind, -h);
    return (problem.cost(ahead) - problem.cost(behind)) / 2e-3;
  };
  constexpr double kFlat = 0.5;
  for (Eigen::Index i = 0; i < 10; ++i) {
    EXPECT_LT(std::abs(slope([i](CalibrationVariables& v, double h) { v.shape(i) += h; }, i)), kFlat) << "shape " << i;
  }
  for (Eigen::Index i = 0; i < 6; ++i) {
    const auto move = [i](CalibrationVariables& v, double h) { v.X_HM = v.X_HM * math::exp_se3(h * Vector6::Unit(i)); };
    EXPECT_LT(std::abs(slope(move, CalibrationProblem::kPoseBegin + i)), kFlat) << "X_HM " << i;
  }
  for (Eigen::Index i = 0; i < 30; ++i) {
    const auto move = [i](CalibrationVariables& v, double h) {
      v.offset_m[static_cast<std::size_t>(i / 3)](i % 3) += h;
    };
    EXPECT_LT(std::abs(slope(move, CalibrationProblem::kPlacesBegin + i)), kFlat) << "place " << i;
  }
}

TEST(Calibration, OfALeftHandIsTheMirrorImage) {
  const HandData right = right_hand(), left = mirrored(right);
  const HandPoints points = default_points(right), left_points = default_points(left);
  const test::FreeMotion truth = motion_of({}, 6);
  std::vector<MarkerFrame> frames = truth.frames;
  for (MarkerFrame& frame : frames) {
    for (Marker& marker : frame.markers) marker.p_W.x() *= -1.0;
  }
  // Mirrored markers span the frame H with y on the other side.
  Pose X_HM = paper_calibration();
  X_HM.matrix().row(1) *= -1.0;
  X_HM.matrix().col(0) *= -1.0;
  CalibrationOptions options;
  options.max_frames = 30;
  options.max_iterations = 30;
  const auto a = calibrate(truth.frames, paper_glove(), right, points, paper_calibration(), options);
  const auto b = calibrate(frames, paper_glove(), left, left_points, X_HM, options);
  ASSERT_TRUE(a.ok() && b.ok());
  EXPECT_LT((a->shape - b->shape).norm(), 1e-4);
  for (std::size_t m = 0; m < a->markers.size(); ++m) {
    const Vector3d mirror = a->markers[m].offset_m.cwiseProduct(Vector3d(-1.0, 1.0, 1.0));
    EXPECT_LT((mirror - b->markers[m].offset_m).norm(), 1e-4) << "marker " << m;
  }
}

TEST(Calibration, OnARealRecordingFindsAPlausibleHand) {
  auto frames = test::read_recording(EMBODY_SOURCE_DIR "/../shared/data/small_pillow.tsv", paper_glove());
  if (frames.size() < 1000) GTEST_SKIP() << "the real recording ../shared/data/small_pillow.tsv is not here";
  frames.resize(1000);
  const auto found = calibrate_on(frames);
  ASSERT_TRUE(found.ok()) << found.error().detail.view();
  EXPECT_LT(found->shape.cwiseAbs().maxCoeff(), 0.2);
  EXPECT_NEAR(found->back_edges_m[0], 0.0552, 0.001);
  EXPECT_NEAR(found->back_edges_m[1], 0.0447, 0.001);
  EXPECT_NEAR(found->back_edges_m[2], 0.0324, 0.001);
  for (const CalibratedMarker& marker : found->markers) {
    EXPECT_LT(marker.residual_m, 0.003) << "slot " << marker.slot;
    EXPECT_LT(marker.offset_m.norm(), 0.06) << "slot " << marker.slot;
  }
  EXPECT_FALSE(found->advice.empty());  // a grasp is no free finger motion
}

TEST(Calibration, AppliedGivesEachMarkerAPointOfItsOwnAndLeavesTheFirstTwo) {
  const HandData data = right_hand();
  const HandPoints points = default_points(data);
  Calibration calibration;
  calibration.back_edges_m = {0.05, 0.04, 0.03};
  calibration.markers.push_back({5, Finger::kIndex, 3, Vector3d(-.01, .02, .003), Vector3d::Zero(), 0.0, false});
  calibration.markers.push_back({6, Finger::kThumb, 14, Vector3d::Ones(), Vector3d::Zero(), 0.0, false});  // not worn
  const CalibratedGlove applied = apply(calibration, paper_glove(), points);
  EXPECT_EQ(applied.glove.back_edges_m, calibration.back_edges_m);
  ASSERT_TRUE(check_points(data, applied.points).ok());
  for (const FingerMarker& marker : applied.glove.finger_markers) {
    const bool known = marker.slot == 5;
    EXPECT_EQ(marker.point, known ? 2U : (marker.slot - 3) % 2) << "slot " << marker.slot;
  }
  ASSERT_EQ(applied.points[1].size(), 3U);
  EXPECT_EQ(applied.points[1][2].joint, 3U);
  EXPECT_EQ(applied.points[1][2].offset_m, calibration.markers[0].offset_m);
  for (std::size_t f = 0; f < kFingers; ++f) {
    for (std::size_t i = 0; i < 2; ++i) EXPECT_EQ(applied.points[f][i].offset_m, points[f][i].offset_m);
  }
}

TEST(Calibration, AppliedReplacesThePointsOfItsOwnThatAGloveHas) {
  HandPoints points = default_points(right_hand());
  GloveLayout glove = paper_glove();
  glove.finger_markers.clear();
  Calibration calibration;
  for (std::size_t i = 0; i < kMaxFingerPoints - 2; ++i) {  // as many as a finger can carry
    HandPoint point;
    point.joint = 1;
    points[1].push_back(point);
    glove.finger_markers.push_back({Finger::kIndex, 2 + i, 3 + i});
    calibration.markers.push_back(
        {3 + i, Finger::kIndex, 3, Vector3d::Constant(.001 * static_cast<double>(i)), Vector3d::Zero(), 0.0, false});
  }
  const CalibratedGlove applied = apply(calibration, glove, points);
  ASSERT_EQ(applied.points[1].size(), kMaxFingerPoints);
  for (std::size_t i = 0; i < kMaxFingerPoints - 2; ++i) {
    EXPECT_EQ(applied.glove.finger_markers[i].point, 2 + i);
    EXPECT_EQ(applied.points[1][2 + i].joint, 3U);
    EXPECT_EQ(applied.points[1][2 + i].offset_m, calibration.markers[i].offset_m);
  }
}

TEST(Calibration, RefusesWhatItCannotUseInOneSentence) {
  const HandData data = right_hand();
  const HandPoints points = default_points(data);
  const auto refusal = [&](const std::vector<MarkerFrame>& frames, const GloveLayout& glove, const Pose& X_HM,
                           const CalibrationOptions& options) {
    const auto found = calibrate(frames, glove, data, points, X_HM, options);
    EXPECT_FALSE(found.ok());
    return found.ok() ? std::string() : std::string(found.error().detail.view());
  };
  const test::FreeMotion motion = motion_of({}, 9);
  const auto contains = [](const std::string& text, const char* words) {
    return text.find(words) != std::string::npos;
  };
  EXPECT_TRUE(contains(refusal({}, paper_glove(), paper_calibration(), {}), "only 0 of 0 frames"));
  std::vector<MarkerFrame> blind = motion.frames;
  for (MarkerFrame& frame : blind) frame.markers[1].visible = false;
  EXPECT_TRUE(contains(refusal(blind, paper_glove(), paper_calibration(), {}), "back of the hand"));
  std::vector<MarkerFrame> bare = motion.frames;
  for (MarkerFrame& frame : bare) frame.count = 3;
  EXPECT_TRUE(contains(refusal(bare, paper_glove(), paper_calibration(), {}), "show no finger marker"));
  GloveLayout fingerless = paper_glove();
  fingerless.finger_markers.clear();
  EXPECT_TRUE(contains(refusal(motion.frames, fingerless, paper_calibration(), {}), "no finger markers"));
  GloveLayout unknown = paper_glove();
  unknown.finger_markers[0].point = 7;
  EXPECT_TRUE(contains(refusal(motion.frames, unknown, paper_calibration(), {}), "does not exist"));
  CalibrationOptions certain;
  certain.prior.marker_sd_m = 0.0;
  EXPECT_TRUE(contains(refusal(motion.frames, paper_glove(), paper_calibration(), certain), "must be positive"));
  Pose skewed = paper_calibration();
  skewed.linear() *= 2.0;
  EXPECT_TRUE(contains(refusal(motion.frames, paper_glove(), skewed, {}), "X_HM"));
}

TEST(Calibration, SurvivesNonsenseInTheFrames) {
  std::vector<MarkerFrame> frames = motion_of({}, 10).frames;
  test::RandomValues random(11);
  for (MarkerFrame& frame : frames) {
    Marker& marker = frame.markers[static_cast<std::size_t>(random(0.0, 13.0))];
    const double dice = random(0.0, 4.0);
    if (dice < 1.0) marker.p_W.x() = std::numeric_limits<double>::quiet_NaN();
    if (dice > 3.0) marker.p_W *= 1e300;
    if (dice > 3.9) frame.count = 10'000;
  }
  CalibrationOptions brief;
  brief.max_frames = 0;
  brief.max_iterations = 10;
  const auto found = calibrate_on(frames, brief);
  ASSERT_TRUE(found.ok()) << found.error().detail.view();
  EXPECT_TRUE(found->shape.allFinite() && found->shape_sd.allFinite() && math::is_valid(found->X_HM));
  for (const CalibratedMarker& marker : found->markers) {
    EXPECT_TRUE(marker.offset_m.allFinite() && marker.sd_m.allFinite());
  }
}

}  // namespace
}  // namespace embody::hand
