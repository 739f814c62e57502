// Laws of the conversion: the daemon's path frame by frame, objects, segments, fixed joints, gaps.
#include "daemon/convert/conversion.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <filesystem>

#include "core/embodiment/arm_target.hpp"
#include "daemon/convert/object_frame.hpp"
#include "drivers/recording/tsv_recording.hpp"
#include "tests/unit/convert/synthetic_recording.hpp"
#include "tests/unit/math/random_values.hpp"

namespace embody::convert {
namespace {

using Eigen::Vector3d;
using recording::Recording;
using test::shipped_models;
using test::synthetic_recording;

const std::string kReal = EMBODY_SOURCE_DIR "/../shared/data/small_pillow.tsv";
const std::vector<std::string> kBox{"box_origin", "box_x", "box_y"};

Conversion converted(const Recording& recording, const ConversionOptions& options = {}) {
  Result<Conversion> result = convert(shipped_models(), recording, options);
  EXPECT_TRUE(result.ok()) << result.error().detail.view();
  return result.ok() ? std::move(*result) : Conversion{};
}

Trajectory trajectory_of(const Recording& recording, const ConversionOptions& options = {}) {
  Conversion conversion = converted(recording, options);
  EXPECT_EQ(conversion.trajectories.size(), 1U);
  return conversion.trajectories.empty() ? Trajectory{} : std::move(conversion.trajectories.front());
}

double value(const Trajectory& trajectory, std::size_t row, const std::string& joint) {
  for (std::size_t j = 0; j < trajectory.joints.size(); ++j) {
    if (trajectory.joints[j].name == joint) return trajectory.joints_of(row)[j];
  }
  ADD_FAILURE() << "no joint " << joint;
  return std::nan("");
}

void expect_same(const Trajectory& a, std::size_t row_a, const Trajectory& b, std::size_t row_b, double tolerance) {
  EXPECT_TRUE(pose_of(a.rows[row_a]).isApprox(pose_of(b.rows[row_b]), tolerance)) << "rows " << row_a << ", " << row_b;
  EXPECT_EQ(a.rows[row_a].valid, b.rows[row_b].valid);
  ASSERT_EQ(a.joints.size(), b.joints.size());
  for (std::size_t j = 0; j < a.joints.size(); ++j) {
    EXPECT_NEAR(a.joints_of(row_a)[j], b.joints_of(row_b)[j], tolerance) << a.joints[j].name << " in row " << row_a;
  }
}

TEST(Conversion, IsTheDataPathOfTheDaemonFrameByFrame) {
  const Recording recording = synthetic_recording(150);
  const Trajectory trajectory = trajectory_of(recording);
  ASSERT_EQ(trajectory.rows.size(), 150U);
  const auto frames = evaluate::marker_frames(recording, shipped_models().glove, {});
  ASSERT_TRUE(frames.ok());
  Models models = shipped_models();
  HandState state;
  FingerTarget target;
  for (std::size_t i = 0; i < frames->size(); ++i) {
    const HandPose pose = models.hand_pose.step((*frames)[i]);
    models.fingers.step((*frames)[i], pose, state);
    models.embodiment.step(state, target);
    EXPECT_NEAR(trajectory.rows[i].time_s, static_cast<double>(i) / 100.0, 1e-12);
    const Pose X_WP = hand_base_target(pose.X_WM, models.embodiment.X_PM());
    EXPECT_TRUE(pose_of(trajectory.rows[i]).isApprox(X_WP, 1e-12)) << i;
    EXPECT_EQ(trajectory.rows[i].valid, target.valid) << i;
    const HandJointAngles angles = models.embodiment.urdf_joint_angles(target.q_rad);
    ASSERT_EQ(trajectory.joints.size(), angles.count);
    for (std::size_t j = 0; j < angles.count; ++j) EXPECT_EQ(trajectory.joints_of(i)[j], angles.q_rad[j]) << i;
  }
}

TEST(Conversion, HasAllMovingJointsWithExactCouplingsAlsoBetweenFrames) {
  ConversionOptions options;
  options.rate_hz = 333.0;
  const Trajectory trajectory = trajectory_of(synthetic_recording(700), options);
  ASSERT_EQ(trajectory.joints.size(), shipped_models().embodiment.urdf_joint_names().size());
  double least = 10.0, most = -10.0;
  for (std::size_t i = 0; i < trajectory.rows.size(); ++i) {
    const double mrl_rad = value(trajectory, i, "j_mrl_fle");
    EXPECT_NEAR(value(trajectory, i, "j_ring_fle"), mrl_rad, 1e-12);
    EXPECT_NEAR(value(trajectory, i, "j_little_fle"), mrl_rad, 1e-12);
    least = std::min(least, mrl_rad);
    most = std::max(most, mrl_rad);
  }
  EXPECT_GT(most - least, 0.3) << "the hand grasps";
}

TEST(Conversion, IsTheSameForEveryRunWhateverTheModelsDidBefore) {
  const Recording recording = synthetic_recording(60);
  const Trajectory once = trajectory_of(recording), again = trajectory_of(recording);
  EXPECT_EQ(once.q, again.q);
}

TEST(Conversion, OfAPartCountsFramesAndTimeInTheRecording) {
  ConversionOptions options;
  options.range = {31, 40};
  const Conversion conversion = converted(synthetic_recording(60), options);
  const Trajectory& part = conversion.trajectories.at(0);
  ASSERT_EQ(part.rows.size(), 10U);
  EXPECT_NEAR(part.rows[0].time_s, 0.30, 1e-12);
  EXPECT_EQ(part.first_frame, 31U);
  EXPECT_EQ(part.last_frame, 40U);
  EXPECT_EQ(conversion.frames, 10U);
  EXPECT_EQ(conversion.times.pose_us.size(), 10U);
  EXPECT_EQ(conversion.times.fingers_us.size(), 10U);
  EXPECT_EQ(conversion.times.embodiment_us.size(), 10U);
}

TEST(Conversion, OfSegmentsCutsThemOutOfOnePass) {
  const Recording recording = synthetic_recording(120);
  const Trajectory whole = trajectory_of(recording);
  ConversionOptions options;
  options.segments = {{"reach", 11, 40}, {"grasp", 35, 90}};
  const Conversion conversion = converted(recording, options);
  ASSERT_EQ(conversion.trajectories.size(), 2U);
  EXPECT_EQ(conversion.frames, 90U) << "ends with the last segment";
  for (std::size_t s = 0; s < 2; ++s) {
    const Trajectory& part = conversion.trajectories[s];
    EXPECT_EQ(part.label, options.segments[s].label);
    ASSERT_EQ(part.rows.size(), options.segments[s].last - options.segments[s].first + 1);
    for (std::size_t i = 0; i < part.rows.size(); ++i) {
      expect_same(part, i, whole, options.segments[s].first - 1 + i, 1e-12);
    }
  }
}

TEST(Conversion, RefusesSegmentsAndFramesThatTheRecordingLacks) {
  const Recording recording = synthetic_recording(50);
  ConversionOptions options;
  options.segments = {{"late", 40, 51}};
  EXPECT_FALSE(convert(shipped_models(), recording, options).ok());
  options.segments.clear();
  options.range = {1, 51};
  EXPECT_FALSE(convert(shipped_models(), recording, options).ok());
}

TEST(ObjectFrame, HasItsOriginAxesAndPlaneInTheMarkers) {
  test::RandomValues random(1);
  for (int i = 0; i < 100; ++i) {
    std::array<Marker, 3> markers;
    for (Marker& marker : markers) marker = {random.vector<3>(-1.0, 1.0), true};
    const auto X_WO = object_frame(markers);
    ASSERT_TRUE(X_WO.has_value());
    EXPECT_TRUE(math::is_valid(*X_WO));
    EXPECT_GT(X_WO->linear().determinant(), 0.0);
    EXPECT_LT((*X_WO * Vector3d::Zero() - markers[0].p_W).norm(), 1e-12);
    const Vector3d second_O = X_WO->inverse() * markers[1].p_W, third_O = X_WO->inverse() * markers[2].p_W;
    EXPECT_GT(second_O.x(), 0.0);
    EXPECT_LT(second_O.tail<2>().norm(), 1e-12);
    EXPECT_GT(third_O.y(), 0.0);
    EXPECT_NEAR(third_O.z(), 0.0, 1e-12);
  }
}

TEST(ObjectFrame, IsNoneWhenMarkersAreMissingOrSpanNoPlane) {
  const Marker a{{0.0, 0.0, 0.0}, true}, b{{0.1, 0.0, 0.0}, true}, c{{0.2, 0.0005, 0.0}, true},
      d{{0.0, 0.1, 0.0}, true};
  EXPECT_TRUE(object_frame({a, b, d}).has_value());
  EXPECT_FALSE(object_frame({a, b, c}).has_value()) << "on a line";
  EXPECT_FALSE(object_frame({a, a, d}).has_value()) << "in one place";
  EXPECT_FALSE(object_frame({a, Marker{{0.1, 0.0, 0.0}, false}, d}).has_value()) << "not seen";
  EXPECT_FALSE(object_frame({a, b, Marker{{0.0, std::nan(""), 0.0}, true}}).has_value());
}

TEST(ObjectRelativePoses, DoNotChangeWhenHandAndObjectMoveTogether) {
  ConversionOptions options;
  options.object = kBox;
  const Trajectory still = trajectory_of(synthetic_recording(200), options);
  const auto carried = [](double t) {
    return math::pose_from({0.2 * t, -0.1 * t, 0.3 + 0.1 * t}, {0.1 * t, 0.2 * t, 0.5 - 0.3 * t});
  };
  const Trajectory moved = trajectory_of(synthetic_recording(200, carried), options);
  ASSERT_EQ(moved.rows.size(), still.rows.size());
  for (std::size_t i = 0; i < still.rows.size(); ++i) expect_same(moved, i, still, i, 1e-6);
  EXPECT_EQ(moved.object_markers, kBox);
}

TEST(ObjectRelativePoses, AreThoseInTheWorldSeenFromTheObject) {
  const Recording recording = synthetic_recording(80);
  ConversionOptions options;
  const Trajectory in_world = trajectory_of(recording, options);
  options.object = kBox;
  const Trajectory relative = trajectory_of(recording, options);
  const auto& frame = recording.frames[0];
  const auto X_WO = object_frame({frame[13], frame[14], frame[15]});
  ASSERT_TRUE(X_WO.has_value());
  for (std::size_t i = 0; i < 80; ++i) {
    EXPECT_TRUE((*X_WO * pose_of(relative.rows[i])).isApprox(pose_of(in_world.rows[i]), 1e-9)) << i;
  }
}

TEST(ObjectRelativePoses, KeepTheLastObjectAndAreUnknownBeforeTheFirst) {
  Recording recording = synthetic_recording(30);
  ConversionOptions options;
  options.object = kBox;
  const Trajectory seen = trajectory_of(recording, options);
  for (std::size_t k : {0U, 1U, 2U, 10U, 11U}) recording.frames[k][14] = Marker{};
  const Conversion conversion = converted(recording, options);
  const Trajectory& hidden = conversion.trajectories.at(0);
  EXPECT_EQ(conversion.frames_without_object, 5U);
  for (std::size_t i = 0; i < 30; ++i) {
    if (i >= 3) {
      expect_same(hidden, i, seen, i, 1e-9);
      continue;
    }
    EXPECT_FALSE(hidden.rows[i].valid);
    EXPECT_FALSE(hidden.rows[i].p_m.allFinite());
  }
}

TEST(ObjectRelativePoses, NeedThreeMarkersOfTheRecording) {
  const Recording recording = synthetic_recording(5);
  for (const std::vector<std::string>& names : {std::vector<std::string>{"box_origin", "box_x"},
                                                {"box_origin", "box_x", "box_x"},
                                                {"box_origin", "box_x", "box_z"}}) {
    ConversionOptions options;
    options.object = names;
    const auto result = convert(shipped_models(), recording, options);
    ASSERT_FALSE(result.ok());
    EXPECT_FALSE(result.error().detail.view().empty());
  }
}

TEST(FixedJoints, AreConstantAndChangeNothingElse) {
  const Recording recording = synthetic_recording(120);
  const Trajectory free = trajectory_of(recording);
  ConversionOptions options;
  options.fixed = {{"j_thumb_opp", -0.25}};
  options.rate_hz = 100.0;
  const Trajectory fixed = trajectory_of(recording, options);
  ASSERT_EQ(fixed.rows.size(), free.rows.size());
  for (std::size_t i = 0; i < free.rows.size(); ++i) {
    EXPECT_EQ(fixed.rows[i].p_m, free.rows[i].p_m);
    for (std::size_t j = 0; j < free.joints.size(); ++j) {
      const double expected = free.joints[j].name == "j_thumb_opp" ? -0.25 : free.joints_of(i)[j];
      EXPECT_EQ(fixed.joints_of(i)[j], expected) << free.joints[j].name;
    }
  }
}

TEST(FixedJoints, MustBeJointsOfTheHandWithinTheirLimits) {
  const EmbodimentMapping& mia = shipped_models().embodiment;
  EXPECT_TRUE(check_fixed({{"j_thumb_opp", -0.25}}, mia).ok());
  const Status unknown = check_fixed({{"j_thumb_op", -0.25}}, mia);
  ASSERT_FALSE(unknown.ok());
  EXPECT_NE(unknown.error().detail.view().find("j_thumb_opp"), std::string_view::npos) << "the most similar name";
  for (const double bad : {7.0, -7.0, std::nan("")}) EXPECT_FALSE(check_fixed({{"j_thumb_opp", bad}}, mia).ok()) << bad;
}

TEST(Conversion, RepeatsTheLastHandAndMarksItWhereNoneIsSeen) {
  Recording recording = synthetic_recording(60);
  for (std::size_t k : {0U, 1U, 30U, 31U}) recording.frames[k][0] = Marker{};  // a marker of the back
  const Conversion conversion = converted(recording);
  const Trajectory& trajectory = conversion.trajectories.at(0);
  EXPECT_EQ(conversion.frames_without_hand, 4U);
  for (std::size_t i : {0U, 1U}) {
    EXPECT_FALSE(trajectory.rows[i].valid);
    EXPECT_FALSE(trajectory.rows[i].p_m.allFinite()) << "nothing is known yet";
    EXPECT_TRUE(std::isnan(trajectory.joints_of(i)[0]));
  }
  for (std::size_t i : {30U, 31U}) {
    EXPECT_FALSE(trajectory.rows[i].valid);
    EXPECT_EQ(trajectory.rows[i].p_m, trajectory.rows[29].p_m);
    EXPECT_EQ(trajectory.rows[i].orientation.coeffs(), trajectory.rows[29].orientation.coeffs());
    EXPECT_EQ(trajectory.joints_of(i)[0], trajectory.joints_of(29)[0]);
  }
  EXPECT_TRUE(trajectory.rows[32].valid);
}

TEST(Conversion, TellsItsProgressUpToTheEnd) {
  std::vector<double> parts;
  ConversionOptions options;
  options.progress = [&](double part) { parts.push_back(part); };
  (void)converted(synthetic_recording(300), options);
  ASSERT_GE(parts.size(), 3U);
  EXPECT_TRUE(std::is_sorted(parts.begin(), parts.end()));
  EXPECT_EQ(parts.back(), 1.0);
}

TEST(RealRecording, IsConvertedWholeAlsoRelativeToItsObject) {
  if (!std::filesystem::exists(kReal)) GTEST_SKIP() << kReal << " is not there";
  const auto recording = recording::load_tsv(kReal);
  ASSERT_TRUE(recording.ok()) << recording.error().detail.view();
  ConversionOptions options;
  options.object = {"pillow_left", "pillow_right", "pillow_top"};
  const Conversion conversion = converted(*recording, options);
  const Trajectory& trajectory = conversion.trajectories.at(0);
  ASSERT_EQ(trajectory.rows.size(), 3000U);
  EXPECT_EQ(conversion.frames_without_hand, 0U);
  EXPECT_EQ(conversion.frames_without_object, 0U);
  for (std::size_t i = 0; i < trajectory.rows.size(); ++i) {
    EXPECT_TRUE(trajectory.rows[i].valid);
    EXPECT_LT(trajectory.rows[i].p_m.norm(), 2.0) << "near the pillow";
    EXPECT_NEAR(trajectory.rows[i].orientation.norm(), 1.0, 1e-9);
    if (i > 0) {
      EXPECT_GE(trajectory.rows[i].orientation.dot(trajectory.rows[i - 1].orientation), 0.9);
    }
  }
}

}  // namespace
}  // namespace embody::convert
