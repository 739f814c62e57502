// The arm driver against controllers that answer what a healthy one never would.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/ur_rtde/arm_loop.hpp"
#include "tests/unit/ur_rtde/fake_controller.hpp"

namespace embody {
namespace {

Errc connect_error(const test::FakeController& fake, std::string* detail = nullptr) {
  UrRtdeConfig config;
  config.port = fake.port();
  config.reply_timeout = std::chrono::milliseconds(200);
  config.in_use_patience = std::chrono::milliseconds(200);
  UrRtdeArm arm(config);
  const auto info = arm.connect();
  EXPECT_FALSE(info.ok());
  if (detail != nullptr) *detail = info.error().detail.view();
  return info.ok() ? Errc::kIo : info.error().code;
}

TEST(UrRtdeArmSetUp, NamesAVariableThatTheFirmwareDoesNotKnow) {
  const test::FakeController fake([](char type) {
    test::ReplyBytes reply = test::healthy_reply(type);
    if (type != 'O') return reply;
    std::string types(rtde::as_text(rtde::Bytes(reply).subspan(4)));
    types.replace(types.find("INT32"), 5, "NOT_FOUND");
    return rtde::encode_setup_reply(rtde::PackageType::kSetupOutputs, {0, types});
  });
  std::string detail;
  EXPECT_EQ(connect_error(fake, &detail), Errc::kNotFound);
  EXPECT_NE(detail.find("robot_mode"), std::string::npos) << detail;
}

TEST(UrRtdeArmSetUp, ExplainsEveryRefusalAndSilence) {
  const auto with = [](char type, const char* reply) {
    return [=](char asked) { return asked == type ? test::hex(reply) : test::healthy_reply(asked); };
  };
  EXPECT_EQ(connect_error(test::FakeController(with('V', "00 04 56 00"))), Errc::kUnsupported);
  EXPECT_EQ(connect_error(test::FakeController(with('v', "00 04 76 00"))), Errc::kMalformed);
  EXPECT_EQ(connect_error(test::FakeController(with('O', "00 03 4f"))), Errc::kMalformed);
  EXPECT_EQ(connect_error(test::FakeController(with('I', "00 0a 49 01 'DOUBLE'"))), Errc::kMalformed);
  EXPECT_EQ(connect_error(test::FakeController(with('S', "00 04 53 00"))), Errc::kRefused);
  EXPECT_EQ(connect_error(test::FakeController(with('V', "00 01"))), Errc::kMalformed);
  for (const char silent : {'V', 'v', 'O', 'I', 'S'}) {
    EXPECT_EQ(connect_error(test::FakeController(with(silent, ""))), Errc::kTimeout) << silent;
  }
}

TEST(UrRtdeArmSetUp, QuotesTheLastTextOfTheControllerInItsError) {
  const test::FakeController fake([](char type) {
    using test::operator+;
    return type == 'S' ? test::hex("00 0a 4d 03 'why' 01 'd' 01") + test::hex("00 04 53 00")
                       : test::healthy_reply(type);
  });
  std::string detail;
  EXPECT_EQ(connect_error(fake, &detail), Errc::kRefused);
  EXPECT_NE(detail.find("why"), std::string::npos) << detail;
}

TEST(UrRtdeArmSetUp, NobodyListeningIsDisconnectedAndABadFrequencyIsRefused) {
  UrRtdeConfig config;
  config.port = 1;
  EXPECT_EQ(UrRtdeArm(config).connect().error().code, Errc::kDisconnected);
  for (const double frequency : {0.0, 501.0, std::nan("")}) {
    config.frequency_hz = frequency;
    EXPECT_EQ(UrRtdeArm(config).connect().error().code, Errc::kInvalidArgument);
  }
}

TEST(UrRtdeArmSetUp, ToleratesTextsStaleDataAndAnyFragmentation) {
  for (const std::size_t part : {0U, 1U, 2U, 7U}) {
    const test::FakeController fake(
        [](char type) {
          using test::operator+;
          auto reply = test::hex("00 09 4d 02 'hi' 01 'd' 03") + test::state_package(1.0) + test::healthy_reply(type);
          return type == 'S' ? reply + test::state_package(2.0) + test::state_package(2.002) : reply;
        },
        part);
    test::ArmLoop loop(fake.port());
    ASSERT_TRUE(loop.connected) << loop.error.detail.c_str();
    EXPECT_EQ(loop.arm->last_text(), "hi");
    ASSERT_TRUE(loop.next());
    EXPECT_EQ(loop.state.controller_time, std::chrono::seconds(2));
    ASSERT_TRUE(loop.next());
    EXPECT_EQ(loop.state.controller_time, std::chrono::milliseconds(2002));
    EXPECT_EQ(loop.state.package, 2U);
    EXPECT_EQ(loop.state.condition, ArmCondition::kReady);
  }
}

/// What a controller sends during one session, set-up and stream, cut once at each byte.
TEST(UrRtdeArmStream, ASessionIsUnderstoodWhereverItIsCut) {
  using test::operator+;
  test::ReplyBytes session = test::hex("00 09 4d 02 'hi' 01 'd' 03");
  for (const char type : {'V', 'v', 'O', 'I', 'S'}) session = session + test::healthy_reply(type);
  for (int i = 1; i <= 3; ++i) session = session + test::state_package(2.0 + 0.002 * i);
  const std::string types = "MVvOISUUU";
  rtde::FrameBuffer buffer;
  for (std::size_t cut = 0; cut <= session.size(); ++cut) {
    buffer.clear();
    std::string seen;
    for (const auto& part : {rtde::Bytes(session).first(cut), rtde::Bytes(session).subspan(cut)}) {
      std::copy(part.begin(), part.end(), buffer.space().begin());
      buffer.commit(part.size());
      for (auto parsed = buffer.next(); parsed.framing == rtde::Framing::kComplete; parsed = buffer.next()) {
        seen += static_cast<char>(parsed.frame.type);
        if (!parsed.frame.is(rtde::PackageType::kData)) continue;
        const auto fields = rtde::decode_data(parsed.frame.payload, 1, rtde::OutputRecipe().size());
        ArmState state;
        ASSERT_TRUE(fields && rtde::decode_state(*fields, state)) << cut;
        ASSERT_EQ(state.condition, ArmCondition::kReady);
      }
    }
    ASSERT_EQ(seen, types) << "cut at " << cut;
  }
}

TEST(UrRtdeArmStream, BytesThatBreakTheProtocolEndTheSession) {
  using test::operator+;
  const std::vector<test::ReplyBytes> endings{test::hex("00 02 55"), test::hex("00 05 55 01 00"),
                                              test::state_package(std::nan("")), test::state_package(1.0, HUGE_VAL),
                                              test::state_package(0.5)};  // the clock goes back
  for (const auto& ending : endings) {
    const test::FakeController fake([&](char type) {
      return type == 'S' ? test::healthy_reply(type) + test::state_package(1.0) + ending : test::healthy_reply(type);
    });
    test::ArmLoop loop(fake.port());
    ASSERT_TRUE(loop.connected);
    EXPECT_TRUE(loop.next()) << "the good package before counts";
    EXPECT_FALSE(loop.next());
    EXPECT_EQ(loop.arm->read(loop.state), IoStatus::kDisconnected);
    EXPECT_EQ(loop.send(ArmAction::kHold), IoStatus::kDisconnected);
    EXPECT_FALSE(loop.arm->reason().empty());
  }
}

}  // namespace
}  // namespace embody
