#include "drivers/mano/mano_model.hpp"

#include <gtest/gtest.h>

#include "core/hand/hand_model.hpp"
#include "core/hand/skinning.hpp"
#include "drivers/mano/mano_file.hpp"
#include "tests/unit/mano/synthetic_files.hpp"
#include "tests/unit/math/random_values.hpp"

namespace embody::mano {
namespace {

using Eigen::Index;
using Eigen::Vector3d;
using embody::test::RandomValues;
using test::synthetic_arrays;

constexpr std::uint64_t kSeed = 31;

/// The files' numbers, element by element as the format defines them.
double template_at(const ArrayFile& file, std::size_t v, std::size_t c) {
  return file.arrays.at("v_template").values[3 * v + c];
}
double shape_at(const ArrayFile& file, std::size_t v, std::size_t c, std::size_t parameter) {
  const Array& array = file.arrays.at("shapedirs");
  return array.values[(3 * v + c) * array.shape[2] + parameter];
}

void expect_same(const ManoModel& a, const ManoModel& b) {
  EXPECT_EQ(a.side, b.side);
  EXPECT_TRUE(a.template_M == b.template_M);
  EXPECT_TRUE(a.triangles == b.triangles);
  EXPECT_TRUE(a.joint_regressor == b.joint_regressor);
  EXPECT_TRUE(a.weights == b.weights);
  EXPECT_TRUE(a.pose_correctives == b.pose_correctives);
  EXPECT_TRUE(a.shape_directions == b.shape_directions);
}

class ManoModelOf : public testing::TestWithParam<Side> {
 protected:
  const ArrayFile file = synthetic_arrays(GetParam(), kSeed);
  const Result<ManoModel> model = make_model(file);
  void SetUp() override { ASSERT_TRUE(model) << model.error().detail.c_str(); }
};
INSTANTIATE_TEST_SUITE_P(Sides, ManoModelOf, testing::Values(Side::kRight, Side::kLeft));

TEST_P(ManoModelOf, FindsTheSideFromTheFingers) {
  EXPECT_EQ(model->side, GetParam());
}

TEST_P(ManoModelOf, IsTheSameFromEveryContainer) {
  const ArrayFile sparse = test::with_sparse_regressor(file);
  const std::pair<const char*, std::string> containers[] = {{"JSON", test::to_json(file)},
                                                            {"JSON, sparse", test::to_json(sparse)},
                                                            {"stored npz", test::to_npz(file, false)},
                                                            {"compressed npz", test::to_npz(file, true)},
                                                            {"sparse npz", test::to_npz(sparse, true)},
                                                            {"own format", format_model(*model)}};
  for (const auto& [name, bytes] : containers) {
    SCOPED_TRACE(name);
    const auto again = parse_model(bytes);
    ASSERT_TRUE(again) << again.error().detail.c_str();
    expect_same(*model, *again);
  }
}

TEST_P(ManoModelOf, HasJointsAndTipsThatFollowTheShapeAsTheRegressorSays) {
  RandomValues random(32);
  const hand::HandData data = hand_data(*model, "synthetic");
  const hand::Shape shape = random.vector<10>(-2.0, 2.0);
  const auto vertex = [&](std::size_t v, std::size_t c) {
    double x = template_at(file, v, c);
    for (std::size_t p = 0; p < 10; ++p) x += shape_at(file, v, c, p) * shape(static_cast<Index>(p));
    return x;
  };
  const Eigen::VectorXd joints = data.joints_M.reshaped() + data.joint_directions * shape;
  const Eigen::VectorXd tips = data.tips_M.reshaped() + data.tip_directions * shape;
  constexpr std::array<std::size_t, 5> kTips{744, 320, 443, 554, 671};
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t k = 0; k < 16; ++k) {
      double expected = 0.0;
      for (std::size_t v = 0; v < 778; ++v) {
        expected += file.arrays.at("J_regressor").values[778 * k + v] * vertex(v, c);
      }
      ASSERT_NEAR(joints(static_cast<Index>(3 * k + c)), expected, 1e-14) << "joint " << k;
    }
    for (std::size_t f = 0; f < kFingers; ++f) {
      ASSERT_NEAR(tips(static_cast<Index>(3 * f + c)), vertex(kTips[f], c), 1e-15) << kFingerNames[f];
    }
  }
}

