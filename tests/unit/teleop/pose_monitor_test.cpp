#include "core/teleop/pose_monitor.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "tests/unit/math/random_values.hpp"

namespace embody::teleop {
namespace {

using std::chrono::milliseconds;

class Stream {
 public:
  /// The next valid pose, `dt` after the last one, with the hand at `p_W`.
  HandPose step(const Eigen::Vector3d& p_W, Duration dt = milliseconds(10)) {
    t_ += dt;
    HandPose pose;
    pose.t_capture = t_;
    pose.X_WM.translation() = p_W;
    pose.valid = true;
    monitor_.step(pose);
    return pose;
  }
  HandPose step_invalid() {
    t_ += milliseconds(10);
    HandPose pose;
    pose.t_capture = t_;
    monitor_.step(pose);
    return pose;
  }
  HandPose step_pose(const Pose& X_WM) {
    t_ += milliseconds(10);
    HandPose pose;
    pose.t_capture = t_;
    pose.X_WM = X_WM;
    pose.valid = true;
    monitor_.step(pose);
    return pose;
  }
  void restart() { monitor_.restart(); }

 private:
  PoseMonitor monitor_;
  TimePoint t_{std::chrono::seconds(10)};
};

const Eigen::Vector3d kHere{0.0, 0.0, 0.0};
const Eigen::Vector3d kThere{0.5, 0.0, 0.0};
const Eigen::Vector3d kElsewhere{0.0, -50.0, 0.0};
const Eigen::Vector3d kFarAway{50.0, 0.0, 0.0};  // out of reach for a second of hand motion

TEST(PoseMonitor, CountsGoodPosesInARow) {
  Stream stream;
  for (std::uint32_t k = 1; k <= 50; ++k) {
    const HandPose pose = stream.step(kHere);
    ASSERT_TRUE(pose.valid);
    ASSERT_EQ(pose.streak, k);
  }
}

TEST(PoseMonitor, LetsFastHandMotionPass) {
  test::RandomValues random(1);
  Stream stream;
  Pose X = Pose::Identity();
  for (int k = 0; k < 1000; ++k) {  // 3 m/s and 15 rad/s in changing directions
    X.translation() += 0.03 * random.vector<3>(-1.0, 1.0).normalized();
    X.linear() = X.linear() * math::exp_so3(0.15 * random.vector<3>(-1.0, 1.0).normalized());
    ASSERT_TRUE(stream.step_pose(X).valid) << "frame " << k;
  }
}

TEST(PoseMonitor, RefusesASingleJump) {
  for (const bool turned : {false, true}) {
    Stream stream;
    for (int k = 0; k < 10; ++k) stream.step(kHere);
    Pose jumped = Pose::Identity();
    if (turned) {
      jumped.linear() = math::exp_so3({0.0, 0.0, 1.0});
    } else {
      jumped.translation() = kThere;
    }
    const HandPose bad = stream.step_pose(jumped);
    EXPECT_FALSE(bad.valid);
    EXPECT_EQ(bad.streak, 0U);
    const HandPose good = stream.step(kHere);
    EXPECT_TRUE(good.valid);
    EXPECT_EQ(good.streak, 1U) << "whoever waits for a streak waits again";
  }
}

TEST(PoseMonitor, AcceptsALastingChangeOnceFivePosesAgreeOnIt) {
  Stream stream;
  for (int k = 0; k < 10; ++k) stream.step(kHere);
  for (int k = 0; k < 5; ++k) ASSERT_FALSE(stream.step(kThere).valid) << "suspect " << k;
  for (std::uint32_t k = 1; k <= 10; ++k) {
    const HandPose pose = stream.step(kThere);
    ASSERT_TRUE(pose.valid);
    ASSERT_EQ(pose.streak, k);
  }
}

TEST(PoseMonitor, CountsAJumpBeforeItsFirstPoseIsAccepted) {
  Stream stream;
  for (int k = 0; k < 10; ++k) ASSERT_EQ(stream.step(kHere).jumps, 0U);
  ASSERT_EQ(stream.step(kThere).jumps, 0U) << "one outlier is no jump";
  for (int k = 0; k < 10; ++k) ASSERT_EQ(stream.step(kHere).jumps, 0U);
  for (int k = 0; k < 10; ++k) {
    const HandPose pose = stream.step(kThere);
    ASSERT_TRUE(!pose.valid || pose.jumps == 1U) << "whoever follows this pose must know";
  }
  EXPECT_EQ(stream.step(kThere).jumps, 1U);
}

TEST(PoseMonitor, CountsEveryJumpThatLastsHoweverSmallAndNeverTakesItForMotion) {
  for (const int period_ms : {2, 10, 16, 33}) {
    for (double jump_m = 0.02 + 5.0 * period_ms * 1e-3; jump_m < 1.0; jump_m *= 1.3) {
      Stream stream;
      for (int k = 0; k < 10; ++k) (void)stream.step(kHere, milliseconds(period_ms));
      const std::uint32_t before = stream.step(kHere, milliseconds(period_ms)).jumps;
      HandPose pose;
      for (int k = 0; k < 20 && !pose.valid; ++k) pose = stream.step({jump_m, 0.0, 0.0}, milliseconds(period_ms));
      EXPECT_TRUE(pose.valid);
      EXPECT_EQ(pose.jumps, before + 1) << jump_m << " m at " << period_ms << " ms";
    }
  }
}

TEST(PoseMonitor, NeverAcceptsJumpsThatDoNotAgree) {
  Stream stream;
  for (int k = 0; k < 10; ++k) stream.step(kHere);
  for (int k = 0; k < 100; ++k) ASSERT_FALSE(stream.step(k % 2 == 0 ? kFarAway : kElsewhere).valid) << k;
}

TEST(PoseMonitor, AcceptsOnlyThePlaceThatThePosesAgreedOn) {
  Stream stream;
  for (int k = 0; k < 10; ++k) stream.step(kHere);
  for (int k = 0; k < 5; ++k) stream.step(kThere);
  EXPECT_FALSE(stream.step(kElsewhere).valid) << "nobody agreed on this place";
}

TEST(PoseMonitor, StartsTheStreakAnewAfterAnInvalidPoseAndAfterAGap) {
  Stream stream;
  for (int k = 0; k < 10; ++k) stream.step(kHere);
  EXPECT_EQ(stream.step_invalid().streak, 0U);
  EXPECT_EQ(stream.step(kHere).streak, 1U);
  EXPECT_EQ(stream.step(kHere, milliseconds(50)).streak, 2U);
  EXPECT_EQ(stream.step(kHere, milliseconds(51)).streak, 1U);
}

TEST(PoseMonitor, RefusesAPoseThatIsNotFinite) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  Stream stream;
  EXPECT_FALSE(stream.step({nan, 0.0, 0.0}).valid) << "the very first pose";
  EXPECT_TRUE(stream.step(kHere).valid) << "and it leaves nothing behind";
}

TEST(PoseMonitor, RefusesAPoseThatIsNotFiniteLater) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  Stream stream;
  stream.step(kHere);
  for (int k = 0; k < 20; ++k) EXPECT_FALSE(stream.step({nan, 0.0, 0.0}).valid) << k;
  EXPECT_TRUE(stream.step(kHere).valid);
}

TEST(PoseMonitor, AfterARestartFiftyGoodPosesDoNotCountAndAJumpIsNoNews) {
  Stream stream;
  for (int i = 0; i < 10; ++i) ASSERT_TRUE(stream.step(kHere).valid);
  stream.restart();
  int waited = 0;
  for (HandPose pose = stream.step(kElsewhere); !pose.valid; pose = stream.step(kElsewhere)) {
    EXPECT_EQ(pose.streak, 0U);
    EXPECT_EQ(pose.jumps, 0U) << "nothing was known that it could jump from";
    ASSERT_LT(++waited, 100);
    if (waited == 20) stream.step_invalid();  // does not count either
  }
  EXPECT_EQ(waited, 50);
  EXPECT_EQ(stream.step(kElsewhere).streak, 2U) << "and a new streak has begun";
}

}  // namespace
}  // namespace embody::teleop
