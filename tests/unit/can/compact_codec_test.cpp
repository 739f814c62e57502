#include "drivers/mia/compact/codec.hpp"

#include <gtest/gtest.h>

#include <random>
#include <string_view>

namespace embody::mia::compact {
namespace {

constexpr unsigned kSeed = 5;

class CompactCodec : public ::testing::TestWithParam<bool> {
 protected:
  Ids ids{CanId{GetParam() ? 0x18DA0000u : 0x200u, GetParam()}};
  std::mt19937 random{kSeed};
  unsigned below(unsigned n) { return static_cast<unsigned>(random() % n); }
};
INSTANTIATE_TEST_SUITE_P(Identifiers, CompactCodec, ::testing::Values(false, true),
                         [](const auto& with) { return with.param ? "of29Bits" : "of11Bits"; });

TEST(CompactCrc, IsAutosarsCrc8h2f) {
  constexpr std::string_view kText = "123456789";
  std::vector<std::uint8_t> bytes(kText.begin(), kText.end());
  EXPECT_EQ(crc8(bytes), 0xDF);
  EXPECT_EQ(crc8({}), 0x00);
  EXPECT_EQ(crc8(std::array<std::uint8_t, 4>{}), 0x12);  // AUTOSAR: 00 00 00 00
}

TEST(CompactFrames, LieOnTheBusAsTheHeaderSays) {
  const Ids ids{CanId{0x200, false}};
  const CanFrame command = encode(ids, Command{Opcode::kPosition, 1, -120, 60, 50, 7});
  EXPECT_EQ(command.id, (CanId{0x201, false}));
  const std::array<std::uint8_t, 7> bytes{1, 1, 0x88, 0xFF, 60, 50, 7};
  EXPECT_TRUE(std::equal(bytes.begin(), bytes.end(), command.data.begin()));
  EXPECT_EQ(command.data[7], crc8(bytes));
  const CanFrame state = encode(ids, 2, State{200, -36, 513, 5, 9});
  EXPECT_EQ(state.id, (CanId{0x212, false}));
  EXPECT_EQ(state.data, (std::array<std::uint8_t, 8>{200, 0, 0xDC, 0xFF, 1, 2, 5, 9}));
  const CanFrame forces = encode(ids, Forces{{1, 0, 0, 0, 0, 1023}, 0xA});
  EXPECT_EQ(forces.id, (CanId{0x213, false}));
  EXPECT_EQ(forces.data, (std::array<std::uint8_t, 8>{1, 0, 0, 0, 0, 0, 0xFC, 0xAF}));
  EXPECT_EQ(encode(ids, Ack{}).id, (CanId{0x21F, false}));
  EXPECT_EQ(encode(ids, Heartbeat{}).id, (CanId{0x20F, false}));
}

TEST_P(CompactCodec, EveryOperationAndAnswerComesBack) {
  for (unsigned i = 0; i < 20'000; ++i) {
    const Command command{static_cast<Opcode>(below(kOpcodes)),    static_cast<std::uint8_t>(below(4)),
                          static_cast<std::int16_t>(below(65536)), static_cast<std::uint8_t>(below(256)),
                          static_cast<std::uint8_t>(below(256)),   static_cast<std::uint8_t>(below(256))};
    Command command_back;
    ASSERT_EQ(decode(ids, encode(ids, command), command_back), Verdict::kGood) << "seed " << kSeed << " case " << i;
    ASSERT_EQ(command_back, command);
    const Ack ack{command.opcode, command.motor, static_cast<AckStatus>(below(kAckStatuses)), command.counter};
    Ack ack_back;
    ASSERT_EQ(decode(ids, encode(ids, ack), ack_back), Verdict::kGood);
    ASSERT_EQ(ack_back, ack);
    const State state{static_cast<std::int16_t>(static_cast<int>(below(1021)) - 510),
                      static_cast<std::int16_t>(below(65536)), static_cast<std::uint16_t>(below(65536)),
                      static_cast<std::uint8_t>(below(256)), static_cast<std::uint8_t>(below(256))};
    State state_back;
    std::size_t motor = 9;
    ASSERT_EQ(decode(ids, encode(ids, i % 3, state), motor, state_back), Verdict::kGood);
    ASSERT_EQ(motor, i % 3);
    ASSERT_EQ(state_back, state);
    Forces forces;
    for (auto& raw : forces.raw) raw = static_cast<std::uint16_t>(below(1024));
    forces.counter = static_cast<std::uint8_t>(below(16));
    Forces forces_back;
    ASSERT_EQ(decode(ids, encode(ids, forces), forces_back), Verdict::kGood);
    ASSERT_EQ(forces_back, forces);
    const Heartbeat heartbeat{i % 2 == 0, static_cast<std::uint8_t>(below(256))};
    Heartbeat heartbeat_back;
    ASSERT_EQ(decode(ids, encode(ids, heartbeat), heartbeat_back), Verdict::kGood);
    ASSERT_EQ(heartbeat_back, heartbeat);
  }
}

TEST_P(CompactCodec, AnyChangedBitOfASealedFrameIsNoticed) {
  const std::array<CanFrame, 3> frames{encode(ids, Command{Opcode::kSpeed, 2, 35, 0, 50, 200}),
                                       encode(ids, Ack{Opcode::kStop, 3, AckStatus::kDone, 17}),
                                       encode(ids, Heartbeat{true, 3})};
  const auto good = [this](const CanFrame& frame) {
    Command command;
    Ack ack;
    Heartbeat heartbeat;
    return decode(ids, frame, command) == Verdict::kGood || decode(ids, frame, ack) == Verdict::kGood ||
           decode(ids, frame, heartbeat) == Verdict::kGood;
  };
  for (const CanFrame& frame : frames) {
    ASSERT_TRUE(good(frame));
    for (unsigned first = 0; first < 64; ++first) {
      for (unsigned second = first; second < 64; ++second) {  // one bit, and any two
        CanFrame changed = frame;
        changed.data[first / 8] ^= static_cast<std::uint8_t>(1u << first % 8);
        if (second != first) changed.data[second / 8] ^= static_cast<std::uint8_t>(1u << second % 8);
        ASSERT_FALSE(good(changed)) << first << " and " << second;
      }
    }
    CanFrame cut = frame;
    cut.size = 7;
    EXPECT_FALSE(good(cut));
  }
}

TEST_P(CompactCodec, ACommandOfOneMotorIsNotTakenUnderTheIdentifierOfAnother) {
  CanFrame frame = encode(ids, Command{Opcode::kPosition, 1, 100, 60, 50, 0});
  frame.id.value += 1;
  Command command;
  EXPECT_EQ(decode(ids, frame, command), Verdict::kDamaged);
  frame.id.extended = !frame.id.extended;
  EXPECT_EQ(decode(ids, frame, command), Verdict::kForeign);
}

TEST_P(CompactCodec, RefusesCountsThatNoMotorHasAndShortStates) {
  State state;
  std::size_t motor = 0;
  EXPECT_EQ(decode(ids, encode(ids, 0, State{511}), motor, state), Verdict::kDamaged);
  EXPECT_EQ(decode(ids, encode(ids, 0, State{-32768}), motor, state), Verdict::kDamaged);
  CanFrame cut = encode(ids, 0, State{10});
  cut.size = 7;
  EXPECT_EQ(decode(ids, cut, motor, state), Verdict::kDamaged);
  CanFrame forces = encode(ids, Forces{});
  forces.size = 6;
  Forces got;
  EXPECT_EQ(decode(ids, forces, got), Verdict::kDamaged);
}

}  // namespace
}  // namespace embody::mia::compact
