#include <gtest/gtest.h>

#include <random>

#include "core/embodiment/arm_target.hpp"
#include "tests/unit/embodiment/mia_config.hpp"

namespace embody {
namespace {

using math::Pose;
using math::Vector6;

TEST(HandBaseTarget, PutsTheMiaPalmWhereThePublishedMethodPutsItInTheFirstFrameOfARealRecording) {
  // Markers on the back of the hand, m: frame 1 of recording.tsv of hand_embodiment (BSD-3-Clause, DFKI).
  const Eigen::Vector3d top(0.110406, 0.135075, 0.460584);
  const Eigen::Vector3d left(0.062382, 0.161390, 0.450921);
  const Eigen::Vector3d right(0.066512, 0.130409, 0.452779);
  const Eigen::Vector3d z = (top - right).normalized();
  const Eigen::Vector3d y = z.cross(left - right).normalized();
  Pose X_WH = Pose::Identity();
  X_WH.linear() << y.cross(z), y, z;
  X_WH.translation() = right;
  // The subject's X_HM of that recording.
  const Vector6 S_HM =
      (Vector6() << 0.1795496537, 1.6513870904, -0.1843735310, -0.0658988406, -0.0238788252, 0.0873064542).finished();
  const Pose X_WM = X_WH * math::exp_se3(S_HM);
  const Pose X_PM = math::exp_se3(test::mia_config().X_PM);
  EXPECT_LE((X_WM.translation() - Eigen::Vector3d(.16380, .15317, .43737)).cwiseAbs().maxCoeff(), 1e-5);
  EXPECT_LE((X_PM.translation() - Eigen::Vector3d(-.00938, .11752, -.03176)).cwiseAbs().maxCoeff(), 1e-5);
  const Pose X_WP = hand_base_target(X_WM, X_PM);
  EXPECT_LE((X_WP.translation() - Eigen::Vector3d(.04368, .16758, .42088)).cwiseAbs().maxCoeff(), 1e-5);
}

TEST(ArmTarget, BringsTheMountedHandsModelBaseOntoTheHumanHandForAnyPoses) {
  constexpr unsigned kSeed = 1;
  RecordProperty("seed", static_cast<int>(kSeed));
  std::mt19937 engine(kSeed);
  std::uniform_real_distribution<double> uniform(-2.0, 2.0);
  const auto random_pose = [&] {
    return math::exp_se3(Vector6::NullaryExpr([&](Eigen::Index) { return uniform(engine); }));
  };
  for (int i = 0; i < 1'000; ++i) {
    const Pose X_BW = random_pose(), X_WM = random_pose(), X_PM = random_pose(), X_EP = random_pose();
    const Pose X_BE = arm_target(X_BW, X_WM, X_PM, X_EP);
    const Pose X_BM = X_BE * X_EP * X_PM;  // where the robot then carries the model base
    ASSERT_LE((X_BM.matrix() - (X_BW * X_WM).matrix()).cwiseAbs().maxCoeff(), 1e-12);
    ASSERT_TRUE(math::is_valid(X_BE));
  }
}

}  // namespace
}  // namespace embody
