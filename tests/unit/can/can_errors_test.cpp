#include "drivers/transport/can_errors.hpp"

#include <gtest/gtest.h>

namespace embody::transport {
namespace {

TEST(CanErrors, AreReadAsTheKernelsHeaderSays) {  // linux/can/error.h
  EXPECT_TRUE(decode_can_errors({0x40, {}}).bus_off);
  EXPECT_TRUE(decode_can_errors({0x100, {}}).restarted);
  EXPECT_TRUE(decode_can_errors({0x20, {}}).no_ack);
  EXPECT_TRUE(decode_can_errors({0x02, {11}}).arbitration_lost);
  EXPECT_TRUE(decode_can_errors({0x08, {}}).protocol);
  EXPECT_TRUE(decode_can_errors({0x80, {}}).protocol) << "bus error";
  EXPECT_TRUE(decode_can_errors({0x01, {}}).tx_timeout);
  EXPECT_TRUE(decode_can_errors({0x04, {0, 0x01}}).overflow);
  EXPECT_TRUE(decode_can_errors({0x04, {0, 0x08}}).error_warning) << "transmit side";
  EXPECT_TRUE(decode_can_errors({0x04, {0, 0x10}}).error_passive) << "receive side";
  EXPECT_TRUE(decode_can_errors({0x04, {0, 0x40}}).error_active);
  EXPECT_EQ(decode_can_errors({0x00, {0, 0xFF}}), CanErrors{}) << "byte 1 means something in its class only";
}

TEST(CanErrors, EveryCombinationComesBack) {
  for (unsigned bits = 0; bits < 1024; ++bits) {
    const auto bit = [bits](unsigned i) { return (bits >> i & 1) != 0; };
    const CanErrors errors{bit(0), bit(1), bit(2), bit(3), bit(4), bit(5), bit(6), bit(7), bit(8), bit(9)};
    ASSERT_EQ(decode_can_errors(encode_can_errors(errors)), errors) << bits;
  }
}

}  // namespace
}  // namespace embody::transport