TEST_P(ManoModelOf, IsItsTemplateInZeroPoseAndLinearInTheShape) {
  RandomValues random(33);
  const hand::HandData data = hand_data(*model, "synthetic");
  const hand::Shape shape = random.vector<10>(-2.0, 2.0);
  const hand::HandSkin flat(data, hand::Shape::Zero()), shaped(data, shape), more(data, hand::Shape(-3.0 * shape));
  for (std::size_t v = 0; v < 778; ++v) {
    for (std::size_t c = 0; c < 3; ++c) {
      const auto at = [&](const hand::HandSkin& skin) {
        return skin.vertices()(static_cast<Index>(c), static_cast<Index>(v));
      };
      ASSERT_NEAR(at(flat), template_at(file, v, c), 1e-15);
      ASSERT_NEAR(at(more) - at(flat), -3.0 * (at(shaped) - at(flat)), 1e-14);
    }
  }
}

// The definition of MANO's pose correctives for one joint, straight from the file: joint i meets columns 9(i-1)..9i-1.
TEST_P(ManoModelOf, MeetsEachJointWithItsOwnNineColumnsOfTheCorrectives) {
  ArrayFile only = file;
  auto& weights = only.arrays.at("weights").values;
  for (std::size_t v = 0; v < 778; ++v) {
    for (std::size_t k = 0; k < 16; ++k) weights[16 * v + k] = k == 0 ? 1.0 : 0.0;  // nothing but correctives moves
  }
  const auto rigid = make_model(only);
  ASSERT_TRUE(rigid);
  hand::HandSkin skin(hand_data(*rigid, "rigid"), hand::Shape::Zero());
  RandomValues random(34);
  for (std::size_t joint = 1; joint < 16; ++joint) {
    hand::Vector48 q = hand::Vector48::Zero();
    const Vector3d w = random.rotation(2.0);
    q.segment<3>(static_cast<Index>(3 * joint)) = w;
    skin.step(q);
    const Eigen::Matrix3d R = math::exp_so3(w);
    for (const std::size_t v : {std::size_t{0}, std::size_t{123}, std::size_t{777}}) {
      for (std::size_t c = 0; c < 3; ++c) {
        double expected = template_at(file, v, c);
        for (std::size_t e = 0; e < 9; ++e) {
          const double feature = R(static_cast<Index>(e / 3), static_cast<Index>(e % 3)) - (e % 4 == 0 ? 1.0 : 0.0);
          expected += file.arrays.at("posedirs").values[(3 * v + c) * 135 + 9 * (joint - 1) + e] * feature;
        }
        ASSERT_NEAR(skin.vertices()(static_cast<Index>(c), static_cast<Index>(v)), expected, 1e-14)
            << "joint " << joint << " vertex " << v;
      }
    }
  }
}

TEST_P(ManoModelOf, MovesItsMarkerPointsAsTheWholeMeshMoves) {
  RandomValues random(35);
  const hand::HandData data = hand_data(*model, "synthetic");
  const hand::HandPoints points = hand::default_points(data);
  ASSERT_TRUE(hand::check_points(data, points));
  const hand::Shape shape = random.vector<10>(-2.0, 2.0);
  const hand::HandModel fingers(data, shape, points);
  hand::HandData moved = data;  // the points' offsets move template vertices before skinning
  for (const auto& finger : points) {
    for (const hand::HandPoint& point : finger) moved.mesh.vertices_M.col(point.vertices[0]) += point.offset_m;
  }
  hand::HandSkin skin(moved, shape);
  for (int trial = 0; trial < 50; ++trial) {
    for (std::size_t f = 0; f < kFingers; ++f) {
      const auto finger = static_cast<Finger>(f);
      const hand::Vector9 q = random.vector<9>(-1.5, 1.5);
      hand::Vector48 all = hand::Vector48::Zero();
      all.segment<9>(static_cast<Index>(3 * hand::first_joint(finger))) = q;
      skin.step(all);
      const auto found = fingers.finger_points(finger, q);
      for (std::size_t i = 0; i < 2; ++i) {
        const Vector3d expected = skin.vertices().col(points[f][i].vertices[0]);
        ASSERT_LT((found[i] - expected).norm(), 1e-13) << kFingerNames[f] << " point " << i;
      }
    }
  }
}

