// From a calibration to a subject file and back.
#include "daemon/evaluate/calibration_report.hpp"

#include <unistd.h>

#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>

#include "daemon/app/config_io.hpp"
#include "tests/unit/evaluate/synthetic_frames.hpp"
#include "tests/unit/math/random_values.hpp"

namespace embody::evaluate {
namespace {

using test::models_of;

hand::Calibration random_calibration(test::RandomValues& random, const OperatorModels& nominal) {
  hand::Calibration c;
  c.shape = random.vector<10>(-0.2, 0.2);
  c.shape_sd.setConstant(0.01);
  c.shape_prior_only[9] = true;
  c.X_HM = math::pose_from(random.vector<3>(-0.1, 0.1), random.rotation(3.0));
  c.back_edges_m = {0.055, 0.045, 0.032 + random(0.0, 0.001)};
  c.frames_used = 200;
  for (const hand::FingerMarker& marker : nominal.layout.finger_markers) {
    hand::CalibratedMarker& place = c.markers.emplace_back();
    place.slot = marker.slot;
    place.finger = marker.finger;
    place.joint = hand::first_joint(marker.finger) + (marker.point == 0 ? 2 : 0);
    place.offset_m = random.vector<3>(-0.03, 0.03);
  }
  c.advice = {"move the ring finger more"};
  return c;
}

TEST(LogSe3, IsTheInverseOfTheExponential) {
  test::RandomValues random(/*seed=*/5);
  for (int i = 0; i < 1000; ++i) {
    const Pose X = math::pose_from(random.vector<3>(-0.3, 0.3), random.rotation(3.14));
    ASSERT_TRUE(math::exp_se3(log_se3(X)).isApprox(X, 1e-9)) << "pose " << i;
  }
  EXPECT_TRUE(math::exp_se3(log_se3(Pose::Identity())).isApprox(Pose::Identity(), 1e-15));
}

TEST(SubjectFile, ReadsBackBitForBit) {
  test::RandomValues random(/*seed=*/11);
  const OperatorModels nominal = models_of();
  char path[] = "/tmp/embody-subject-XXXXXX";
  ::close(::mkstemp(path));
  for (int i = 0; i < 20; ++i) {
    const hand::Calibration calibration = random_calibration(random, nominal);
    const auto subject = calibrated_subject(calibration, nominal.layout, {});
    std::ofstream(path) << subject_file(subject, calibration, {}, "made up", "2024-02-29 12:00");
    const auto again = config::load_subject(path);
    ASSERT_TRUE(again.ok()) << again.error().detail.view();
    EXPECT_EQ(again->shape, subject.shape);
    EXPECT_EQ(again->X_HM_exponential, subject.X_HM_exponential);
    EXPECT_EQ(again->back_edges_m, subject.back_edges_m);
    ASSERT_EQ(again->markers.size(), 10U);
    for (std::size_t m = 0; m < 10; ++m) {
      EXPECT_EQ(again->markers[m].marker, subject.markers[m].marker);
      EXPECT_EQ(again->markers[m].joint, subject.markers[m].joint);
      EXPECT_EQ(again->markers[m].offset_m, subject.markers[m].offset_m);
    }
  }
  std::remove(path);
}

TEST(SubjectFile, GivesTheEstimatorsTheSameHandAsTheCalibrationItself) {
  test::RandomValues random(/*seed=*/12);
  config::EmbodyConfig config;
  const OperatorModels nominal = models_of(config);
  const hand::Calibration calibration = random_calibration(random, nominal);
  config.subject = calibrated_subject(calibration, nominal.layout, config.subject);
  const OperatorModels from_file = models_of(config);
  const hand::CalibratedGlove direct = hand::apply(calibration, nominal.layout, nominal.points);
  const hand::HandModel expected(nominal.data, calibration.shape, direct.points);
  const hand::HandModel model = from_file.hand_model();
  EXPECT_TRUE(from_file.X_HM.isApprox(calibration.X_HM, 1e-12));
  EXPECT_EQ(from_file.layout.back_edges_m, calibration.back_edges_m);
  const hand::Vector9 q = random.vector<9>(-0.5, 0.5);
  for (std::size_t i = 0; i < direct.glove.finger_markers.size(); ++i) {
    const hand::FingerMarker& a = direct.glove.finger_markers[i];
    const hand::FingerMarker& b = from_file.layout.finger_markers[i];
    ASSERT_EQ(a.finger, b.finger);
    EXPECT_TRUE(model.point(b.finger, b.point, model.chain(b.finger, q))
                    .isApprox(expected.point(a.finger, a.point, expected.chain(a.finger, q)), 1e-12));
  }
}

TEST(NominalConfig, ForgetsTheCalibratedPersonButKeepsHandAndGlove) {
  config::EmbodyConfig config;
  config.subject.skeleton = config::Skeleton::kB;
  config.subject.shape.fill(0.1);
  config.subject.markers = {{"index_tip", 3, {0.01, 0.0, 0.0}}};
  const config::EmbodyConfig nominal = nominal_config(config);
  EXPECT_EQ(nominal.subject.skeleton, config::Skeleton::kB);
  EXPECT_EQ(nominal.subject.shape[3], 0.0);
  EXPECT_TRUE(nominal.subject.markers.empty());
  EXPECT_EQ(nominal.glove.finger_markers.size(), config.glove.finger_markers.size());
}

TEST(CalibrationReport, SaysWhatIsOnlyAssumedAndGivesAdvice) {
  test::RandomValues random(/*seed=*/13);
  const OperatorModels nominal = models_of();
  const hand::Calibration calibration = random_calibration(random, nominal);
  ResidualChange residuals;
  residuals.before_mm[1] = 5.0;
  residuals.after_mm[1] = 1.25;
  const std::string text = calibration_text(calibration, nominal, residuals);
  const std::size_t line = text.find("last phalanges");
  ASSERT_NE(line, std::string::npos) << text;
  EXPECT_NE(text.substr(line, text.find('\n', line) - line).find("only assumed"), std::string::npos) << text;
  EXPECT_NE(text.find("advice: move the ring finger more"), std::string::npos) << text;
  EXPECT_NE(text.find("1.25"), std::string::npos) << text;
  EXPECT_EQ(text.find("warning"), std::string::npos) << text;
  residuals.after_mm[1] = 6.0;
  EXPECT_NE(calibration_text(calibration, nominal, residuals).find("warning: the index finger fits worse"),
            std::string::npos);
  residuals.after_mm[1] = 1.25;
  const auto subject = calibrated_subject(calibration, nominal.layout, {});
  const auto object = nlohmann::json::parse(calibration_json(calibration, nominal, subject, residuals));
  EXPECT_EQ(object["markers"].size(), 10U);
  EXPECT_EQ(object["residual_after_mm"]["index"], 1.25);
  EXPECT_TRUE(object["residual_after_mm"]["ring"].is_null());
  EXPECT_EQ(object["shape_prior_only"][9], true);
}

}  // namespace
}  // namespace embody::evaluate
