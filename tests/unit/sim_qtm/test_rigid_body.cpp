#include "drivers/sim/qtm/rigid_body.hpp"

#include <gtest/gtest.h>

#include <random>

#include "core/hand/hand_pose_estimator.hpp"
#include "core/math/pose.hpp"

namespace embody::sim {
namespace {

const std::vector<Eigen::Vector3d> kShape{{0.0, 0.0, 0.0}, {0.05, 0.01, 0.0}, {0.02, 0.04, 0.01}, {0.0, 0.03, 0.03}};

/// A rigid cloud that is somewhere else in every frame; its first marker is missing in frame 0.
Motion rigid_motion(std::vector<Pose>& X_WS) {
  std::mt19937 random(17);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  const auto vector = [&] { return Eigen::Vector3d(uniform(random), uniform(random), uniform(random)); };
  for (int k = 0; k < 100; ++k) {
    Pose X = Pose::Identity();
    X.linear() = math::exp_so3(2.0 * vector());
    X.translation() = vector();
    X_WS.push_back(X);
  }
  Motion motion;
  motion.rate_hz = 100.0;
  motion.marker_names = {"top", "left", "right", "more", "other"};
  motion.frames = 100;
  motion.generate = [X_WS](std::size_t frame, std::span<Marker> markers) {
    for (std::size_t i = 0; i < kShape.size(); ++i) markers[i] = {X_WS[frame] * kShape[i], frame > 0 || i > 0};
  };
  return motion;
}

TEST(RigidBody, MovesWithItsMarkersWhateverTheirNumber) {
  for (const std::size_t count : {3U, 4U}) {
    std::vector<Pose> X_WS;
    const Motion motion = rigid_motion(X_WS);
    const std::vector<std::string> names(motion.marker_names.begin(), motion.marker_names.begin() + count);
    const auto body = RigidBody::define({"b", names, BodyFrame::kCentre}, motion);
    ASSERT_TRUE(body.ok()) << body.error().detail.c_str();
    ASSERT_EQ(body->parameters().points.size(), count);
    const Pose X_SB = X_WS[1].inverse() * body->pose(motion.frame(1)).X_WB;
    EXPECT_LT((body->pose(motion.frame(1)).X_WB.linear() - Eigen::Matrix3d::Identity()).norm(), 1e-9)
        << "defined in the first frame that is whole";
    for (std::size_t k = 1; k < 100; ++k) {
      const BodyPose pose = body->pose(motion.frame(k));
      ASSERT_TRUE(pose.tracked);
      EXPECT_LT((pose.X_WB.matrix() - (X_WS[k] * X_SB).matrix()).norm(), 1e-9) << "frame " << k;
      EXPECT_NEAR(pose.X_WB.linear().determinant(), 1.0, 1e-9);
      EXPECT_LT(pose.residual_m, 1e-9);
    }
    EXPECT_FALSE(body->pose(motion.frame(0)).tracked);
  }
}

TEST(RigidBody, DefinedByItsMarkersIsTheFrameOfTheHand) {
  std::vector<Pose> X_WS;
  const Motion motion = rigid_motion(X_WS);
  const auto body = RigidBody::define({"hand", {"top", "left", "right"}, BodyFrame::kMarkers}, motion);
  ASSERT_TRUE(body.ok());
  for (std::size_t k = 1; k < 100; ++k) {
    const auto markers = motion.frame(k);
    Pose X_WH;
    ASSERT_TRUE(hand::hand_frame(markers[0].p_W, markers[1].p_W, markers[2].p_W, X_WH));
    EXPECT_LT((body->pose(markers).X_WB.matrix() - X_WH.matrix()).norm(), 1e-9);
  }
}

TEST(RigidBody, SaysHowBadlyTheMarkersFit) {
  std::vector<Pose> X_WS;
  const Motion motion = rigid_motion(X_WS);
  const auto body = RigidBody::define({"b", {"top", "left", "right"}, BodyFrame::kCentre}, motion);
  auto markers = motion.frame(5);
  markers[0].p_W += Eigen::Vector3d(0.01, 0.0, 0.0);
  const double residual_m = body->pose(markers).residual_m;
  EXPECT_GT(residual_m, 1e-4);
  EXPECT_LT(residual_m, 0.01);
}

TEST(RigidBody, RefusesWhatIsNoBodyNamingIt) {
  std::vector<Pose> X_WS;
  Motion motion = rigid_motion(X_WS);
  EXPECT_EQ(RigidBody::define({"two", {"top", "left"}, {}}, motion).error().code, Errc::kInvalidArgument);
  const auto unknown = RigidBody::define({"b", {"top", "left", "nobody"}, {}}, motion);
  EXPECT_NE(unknown.error().detail.view().find("nobody"), std::string_view::npos);
  EXPECT_EQ(RigidBody::define({"b", {"top", "left", "other"}, {}}, motion).error().code, Errc::kNotFound)
      << "a marker that is never seen";
  motion.generate = [](std::size_t, std::span<Marker> markers) {
    for (std::size_t i = 0; i < markers.size(); ++i) markers[i] = {Eigen::Vector3d(static_cast<double>(i), 0, 0), true};
  };
  EXPECT_EQ(RigidBody::define({"b", {"top", "left", "right"}, {}}, motion).error().code, Errc::kNotFound) << "a line";
}

}  // namespace
}  // namespace embody::sim
