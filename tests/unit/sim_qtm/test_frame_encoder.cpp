#include <gtest/gtest.h>

#include <map>
#include <random>

#include "core/math/pose.hpp"
#include "drivers/sim/qtm/frame_encoder.hpp"
#include "tests/unit/sim_qtm/support.hpp"

namespace embody::sim {
namespace {

using test::Reader;

/// Every kind of content, some of it missing.
FrameData some_frame(std::size_t markers, std::size_t unlabelled, std::size_t bodies, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> metres(-1.0, 1.0);
  std::bernoulli_distribution present(0.8);
  const auto point = [&] { return Eigen::Vector3d(metres(random), metres(random), metres(random)); };
  FrameData frame;
  frame.timestamp_us = 0x0102030405060708;
  frame.frame_number = 0x11223344;
  frame.drop_rate_permille = 12;
  frame.out_of_sync_permille = 345;
  frame.residual_m = 0.0005;
  for (std::size_t i = 0; i < markers; ++i) frame.markers.push_back({point(), present(random)});
  for (std::size_t i = 0; i < unlabelled; ++i)
    frame.unlabelled.push_back({point(), static_cast<std::uint32_t>(70 + i)});
  for (std::size_t i = 0; i < bodies; ++i) {
    BodyPose body;
    body.X_WB.linear() = math::exp_so3(2.0 * point());
    body.X_WB.translation() = point();
    body.residual_m = 0.001;
    body.tracked = present(random);
    frame.bodies.push_back(body);
  }
  return frame;
}

test::WireFrame round_trip(const FrameData& frame, const std::vector<Component>& components, ByteOrder order) {
  return test::take_apart({encode_frame(frame, components, order), order});
}

TEST(FrameEncoder, WritesTheGoldenFrameOfTwoMarkersTheSecondMissing) {
  FrameData frame;
  frame.timestamp_us = 10'000;
  frame.frame_number = 2;
  frame.markers = {{Eigen::Vector3d(1e-3, 2e-3, 3e-3), true}, {}};
  const std::vector<Component> components{Component::k3d};
  const Bytes bytes = encode_frame(frame, components, ByteOrder::kLittle);
  const std::vector<int> golden{0x40, 0,    0,    0,    3,    0,    0,    0,    0x10, 0x27, 0,    0,    0,
                                0,    0,    0,    2,    0,    0,    0,    1,    0,    0,    0,    0x28, 0,
                                0,    0,    1,    0,    0,    0,    2,    0,    0,    0,    0,    0,    0,
                                0,    0,    0,    0x80, 0x3f, 0,    0,    0,    0x40, 0,    0,    0x40, 0x40,
                                0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff};
  ASSERT_EQ(bytes.size(), golden.size());
  for (std::size_t i = 0; i < golden.size(); ++i) EXPECT_EQ(std::to_integer<int>(bytes[i]), golden[i]) << "byte " << i;
}

TEST(FrameEncoder, GivesEveryComponentItsSize) {
  const FrameData frame = some_frame(5, 3, 2, /*seed=*/1);
  const std::map<Component, std::size_t> sizes{{Component::k3d, 16 + 12 * 5},
                                               {Component::k3dResidual, 16 + 16 * 5},
                                               {Component::k3dNoLabels, 16 + 16 * 3},
                                               {Component::k3dNoLabelsResidual, 16 + 20 * 3},
                                               {Component::k6d, 16 + 48 * 2},
                                               {Component::k6dResidual, 16 + 52 * 2},
                                               {Component::k6dEuler, 16 + 24 * 2},
                                               {Component::k6dEulerResidual, 16 + 28 * 2},
                                               {Component::kTimecode, 12},
                                               {Component::kSkeleton, 12},
                                               {Component::kAnalog, 12},
                                               {Component::kAnalogSingle, 12},
                                               {Component::kForce, 12},
                                               {Component::kForceSingle, 12},
                                               {Component::k2d, 16},
                                               {Component::k2dLinear, 16},
                                               {Component::kImage, 12},
                                               {Component::kGazeVector, 12},
                                               {Component::kEyeTracker, 12}};
  std::vector<Component> all;
  for (const auto& [component, size] : sizes) all.push_back(component);
  for (const ByteOrder order : {ByteOrder::kLittle, ByteOrder::kBig}) {
    const auto wire = round_trip(frame, all, order);
    EXPECT_EQ(wire.timestamp_us, frame.timestamp_us);
    EXPECT_EQ(wire.number, frame.frame_number);
    ASSERT_EQ(wire.components.size(), all.size());
    for (std::size_t i = 0; i < all.size(); ++i) {
      EXPECT_EQ(wire.components[i].type, static_cast<std::uint32_t>(all[i]));
      EXPECT_EQ(wire.components[i].bytes.size(), sizes.at(all[i])) << static_cast<int>(all[i]);
    }
  }
}

TEST(FrameEncoder, WritesMillimetresAndAllBitsSetForWhatIsMissing) {
  const FrameData frame = some_frame(40, 4, 0, /*seed=*/2);
  for (const ByteOrder order : {ByteOrder::kLittle, ByteOrder::kBig}) {
    const auto wire = round_trip(frame, {Component::k3dResidual, Component::k3dNoLabelsResidual}, order);
    const Reader labelled(wire.components[0].bytes, order);
    EXPECT_EQ(labelled.u16(12), 12U);
    EXPECT_EQ(labelled.u16(14), 345U);
    for (std::size_t i = 0; i < 40; ++i) {
      const std::size_t at = 16 + 16 * i;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        if (!frame.markers[i].visible) {
          EXPECT_EQ(labelled.u32(at + 4 * axis), 0xFFFFFFFFU);
        } else {
          EXPECT_NEAR(labelled.f32(at + 4 * axis), 1e3 * frame.markers[i].p_W[static_cast<int>(axis)], 1e-4);
        }
      }
      EXPECT_EQ(labelled.f32(at + 12), frame.markers[i].visible ? 0.5F : 0.0F);
    }
    const Reader unlabelled(wire.components[1].bytes, order);
    for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(unlabelled.u32(16 + 20 * i + 12), 70 + i);
  }
}

TEST(FrameEncoder, WritesRotationsColumnByColumnAndEulerAnglesThatGiveTheSameRotation) {
  const FrameData frame = some_frame(0, 0, 50, /*seed=*/3);
  const auto wire = round_trip(frame, {Component::k6dResidual, Component::k6dEuler}, ByteOrder::kLittle);
  const Reader matrices(wire.components[0].bytes, ByteOrder::kLittle);
  const Reader angles(wire.components[1].bytes, ByteOrder::kLittle);
  for (std::size_t i = 0; i < 50; ++i) {
    const std::size_t at = 16 + 52 * i;
    const BodyPose& body = frame.bodies[i];
    if (!body.tracked) {
      for (std::size_t k = 0; k < 13; ++k) EXPECT_EQ(matrices.u32(at + 4 * k), 0xFFFFFFFFU);
      for (std::size_t k = 0; k < 6; ++k) EXPECT_EQ(angles.u32(16 + 24 * i + 4 * k), 0xFFFFFFFFU);
      continue;
    }
    for (int k = 0; k < 9; ++k) {
      EXPECT_NEAR(matrices.f32(at + 12 + 4 * static_cast<std::size_t>(k)), body.X_WB.linear()(k % 3, k / 3), 1e-6);
    }
    EXPECT_FLOAT_EQ(matrices.f32(at + 48), 1.0F);
    Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
    for (int k = 0; k < 3; ++k) {
      const double angle = angles.f32(16 + 24 * i + 12 + 4 * static_cast<std::size_t>(k)) * M_PI / 180.0;
      R = R * Eigen::AngleAxisd(angle, Eigen::Vector3d::Unit(k)).toRotationMatrix();
    }
    EXPECT_LT((R - body.X_WB.linear()).norm(), 1e-5) << "body " << i;
  }
}

TEST(FrameEncoder, FindsAnglesAlsoWhereTwoAxesFallTogether) {
  for (const double pitch : {M_PI / 2, -M_PI / 2}) {
    const Eigen::Matrix3d R =
        (Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitX()) * Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()) *
         Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitZ()))
            .toRotationMatrix();
    const Eigen::Vector3d a = roll_pitch_yaw(R);
    const Eigen::Matrix3d again =
        (Eigen::AngleAxisd(a[0], Eigen::Vector3d::UnitX()) * Eigen::AngleAxisd(a[1], Eigen::Vector3d::UnitY()) *
         Eigen::AngleAxisd(a[2], Eigen::Vector3d::UnitZ()))
            .toRotationMatrix();
    EXPECT_LT((again - R).norm(), 1e-6);
  }
}

TEST(FrameEncoder, CarriesTheCameraTimeOnlyWhenItIsSwitchedOn) {
  FrameData frame;
  frame.timestamp_us = 0x1'0000'0001;
  frame.camera_time = true;
  const auto wire = round_trip(frame, {Component::kTimecode}, ByteOrder::kBig);
  const Reader in(wire.components[0].bytes, ByteOrder::kBig);
  ASSERT_EQ(wire.components[0].bytes.size(), 24U);
  EXPECT_EQ(in.u32(8), 1U);
  EXPECT_EQ(in.u32(12), 2U);
  EXPECT_EQ((std::uint64_t{in.u32(16)} << 32) | in.u32(20), frame.timestamp_us * 10);
}

}  // namespace
}  // namespace embody::sim
