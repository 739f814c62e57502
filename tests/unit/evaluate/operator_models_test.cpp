// Gloves, subjects and priors by configuration.
#include "daemon/app/operator_models.hpp"

#include "core/hand/hand_pose_estimator.hpp"
#include "daemon/app/config_io.hpp"
#include "tests/unit/evaluate/synthetic_frames.hpp"
#include "tests/unit/math/random_values.hpp"

namespace embody {
namespace {

using config::EmbodyConfig;
using config::FingerPoint;
using Eigen::Vector3d;
using hand::Vector9;
using test::models_of;

const std::string kFolder = EMBODY_SOURCE_DIR "/config";

EmbodyConfig parsed(const std::string& text) {
  const auto config = config::parse_config("schema = 1\n" + text, "test.toml", kFolder);
  EXPECT_TRUE(config.ok()) << config.error().detail.view();
  return config.ok() ? *config : EmbodyConfig{};
}

std::string message(const std::string& text) {
  const auto config = config::parse_config("schema = 1\n" + text, "test.toml", kFolder);
  if (!config) return std::string(config.error().detail.view());
  const auto models = make_operator_models(*config);
  return models ? "accepted" : std::string(models.error().detail.view());
}

void expect_equal(const hand::FingerEstimatorConfig& a, const hand::FingerEstimatorConfig& b) {
  for (std::size_t f = 0; f < kFingers; ++f) {
    EXPECT_EQ(a.lower_rad[f], b.lower_rad[f]) << kFingerNames[f];
    EXPECT_EQ(a.upper_rad[f], b.upper_rad[f]) << kFingerNames[f];
    EXPECT_EQ(a.weight_plus[f], b.weight_plus[f]) << kFingerNames[f];
    EXPECT_EQ(a.weight_minus[f], b.weight_minus[f]) << kFingerNames[f];
    EXPECT_EQ(a.temporal_m_rad[f], b.temporal_m_rad[f]) << kFingerNames[f];
  }
  EXPECT_EQ(a.coupling_m_rad, b.coupling_m_rad);
  EXPECT_EQ(a.max_iterations, b.max_iterations);
}

TEST(OperatorModels, ByDefaultAreThePaperGloveAndTheEstimatorsDefaults) {
  const OperatorModels models = models_of();
  const hand::GloveLayout paper = hand::paper_glove();
  ASSERT_EQ(models.layout.finger_markers.size(), paper.finger_markers.size());
  for (std::size_t i = 0; i < paper.finger_markers.size(); ++i) {
    EXPECT_EQ(models.layout.finger_markers[i].finger, paper.finger_markers[i].finger);
    EXPECT_EQ(models.layout.finger_markers[i].point, paper.finger_markers[i].point);
    EXPECT_EQ(models.layout.finger_markers[i].slot, paper.finger_markers[i].slot);
  }
  EXPECT_TRUE(models.X_HM.isApprox(hand::paper_calibration(), 1e-12));
  const hand::FingerEstimatorConfig defaults;
  expect_equal(models.fingers, defaults);
  EXPECT_EQ(models.fingers.coupling_ratio, defaults.coupling_ratio);
  EXPECT_EQ(models.fingers.catch_up_rad_s, defaults.catch_up_rad_s);
  EXPECT_EQ(models.fingers.hold, defaults.hold);
  EXPECT_EQ(models.fingers.decay, defaults.decay);
}

TEST(OperatorModels, OfThePublishedRecordMappingAreThePublishedProblem) {
  const OperatorModels models = models_of(parsed("[record_mapping]\nfile = \"record_mapping/published.toml\"\n"));
  expect_equal(models.fingers, hand::FingerEstimatorConfig::published());
  EXPECT_EQ(models.fingers.objective, hand::FingerObjective::kPublished);
}

TEST(OperatorModels, TakeSolverAndPriorFromTheConfiguration) {
  const OperatorModels models = models_of(
      parsed("[record_mapping]\nsolver = \"slsqp\"\ncoupling_ratio = 0.5\nhold_ms = 123\n[record_mapping.ring]\n"
             "upper_rad = [1, 2, 3, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6]\n"));
  EXPECT_EQ(models.fingers.solver, hand::FingerSolver::kSlsqp);
  EXPECT_EQ(models.fingers.coupling_ratio, 0.5);
  EXPECT_EQ(models.fingers.hold, std::chrono::milliseconds(123));
  const auto ring = static_cast<std::size_t>(Finger::kRing);
  EXPECT_EQ(models.fingers.upper_rad[ring](2), 3.0);
  EXPECT_EQ(models.fingers.upper_rad[ring](8), 0.6);
  EXPECT_EQ(models.fingers.lower_rad[ring], hand::FingerEstimatorConfig{}.lower_rad[ring]);
}

/// Three back markers and one on a finger.
std::string one_marker(const std::string& point) {
  return "[glove]\nfile = \"\"\nnames = [\"a\", \"b\", \"c\", \"m\"]\nback = {top = \"a\", left = \"b\", right = "
         "\"c\"}\n"
         "finger_markers = [{marker = \"m\", finger = \"ring\", " +
         point + "}]\n";
}

TEST(GloveByConfiguration, CarriesAMarkerAnywhereOnABone) {
  const OperatorModels models =
      models_of(parsed(one_marker(R"(point = "bone", joint = 2, offset_m = [-0.01, 0.02, 0.003])")));
  ASSERT_EQ(models.layout.finger_markers.size(), 1U);
  const hand::FingerMarker& marker = models.layout.finger_markers[0];
  EXPECT_EQ(marker.slot, 3U);
  const hand::HandModel model = models.hand_model();
  EXPECT_EQ(model.joints_moving(Finger::kRing, marker.point), 2U);
  const Vector3d p_M = model.point(Finger::kRing, marker.point, model.chain(Finger::kRing, Vector9::Zero()));
  EXPECT_TRUE(
      p_M.isApprox(model.rest_joints()[hand::first_joint(Finger::kRing) + 1] + Vector3d(-0.01, 0.02, 0.003), 1e-12));
}

TEST(GloveByConfiguration, CarriesAMarkerAnywhereOnTheSurface) {
  const OperatorModels models = models_of(parsed(one_marker(
      R"(point = "surface", vertices = [0, 1, 2], barycentric = [0.5, 0.25, 0.25], offset_m = [0, 0.007, 0])")));
  const auto& v = models.data.mesh.vertices_M;
  const Vector3d expected = 0.5 * v.col(0) + 0.25 * v.col(1) + 0.25 * v.col(2) + Vector3d(0, 0.007, 0);
  const hand::HandModel model = models.hand_model();
  const std::size_t point = models.layout.finger_markers[0].point;
  const Vector3d p_M = model.point(Finger::kRing, point, model.chain(Finger::kRing, Vector9::Zero()));
  EXPECT_LT((p_M - expected).norm(), 1e-9);
}

TEST(GloveByConfiguration, TakesSixMarkersPerFingerAndNotSeven) {
  for (const int count : {6, 7}) {
    std::string names = R"("a", "b", "c")";
    std::string markers;
    for (int i = 0; i < count; ++i) {
      const std::string name = "\"m" + std::to_string(i) + "\"";
      names += ", " + name;
      markers += "{marker = " + name + ", finger = \"index\", point = \"bone\", joint = " + std::to_string(1 + i % 3) +
                 ", offset_m = [0, 0.01, 0.00" + std::to_string(i) + "]}, ";
    }
    const std::string text = "[glove]\nfile = \"\"\nnames = [" + names +
                             "]\nback = {top = \"a\", left = \"b\", right = \"c\"}\nfinger_markers = [" + markers +
                             "]\n";
    const std::string expected = count == 6 ? "accepted" : "'m6' is one too many: a finger carries at most 6";
    EXPECT_NE(message(text).find(expected), std::string::npos) << message(text);
  }
}

TEST(GloveByConfiguration, SaysWhatIsWrongInOneSentence) {
  EXPECT_NE(message(one_marker(R"(point = "surface", vertices = [0, 1, 99999])")).find("no vertex 99999"),
            std::string::npos);
  EXPECT_NE(message(one_marker(R"(point = "surface", barycentric = [1, 1, 0])")).find("sum is not 1"),
            std::string::npos);
  EXPECT_NE(message(one_marker(R"(point = "bone", joint = 4)")).find("joint is 4, out of range: 1 to 3"),
            std::string::npos);
  EXPECT_NE(message(one_marker(R"(point = "nail")")).find("\"tip\", \"middle\", \"bone\" or \"surface\""),
            std::string::npos);
  EXPECT_NE(
      message("[glove]\nfinger_markers = [{marker = \"index_tip\"}, {marker = \"index_tip\", point = \"bone\"}]\n")
          .find("'index_tip' is there twice"),
      std::string::npos);
  EXPECT_NE(message("[glove]\nfinger_markers = [{marker = \"hand_top\"}]\n").find("on the back of the hand already"),
            std::string::npos);
}

TEST(SubjectByConfiguration, OverridesTheGlovesPlacesButNotWhatTheRobotFollows) {
  const OperatorModels nominal = models_of();
  const OperatorModels models =
      models_of(parsed("[subject]\nmarkers = [{marker = \"index_tip\", joint = 3, offset_m = [-0.02, 0.01, 0.0]}]\n"));
  const hand::HandModel model = models.hand_model();
  const hand::FingerMarker& marker = models.layout.finger_markers[2];
  ASSERT_EQ(models.layout.names[marker.slot].view(), "index_tip");
  const auto chain = model.chain(Finger::kIndex, Vector9::Zero());
  EXPECT_TRUE(
      model.point(Finger::kIndex, marker.point, chain)
          .isApprox(model.rest_joints()[hand::first_joint(Finger::kIndex) + 2] + Vector3d(-0.02, 0.01, 0.0), 1e-12));
  EXPECT_EQ(model.finger_points(Finger::kIndex, Vector9::Zero()),
            nominal.hand_model().finger_points(Finger::kIndex, Vector9::Zero()));
  EXPECT_EQ(models.layout.finger_markers[3].point, nominal.layout.finger_markers[3].point);
}

TEST(SubjectByConfiguration, SaysWhatIsWrongInOneSentence) {
  EXPECT_NE(message("[subject]\nmarkers = [{marker = \"elbow\"}]\n").find("'elbow' is no finger marker"),
            std::string::npos);
  EXPECT_NE(message("[subject]\nmarkers = [{marker = \"index_tip\"}, {marker = \"index_tip\"}]\n").find("there twice"),
            std::string::npos);
  EXPECT_NE(message("[subject]\nshape = [3, 0, 0, 0, 0, 0, 0, 0, 0, 0]\n").find("the built-in hand takes -0.5 to 2"),
            std::string::npos);
  EXPECT_NE(message("[subject]\nback_edges_m = [0.1, 0.01, 0.02]\n").find("sides of a triangle"), std::string::npos);
  EXPECT_NE(message("[subject]\nmodel = \"/nowhere/mano.json\"\n").find("/nowhere/mano.json"), std::string::npos);
}

TEST(LeftHand, SeesInAMirrorWhatTheRightHandSees) {
  const OperatorModels right = models_of();
  const OperatorModels left = models_of(parsed("[subject]\nfile = \"subjects/default_left.toml\"\n"));
  EXPECT_EQ(left.data.side, Side::kLeft);
  hand::HandPoseEstimator right_pose(right.layout, right.X_HM);
  hand::HandPoseEstimator left_pose(left.layout, left.X_HM);
  hand::FingerEstimator right_fingers(right.hand_model(), right.layout, right.fingers);
  hand::FingerEstimator left_fingers(left.hand_model(), left.layout, left.fingers);
  HandState right_state;
  HandState left_state;
  for (const MarkerFrame& frame : test::synthetic_frames(150, 150)) {
    MarkerFrame mirrored = frame;
    for (Marker& marker : mirrored.markers) marker.p_W.x() = -marker.p_W.x();
    right_fingers.step(frame, right_pose.step(frame), right_state);
    left_fingers.step(mirrored, left_pose.step(mirrored), left_state);
    ASSERT_TRUE(left_state.valid);
    auto q_rad = left_state.q_rad;
    hand::mirror_angles(q_rad);
    ASSERT_LT((q_rad - right_state.q_rad).cwiseAbs().maxCoeff(), 1e-4) << "frame " << frame.frame_number;
    Vector3d p_W = left_state.X_WM.translation();
    p_W.x() = -p_W.x();
    ASSERT_LT((p_W - right_state.X_WM.translation()).norm(), 1e-6);
  }
}

}  // namespace
}  // namespace embody