TEST_P(ManoModelOf, MirrorsWithEveryJoint) {
  RandomValues random(36);
  const hand::HandData data = hand_data(*model, "synthetic");
  const hand::HandData other = hand::mirrored(data);
  const hand::Shape shape = random.vector<10>(-2.0, 2.0);
  hand::HandSkin skin(data, shape), mirror(other, shape);
  for (Index joint = 0; joint < 16; ++joint) {
    hand::Vector48 q = hand::Vector48::Zero();
    q.segment<3>(3 * joint) = random.rotation(2.0);
    skin.step(q);
    hand::mirror_angles(q);
    mirror.step(q);
    Eigen::Matrix3Xd expected = skin.vertices();
    expected.row(0) *= -1.0;
    ASSERT_LT((mirror.vertices() - expected).cwiseAbs().maxCoeff(), 1e-14) << "joint " << joint;
  }
}

TEST(ManoModel, UsesTheFirstTenOfMoreShapeDirections) {
  ArrayFile file = synthetic_arrays(Side::kRight, kSeed);
  const auto ten = make_model(file);
  Array& shapes = file.arrays.at("shapedirs");
  Array wide{{778, 3, 16}, {}};
  for (std::size_t row = 0; row < 778 * 3; ++row) {
    for (std::size_t p = 0; p < 16; ++p) wide.values.push_back(p < 10 ? shapes.values[10 * row + p] : 7.0);
  }
  shapes = wide;
  const auto sixteen = make_model(file);
  ASSERT_TRUE(ten && sixteen);
  expect_same(*ten, *sixteen);
}

TEST(ManoModel, MakesSinglePrecisionWeightsSumToOne) {
  ArrayFile file = synthetic_arrays(Side::kRight, kSeed);
  for (double& w : file.arrays.at("weights").values) w = static_cast<double>(static_cast<float>(w));
  const auto model = make_model(file);
  ASSERT_TRUE(model);
  EXPECT_LT((model->weights.rowwise().sum().array() - 1.0).abs().maxCoeff(), 1e-14);
}

TEST(Npy, ReadsEveryNumberTypeInBothOrders) {
  Array array{{2, 3, 4}, {}};
  for (int i = 0; i < 24; ++i) array.values.push_back(3.0 * i);
  for (const char* descr : {"<f8", "<f4", "<i4", "<i8", "<u4", "<u8"}) {
    for (const bool fortran_order : {false, true}) {
      const auto again = parse_npy(test::to_npy(array, descr, fortran_order), "x", 24);
      ASSERT_TRUE(again) << again.error().detail.c_str();
      EXPECT_EQ(again->shape, array.shape) << descr;
      EXPECT_EQ(again->values, array.values) << descr << " Fortran order " << fortran_order;
    }
  }
}

TEST(Npy, ReadsArraysWithoutDimensionAndWithoutElements) {
  const auto one = parse_npy(test::to_npy({{}, {5.0}}, "<f8", false), "x", 10);
  ASSERT_TRUE(one);
  EXPECT_EQ(one->values, std::vector<double>{5.0});
  const auto none = parse_npy(test::to_npy({{0, 3}, {}}, "<f8", true), "x", 10);
  ASSERT_TRUE(none);
  EXPECT_EQ(none->shape, (std::vector<std::size_t>{0, 3}));
}

TEST(Npy, ReadsVersionTwoHeaders) {
  std::string bytes = test::to_npy({{2}, {1.0, 2.0}}, "<f8", false);
  bytes[6] = 2;
  bytes.insert(10, std::string(2, '\0'));
  const auto array = parse_npy(bytes, "x", 10);
  ASSERT_TRUE(array) << array.error().detail.c_str();
  EXPECT_EQ(array->values, (std::vector<double>{1.0, 2.0}));
}

}  // namespace
}  // namespace embody::mano
