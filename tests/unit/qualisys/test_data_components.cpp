// All components in both byte orders, written by the tests' own writer.
#include <gtest/gtest.h>

#include <limits>

#include "drivers/qualisys/codec.hpp"
#include "tests/unit/math/random_values.hpp"
#include "tests/unit/qualisys/wire.hpp"

namespace embody::qualisys {
namespace {

using test::Bytes;
using test::wire_body;
using test::wire_data;
using test::wire_missing;
using test::WireFrame;
using test::WirePart;

constexpr ByteOrder kOrders[] = {ByteOrder::kLittle, ByteOrder::kBig};
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

const char* name_of(ByteOrder order) {
  return kByteOrderNames[static_cast<std::size_t>(order)];
}

/// One item of each kind that is not read here.
std::vector<WirePart> other_components() {
  return {{2, {{1, 2, 3, 4}}, {}},
          {10, {{1, 2, 3, 4, 5}}, {}},
          {6, {{1, 2, 3, 4, 5, 6}}, {}},
          {12, {{1, 2, 3, 4, 5, 6, 7}}, {}},
          {17, {}, Bytes(16)},
          {18, {}, Bytes(4 + 4 + 32)},
          {3, {}, Bytes(40)},
          {19, {}, Bytes(4)},
          {4242, {}, Bytes(12)}};
}

TEST(QualisysData, ReadsTheDocumentedExampleInBothByteOrders) {
  for (const auto order : kOrders) {
    WireFrame frame{10000, 2, 0, 0, {{1, {{1, 2, 3}, wire_missing(3)}, {}}}};
    DataPacket data;
    ASSERT_TRUE(decode_data(wire_data(frame, order), data, order).ok()) << name_of(order);
    EXPECT_EQ(data.timestamp_us, 10000U);
    EXPECT_EQ(data.frame_number, 2U);
    ASSERT_EQ(data.markers.size(), 2U);
    EXPECT_TRUE(data.markers[0].p_W.isApprox(Eigen::Vector3d(0.001, 0.002, 0.003), 1e-12));
    EXPECT_FALSE(data.markers[1].visible);
  }
}

TEST(QualisysData, RefusesTheOtherByteOrder) {
  const WireFrame frame{10000, 2, 0, 0, {{1, {{1, 2, 3}}, {}}}};
  DataPacket data;
  EXPECT_FALSE(decode_data(wire_data(frame, ByteOrder::kBig), data, ByteOrder::kLittle).ok());
  EXPECT_FALSE(decode_data(wire_data(frame, ByteOrder::kLittle), data, ByteOrder::kBig).ok());
  const auto refusal = decode_header(wire_data(frame, ByteOrder::kBig), ByteOrder::kLittle);
  ASSERT_FALSE(refusal.ok());
  EXPECT_NE(refusal.error().detail.view().find("little-endian"), std::string_view::npos);
}

/// A random frame and what should come out of it.
struct RandomFrame {
  WireFrame wire;
  std::vector<Marker> markers;
  std::vector<RigidBody> bodies;
  bool residuals{false};
};

RandomFrame random_frame(test::RandomValues& random) {
  RandomFrame frame;
  frame.wire.timestamp_us = static_cast<std::uint64_t>(random(0.0, 4e15));
  frame.wire.number = static_cast<std::uint32_t>(random(0.0, 4e9));
  frame.wire.drop_rate_permille = static_cast<std::uint16_t>(random(0.0, 1000.0));
  frame.wire.out_of_sync_permille = static_cast<std::uint16_t>(random(0.0, 1000.0));
  frame.residuals = random(0.0, 1.0) < 0.5;
  WirePart markers{frame.residuals ? 9U : 1U, {}, {}};
  for (int i = static_cast<int>(random(0.0, 70.0)); i > 0; --i) {
    Marker marker{random.vector<3>(-5.0, 5.0), random(0.0, 1.0) < 0.8};
    std::vector<float> item = wire_missing(3);
    for (int axis = 0; axis < 3 && marker.visible; ++axis) {
      item[static_cast<std::size_t>(axis)] = static_cast<float>(1e3 * marker.p_W[axis]);
    }
    const auto residual_mm = static_cast<float>(random(0.0, 8.0));
    if (frame.residuals) item.push_back(residual_mm);
    if (frame.residuals && marker.visible) marker.confidence = confidence_of(1e-3 * residual_mm);
    markers.items.push_back(item);
    frame.markers.push_back(marker);
  }
  WirePart bodies{frame.residuals ? 11U : 5U, {}, {}};
  for (int i = static_cast<int>(random(0.0, 9.0)); i > 0; --i) {
    RigidBody body;
    body.X_W = math::pose_from(random.vector<3>(-5.0, 5.0), random.rotation(3.14));
    body.visible = random(0.0, 1.0) < 0.8;
    const auto residual_mm = static_cast<float>(random(0.0, 8.0));
    body.residual_m = frame.residuals && body.visible ? 1e-3 * residual_mm : 0.0;
    auto item = body.visible ? wire_body(body.X_W, residual_mm) : wire_missing(13);
    if (!frame.residuals) item.pop_back();
    bodies.items.push_back(item);
    frame.bodies.push_back(body);
  }
  for (auto& part : other_components()) {
    if (random(0.0, 1.0) < 0.3) frame.wire.parts.push_back(part);
  }
  frame.wire.parts.push_back(markers);
  for (auto& part : other_components()) {
    if (random(0.0, 1.0) < 0.3) frame.wire.parts.push_back(part);
  }
  frame.wire.parts.push_back(bodies);
  return frame;
}

TEST(QualisysData, ReadsMarkersAndBodiesOfAnyFrameAndSkipsAllElse) {
  test::RandomValues random(/*seed=*/20);
  for (int i = 0; i < 2000; ++i) {
    const RandomFrame frame = random_frame(random);
    const auto order = kOrders[i % 2];
    DataPacket data;
    const auto status = decode_data(wire_data(frame.wire, order), data, order);
    ASSERT_TRUE(status.ok()) << status.error().detail.c_str();
    ASSERT_EQ(data.timestamp_us, frame.wire.timestamp_us);
    ASSERT_EQ(data.frame_number, frame.wire.number);
    ASSERT_EQ(data.drop_rate_permille, frame.wire.drop_rate_permille);
    ASSERT_EQ(data.out_of_sync_permille, frame.wire.out_of_sync_permille);
    ASSERT_TRUE(data.has_markers && data.has_bodies);
    ASSERT_EQ(data.markers.size(), frame.markers.size());
    ASSERT_EQ(data.bodies.size(), frame.bodies.size());
    for (std::size_t k = 0; k < frame.markers.size(); ++k) {
      ASSERT_EQ(data.markers[k].visible, frame.markers[k].visible);
      ASSERT_EQ(data.markers[k].confidence, frame.markers[k].confidence);
      if (!data.markers[k].visible) continue;
      ASSERT_LE((data.markers[k].p_W - frame.markers[k].p_W).norm(), 1e-6) << "float resolution at 5 m";
    }
    for (std::size_t k = 0; k < frame.bodies.size(); ++k) {
      ASSERT_EQ(data.bodies[k].visible, frame.bodies[k].visible);
      if (!data.bodies[k].visible) continue;
      ASSERT_TRUE(math::is_valid(data.bodies[k].X_W));
      ASSERT_LE((data.bodies[k].X_W.translation() - frame.bodies[k].X_W.translation()).norm(), 1e-6);
      ASSERT_LE(math::angle_between(data.bodies[k].X_W.linear(), frame.bodies[k].X_W.linear()), 1e-6);
      ASSERT_NEAR(data.bodies[k].residual_m, frame.bodies[k].residual_m, 1e-9);
    }
  }
}

TEST(QualisysData, ReadsRotationsColumnByColumn) {
  // A quarter turn about z takes the body's x axis to the world's y axis: the first three numbers are (0, 1, 0).
  const WireFrame frame{1, 1, 0, 0, {{5, {{10, 20, 30, 0, 1, 0, -1, 0, 0, 0, 0, 1}}, {}}}};
  DataPacket data;
  ASSERT_TRUE(decode_data(wire_data(frame, ByteOrder::kLittle), data).ok());
  ASSERT_TRUE(data.bodies[0].visible);
  EXPECT_TRUE((data.bodies[0].X_W.linear() * Eigen::Vector3d::UnitX()).isApprox(Eigen::Vector3d::UnitY(), 1e-12));
}

TEST(QualisysData, TakesABodyWithoutAPoseAsNotVisible) {
  const auto sound = wire_body(math::pose_from({0.1, 0.2, 0.3}, {0.4, 0.5, 0.6}), 1.0F);
  std::vector<std::pair<const char*, std::vector<float>>> cases{{"missing", wire_missing(13)}};
  for (std::size_t i = 0; i < 12; ++i) {
    cases.emplace_back("NaN", sound);
    cases.back().second[i] = kNan;
    cases.emplace_back("infinite", sound);
    cases.back().second[i] = std::numeric_limits<float>::infinity();
  }
  cases.emplace_back("left-handed", sound);
  for (std::size_t i = 3; i < 6; ++i) cases.back().second[i] *= -1.0F;
  cases.emplace_back("scaled", sound);
  for (std::size_t i = 3; i < 12; ++i) cases.back().second[i] *= 1.1F;
  cases.emplace_back("zero", std::vector<float>(13, 0.0F));
  for (const auto& [what, item] : cases) {
    DataPacket data;
    ASSERT_TRUE(decode_data(wire_data({1, 1, 0, 0, {{11, {item}, {}}}}, ByteOrder::kLittle), data).ok());
    ASSERT_EQ(data.bodies.size(), 1U);
    EXPECT_FALSE(data.bodies[0].visible) << what;
  }
}

TEST(QualisysData, RefusesComponentsWhoseSizeAndCountDisagree) {
  for (const std::uint32_t type : {1U, 9U, 5U, 11U}) {
    for (const std::size_t numbers : {2U, 3U, 4U, 11U, 12U, 13U, 14U}) {
      const std::size_t right = type == 1 ? 3 : type == 9 ? 4 : type == 5 ? 12 : 13;
      const WireFrame frame{1, 1, 0, 0, {{type, {std::vector<float>(numbers, 1.0F)}, {}}}};
      DataPacket data;
      EXPECT_EQ(decode_data(wire_data(frame, ByteOrder::kBig), data, ByteOrder::kBig).ok(), numbers == right)
          << "type " << type << " with " << numbers << " numbers";
    }
    for (std::size_t size = 1; size < 8; ++size) {  // shorter than the head of its family
      DataPacket data;
      EXPECT_FALSE(decode_data(wire_data({1, 1, 0, 0, {{type, {}, Bytes(size)}}}, ByteOrder::kLittle), data).ok());
    }
  }
}

TEST(QualisysData, RefusesMoreBodiesThanItsCapacity) {
  WirePart bodies{5, std::vector<std::vector<float>>(kMaxDataBodies + 1, wire_missing(12)), {}};
  DataPacket data;
  const auto status = decode_data(wire_data({1, 1, 0, 0, {bodies}}, ByteOrder::kLittle), data);
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, Errc::kUnsupported);
}

TEST(QualisysData, TrustsMarkersLessTheLargerTheirResidual) {
  EXPECT_EQ(confidence_of(0.0), 1.0F);
  EXPECT_EQ(confidence_of(0.002), 1.0F);
  EXPECT_EQ(confidence_of(-1.0), 1.0F);
  EXPECT_EQ(confidence_of(static_cast<double>(kNan)), 1.0F);
  for (double residual_m = 0.002; residual_m < 1.0; residual_m *= 1.1) {
    EXPECT_LT(confidence_of(1.1 * residual_m), confidence_of(residual_m));
    EXPECT_GT(confidence_of(residual_m), 0.0F);
  }
}

}  // namespace
}  // namespace embody::qualisys
