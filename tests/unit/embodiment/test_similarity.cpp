#include "core/embodiment/similarity.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/math/triangle_distance.hpp"
#include "tests/support/heap_counter.hpp"
#include "tests/unit/math/random_values.hpp"

namespace embody {
namespace {

using Eigen::Index;
using Eigen::Vector3d;
using hand::HandData;
using hand::Vector48;

constexpr std::size_t kSamples = 100;

robot::RobotModel five_links() {
  robot::RobotModel model;
  model.links.push_back({"palm"});
  for (std::size_t f = 0; f < kFingers; ++f) {
    robot::Joint joint;
    joint.name = kFingerNames[f];
    joint.type = robot::JointType::kRevolute;
    joint.child_link = f + 1;
    joint.X_PC.translation() = Vector3d(0.1 * static_cast<double>(f), 0.0, 0.0);
    model.links.push_back({kFingerNames[f], f});
    model.joints.push_back(joint);
  }
  return model;
}

HandData human_hand() {
  return hand::builtin_hand(hand::Skeleton::kBoneLengths, Side::kRight);
}

/// Angles of a hand that may be closed, spread and turned.
Vector48 any_posture(test::RandomValues& random) {
  Vector48 q = random.vector<48>(-0.15, 0.15);
  for (Index k = 1; k < 16; ++k) q(3 * k + 2) = random(0.0, 1.2);
  return q;
}

Pose any_pose(test::RandomValues& random) {
  return math::pose_from(random.vector<3>(-0.3, 0.3), random.rotation(3.0));
}

std::vector<Pose> poses_of_links(test::RandomValues& random) {
  std::vector<Pose> X_PL(1, Pose::Identity());
  for (std::size_t f = 0; f < kFingers; ++f) X_PL.push_back(any_pose(random));
  return X_PL;
}

/// Three points of the contact triangles of one finger.
std::vector<Eigen::Matrix3d> contact_triangles(const HandData& data, const hand::HandSkin& skin, std::size_t finger) {
  const std::vector<int>& patch = data.mesh.contact_vertices[finger];
  std::vector<Eigen::Matrix3d> corners;
  for (Index t = 0; t < data.mesh.triangles.cols(); ++t) {
    const Eigen::Vector3i ids = data.mesh.triangles.col(t);
    const auto in_patch = [&](int v) { return std::find(patch.begin(), patch.end(), v) != patch.end(); };
    if (!in_patch(ids(0)) || !in_patch(ids(1)) || !in_patch(ids(2))) continue;
    corners.emplace_back();
    corners.back() << skin.vertices().col(ids(0)), skin.vertices().col(ids(1)), skin.vertices().col(ids(2));
  }
  return corners;
}

/// A small rectangle in each contact triangle, facing where the triangle faces, in the frame of the finger's link.
std::vector<ContactPad> pads_on_skin(const HandData& data, const hand::HandSkin& skin, std::size_t finger,
                                     const Pose& X_LM) {
  std::vector<ContactPad> pads;
  for (const Eigen::Matrix3d& corners : contact_triangles(data, skin, finger)) {
    const Vector3d side = corners.col(1) - corners.col(0);
    const Vector3d normal = side.cross(corners.col(2) - corners.col(0)).normalized();
    const Vector3d centre = corners.rowwise().mean();
    double half = 1.0;  // of the side of a square about the centroid that stays inside
    for (Index k = 0; k < 3; ++k) {
      const Vector3d edge = math::nearest_on_segment(centre, corners.col(k), corners.col((k + 1) % 3));
      half = std::min(half, 0.5 * (edge - centre).norm());
    }
    ContactPad pad;
    pad.link = kFingerNames[finger];
    pad.from_m = X_LM * (centre - half * side.normalized());
    pad.to_m = X_LM * (centre + half * side.normalized());
    pad.facing = X_LM.linear() * normal;
    pad.width_m = 2.0 * half;
    pads.push_back(pad);
  }
  return pads;
}

/// A robot whose pads are the human hand's contact surfaces in one posture.
struct Twin {
  explicit Twin(std::uint64_t seed) : random(seed), q_rad(any_posture(random)), X_PM(any_pose(random)) {
    skin.step(q_rad);
    X_PL = poses_of_links(random);
    for (std::size_t f = 0; f < kFingers; ++f) {
      config.fingers[f].pads = pads_on_skin(data, skin, f, X_PL[f + 1].inverse() * X_PM);
    }
  }
  Similarity similarity() const {
    auto result = Similarity::create(data, hand::Shape::Zero(), model, config, kSamples);
    EXPECT_TRUE(result.ok()) << result.error().detail.c_str();
    return std::move(*result);
  }

