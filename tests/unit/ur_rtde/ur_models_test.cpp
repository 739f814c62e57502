#include "drivers/ur_rtde/ur_models.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include <random>

#include "drivers/ur_rtde/installation_check.hpp"

namespace embody::ur {
namespace {

/// Published calibration of one UR10e (documentation of ur_calibration): joints 2 and 3 lie hundreds of metres away.
UrKinematics calibrated_ur10e() {
  UrKinematics k;
  k.theta_rad = {-2.4147806894359e-07, 1.60233952386695,      -1.68607190752171,
                 0.0837331147700119,   -1.01260355871158e-07, 3.91986209186124e-08};
  k.a_m = {2.12234865571206e-05,  0.0193171326277006,    -0.569251663611088,
           -4.61409023720934e-05, -6.39280053471802e-05, 0};
  k.d_m = {0.180539811714259, 439.140974079901,  -446.027059806332,
           7.0603368964236,   0.119811341150314, 0.115670917257426};
  k.alpha_rad = {1.57014608044242, 0.0013941666682559, 0.00693818880325995, 1.56998468543761, -1.57038520649543, 0};
  return k;
}

TEST(UrModels, AreFoundByNameAndAnUnknownOneListsThem) {
  ASSERT_EQ(robot::kUrModels.size(), 7U);
  for (const UrModel& model : robot::kUrModels) EXPECT_EQ(*find_model(model.name), &model);
  EXPECT_EQ((*find_model("ur10E"))->name, "ur10e");
  const auto unknown = find_model("UR99");
  ASSERT_FALSE(unknown);
  EXPECT_NE(unknown.error().detail.view().find("ur16e"), std::string_view::npos);
}

TEST(UrModels, FlangePosesAreThoseOfTheVendorsTable) {
  const UrKinematics ur10e = nominal_kinematics(**find_model("UR10e"));
  const Eigen::Vector3d p = flange_pose(ur10e, math::Vector6::Zero()).translation();
  EXPECT_LT((p - Eigen::Vector3d(-1.18425, -0.2907, 0.06085)).norm(), 1e-9);
}

TEST(UrModels, EveryModelIsRecognisedWithinItsSeriesAndTakenForNoOther) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> noise(-0.0005, 0.0005);
  for (const UrModel& model : robot::kUrModels) {
    for (int i = 0; i < 200; ++i) {
      UrKinematics reported = nominal_kinematics(model);  // with calibration deltas of the usual size
      for (std::size_t k = 0; k < 6; ++k) {
        reported.theta_rad[k] += noise(random);
        reported.a_m[k] += noise(random);
        reported.d_m[k] += noise(random);
        reported.alpha_rad[k] += noise(random);
      }
      ASSERT_EQ(identify_model(reported, model.software_major), &model) << model.name;
    }
  }
}

TEST(UrModels, ARealCalibrationWithFarAwayJointsIsStillAUr10e) {
  const UrKinematics reported = calibrated_ur10e();
  const double distance_m = flange_distance_m(reported, nominal_kinematics(**find_model("UR10e")));
  std::printf("calibrated UR10e: flange up to %.1f mm from the nominal one\n", 1e3 * distance_m);
  EXPECT_EQ(identify_model(reported, 5), *find_model("UR10e"));
  EXPECT_TRUE(check_model(**find_model("UR10e"), reported, 5).ok());
  const Status other = check_model(**find_model("UR5e"), reported, 5);
  ASSERT_FALSE(other);
  EXPECT_NE(other.error().detail.view().find("ur10e"), std::string_view::npos) << other.error().detail.c_str();
}

TEST(UrModels, AnUnknownGeometryIsSaidToBeUnknown) {
  UrKinematics odd = nominal_kinematics(**find_model("UR10e"));
  odd.a_m[1] = -1.0;
  EXPECT_EQ(identify_model(odd, 5), nullptr);
  EXPECT_NE(check_model(**find_model("UR10e"), odd, 5).error().detail.view().find("no known model"),
            std::string_view::npos);
}

TEST(InstallationCheck, ComparesOnlyWhatIsSetAndWithinTolerances) {
  rtde::ArmSettings reported{2.0, {0.0, 0.0, 0.05}, {0.0, 0.0, 0.1, 0.0, 3.14159, 0.0}};
  ExpectedInstallation expected;
  EXPECT_TRUE(check_settings(expected, reported));
  expected = {"", 2.05, std::array{0.0, 0.003, 0.05}, std::array{0.0, 0.0, 0.103, 0.0, -3.14159, 0.0}};
  EXPECT_TRUE(check_settings(expected, reported)) << "half a turn either way is the same orientation";
  reported.payload_kg = std::nan("");
  EXPECT_FALSE(check_settings(expected, reported)) << "a number that is not finite fits nothing";
}

}  // namespace
}  // namespace embody::ur