  test::RandomValues random;
  HandData data = human_hand();
  robot::RobotModel model = five_links();
  hand::HandSkin skin{data, hand::Shape::Zero()};
  Vector48 q_rad;
  Pose X_PM;
  std::vector<Pose> X_PL;
  EmbodimentConfig config;
};

/// A robot of round and flat pads of a finger's size somewhere about the hand.
EmbodimentConfig ordinary_pads(test::RandomValues& random) {
  EmbodimentConfig config;
  for (std::size_t f = 0; f < kFingers; ++f) {
    for (int k = 0; k < 2; ++k) {
      ContactPad pad;
      pad.link = kFingerNames[f];
      pad.from_m = random.vector<3>(-0.02, 0.02);
      pad.to_m = pad.from_m + Vector3d(0.02, 0.0, 0.0);
      pad.facing = {0.0, 1.0, 0.0};
      pad.radius_m = 0.007;
      pad.width_m = k == 0 ? 0.0 : 0.01;
      config.fingers[f].pads.push_back(pad);
    }
  }
  return config;
}

TEST(Similarity, IsZeroForARobotWhosePadsAreTheHumanSurface) {
  for (const std::uint64_t seed : {91U, 92U, 93U}) {
    const Twin twin(seed);
    Similarity similarity = twin.similarity();
    const auto distances = similarity.distances(twin.q_rad, twin.X_PM, twin.X_PL);
    for (std::size_t f = 0; f < kFingers; ++f) {
      ASSERT_TRUE(distances[f].has_value()) << kFingerNames[f];
      EXPECT_GE(*distances[f], 0.0);
      EXPECT_LT(*distances[f], 1e-9) << kFingerNames[f];
    }
  }
}

TEST(Similarity, GrowsByTheDistanceThatTheRobotIsMovedOffTheSurface) {
  Twin twin(94);
  Similarity similarity = twin.similarity();
  for (const double shift_m : {0.001, 0.005, 0.02}) {
    for (std::size_t f = 0; f < kFingers; ++f) {
      const std::span<const Similarity::Sample> samples = similarity.samples(static_cast<Finger>(f));
      Vector3d off_L = Vector3d::Zero();
      for (const Similarity::Sample& sample : samples) off_L += sample.normal_L;
      const double flatness = off_L.norm() / static_cast<double>(samples.size());
      std::vector<Pose> moved = twin.X_PL;
      moved[f + 1] = moved[f + 1] * Eigen::Translation3d(shift_m * off_L.normalized());
      const double distance_m = similarity.distances(twin.q_rad, twin.X_PM, moved)[f].value();
      EXPECT_LE(distance_m, shift_m + 1e-9) << "no sample moves farther";
      EXPECT_GE(distance_m, 0.5 * flatness * shift_m) << kFingerNames[f] << ", mean normal " << flatness;
      EXPECT_GT(distance_m, 0.0);
    }
  }
}

TEST(Similarity, OfAFlatPadAboveAFlatPatchIsItsHeight) {
  HandData data = human_hand();
  data.mesh = {};
  data.mesh.vertices_M.resize(3, 4);
  data.mesh.vertices_M << -0.1, 0.1, 0.1, -0.1, /**/ 0.0, 0.0, 0.0, 0.0, /**/ -0.1, -0.1, 0.1, 0.1;
  data.mesh.shape_directions = Eigen::MatrixXd::Zero(12, 10);
  data.mesh.weights = Eigen::MatrixXd::Zero(4, 16);
  data.mesh.weights.col(0).setOnes();
  data.mesh.triangles.resize(3, 2);
  data.mesh.triangles << 0, 0, /**/ 1, 2, /**/ 2, 3;
  data.mesh.contact_vertices[1] = {0, 1, 2, 3};
  EmbodimentConfig config;
  config.fingers[1].pads = {{"index", {0.0, 0.0, 0.0}, {0.02, 0.0, 0.0}, 0.0, {0.0, 1.0, 0.0}, 0.01}};
  auto similarity = Similarity::create(data, hand::Shape::Zero(), five_links(), config);
  ASSERT_TRUE(similarity.ok()) << similarity.error().detail.c_str();
  for (const double height_m : {-0.03, 0.0, 0.001, 0.07}) {
    std::vector<Pose> X_PL(6, Pose::Identity());
    X_PL[2].translation().y() = height_m;
    const auto distances = similarity->distances(Vector48::Zero(), Pose::Identity(), X_PL);
    EXPECT_NEAR(distances[1].value(), std::abs(height_m), 1e-15);
    for (const std::size_t f : {0U, 2U, 3U, 4U}) EXPECT_FALSE(distances[f].has_value());
  }
}

TEST(Similarity, EqualsTheMeanOfTheLeastDistancesOverAllTriangles) {
  test::RandomValues random(95);
  const HandData data = human_hand();
  auto similarity = Similarity::create(data, hand::Shape::Zero(), five_links(), ordinary_pads(random));
  ASSERT_TRUE(similarity.ok());
  hand::HandSkin skin(data, hand::Shape::Zero());
  for (int trial = 0; trial < 20; ++trial) {
    const Vector48 q = any_posture(random);
    const Pose X_PM = any_pose(random);
    std::vector<Pose> X_PL(6, X_PM);
    for (Pose& X : X_PL) X.translation() += X_PM.linear() * random.vector<3>(-0.2, 0.05);
    const auto distances = similarity->distances(q, X_PM, X_PL);
    skin.step(q);
    for (std::size_t f = 0; f < kFingers; ++f) {
      const auto triangles = contact_triangles(data, skin, f);
      const auto samples = similarity->samples(static_cast<Finger>(f));
      ASSERT_EQ(triangles.size(), similarity->triangle_count(static_cast<Finger>(f)));
      double sum = 0.0;
      for (const Similarity::Sample& sample : samples) {
        const Vector3d p_M = X_PM.inverse() * X_PL[sample.link] * sample.p_L;
        double least = std::numeric_limits<double>::infinity();
        for (const Eigen::Matrix3d& t : triangles) {
          least = std::min(least, math::distance_to_triangle(p_M, t.col(0), t.col(1), t.col(2)));
        }
        sum += least;
      }
      ASSERT_NEAR(distances[f].value(), sum / static_cast<double>(kSamples), 1e-12) << kFingerNames[f];
    }
  }
}

TEST(Similarity, DoesNotChangeWhenBothHandsMoveTogether) {
  test::RandomValues random(96);
  auto similarity = Similarity::create(human_hand(), hand::Shape::Zero(), five_links(), ordinary_pads(random));
  ASSERT_TRUE(similarity.ok());
  for (int trial = 0; trial < 20; ++trial) {
    const Vector48 q = any_posture(random);
    const Pose X_PM = any_pose(random), X = any_pose(random);
    const std::vector<Pose> X_PL = poses_of_links(random);
    std::vector<Pose> moved;
    for (const Pose& link : X_PL) moved.push_back(X * link);
    const auto before = similarity->distances(q, X_PM, X_PL);
    const auto after = similarity->distances(q, X * X_PM, moved);
    for (std::size_t f = 0; f < kFingers; ++f) ASSERT_NEAR(before[f].value(), after[f].value(), 1e-12);
  }
}

TEST(Similarity, KnowsOnlyTheFingersThatHavePads) {
  test::RandomValues random(97);
  EmbodimentConfig config = ordinary_pads(random);
  config.fingers[2].pads.clear();
  config.fingers[4].pads.clear();
  auto similarity = Similarity::create(human_hand(), hand::Shape::Zero(), five_links(), config);
  ASSERT_TRUE(similarity.ok());
  const auto distances = similarity->distances(Vector48::Zero(), Pose::Identity(), poses_of_links(random));
  for (std::size_t f = 0; f < kFingers; ++f) {
    const bool has_pads = f != 2 && f != 4;
    EXPECT_EQ(distances[f].has_value(), has_pads);
    EXPECT_EQ(similarity->samples(static_cast<Finger>(f)).size(), has_pads ? kSamples : 0U);
  }
}

TEST(Similarity, IsNothingWhereAnArgumentIsNotFiniteOrALinkIsMissing) {
  test::RandomValues random(98);
  auto similarity = Similarity::create(human_hand(), hand::Shape::Zero(), five_links(), ordinary_pads(random));
  ASSERT_TRUE(similarity.ok());
  const std::vector<Pose> X_PL = poses_of_links(random);
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  Vector48 q = Vector48::Zero();
  q(7) = kNaN;
  Pose X_PM = Pose::Identity();
  X_PM.translation().z() = kNaN;
  for (const auto& distances :
       {similarity->distances(q, Pose::Identity(), X_PL), similarity->distances(Vector48::Zero(), X_PM, X_PL)}) {
    for (const auto& distance : distances) EXPECT_FALSE(distance.has_value());
  }
  std::vector<Pose> lost = X_PL;
  lost[3].translation().x() = kNaN;
  const auto distances = similarity->distances(Vector48::Zero(), Pose::Identity(), lost);
  for (std::size_t f = 0; f < kFingers; ++f) EXPECT_EQ(distances[f].has_value(), f != 2);
  const auto few = similarity->distances(Vector48::Zero(), Pose::Identity(), std::span(X_PL).first(4));
  for (std::size_t f = 0; f < kFingers; ++f) EXPECT_EQ(few[f].has_value(), f < 3);
  for (const auto& distance : similarity->distances(Vector48::Zero(), Pose::Identity(), X_PL)) {
    EXPECT_TRUE(distance.has_value()) << "a bad frame leaves nothing behind";
  }
}

TEST(Similarity, NeedsNoHeapPerFrame) {
  if (!test::counts_heap()) GTEST_SKIP();
  test::RandomValues random(99);
  auto similarity = Similarity::create(human_hand(), hand::Shape::Zero(), five_links(), ordinary_pads(random));
  ASSERT_TRUE(similarity.ok());
  const std::vector<Pose> X_PL = poses_of_links(random);
  const Vector48 q = any_posture(random);
  const std::uint64_t before = test::heap_allocations();
  for (int i = 0; i < 10; ++i) (void)similarity->distances(q, Pose::Identity(), X_PL);
  EXPECT_EQ(test::heap_allocations(), before);
}

TEST(Similarity, MeasuresOnTheSurfaceOfTheStraightFingerNotInsideItsJoints) {
  robot::RobotModel model = five_links();
  model.joints[1].parent_link = 1;  // the second link continues the first one
  model.joints[1].X_PC.translation() = Vector3d(0.025, 0.0, 0.0);
  EmbodimentConfig config;
  for (const char* link : {kFingerNames[0], kFingerNames[1]}) {
    config.fingers[1].pads.push_back({link, {0.0, 0.0, 0.0}, {0.025, 0.0, 0.0}, 0.008, {0.0, -1.0, 0.0}, 0.0});
  }
  const auto similarity = Similarity::create(human_hand(), hand::Shape::Zero(), model, config);
  ASSERT_TRUE(similarity.ok());
  for (const Similarity::Sample& sample : similarity->samples(Finger::kIndex)) {
    if (sample.link == 1) {
      EXPECT_LT(sample.p_L.x(), 0.025 + 1e-4);
    } else {
      EXPECT_GT(sample.p_L.x(), -1e-4);
    }
  }
}

TEST(Similarity, ErrorsNameTheFingerAndWhatIsWrong) {
  test::RandomValues random(100);
  const EmbodimentConfig good = ordinary_pads(random);
  const auto error = [&](const HandData& data, const EmbodimentConfig& config) {
    const auto similarity = Similarity::create(data, hand::Shape::Zero(), five_links(), config);
    EXPECT_FALSE(similarity.ok());
    return similarity.ok() ? Error{} : similarity.error();
  };
  EmbodimentConfig config = good;
  config.fingers[3].pads[1].link = "sixth_finger";
  const Error no_link = error(human_hand(), config);
  EXPECT_EQ(no_link.code, Errc::kNotFound);
  EXPECT_NE(no_link.detail.view().find("ring"), std::string_view::npos);
  EXPECT_NE(no_link.detail.view().find("sixth_finger"), std::string_view::npos);

  config = good;
  config.fingers[1].pads[0].radius_m = 0.0;
  const Error no_surface = error(human_hand(), config);
  EXPECT_EQ(no_surface.code, Errc::kInvalidArgument);
  EXPECT_NE(no_surface.detail.view().find("index"), std::string_view::npos);

  HandData data = human_hand();
  data.mesh.contact_vertices[4].clear();
  const Error no_patch = error(data, good);
  EXPECT_EQ(no_patch.code, Errc::kUnsupported);
  EXPECT_NE(no_patch.detail.view().find("little"), std::string_view::npos);
}

}  // namespace
}  // namespace embody
