// What the controller's modes ask of the upkeep, and the texts that operators see.
#include <gtest/gtest.h>

#include "drivers/ur_rtde/arm_status.hpp"
#include "drivers/ur_rtde/echo_watch.hpp"
#include "drivers/ur_rtde/program_upload.hpp"
#include "drivers/ur_rtde/status_text.hpp"

namespace embody::ur {
namespace {

using rtde::ControllerStatus;

TEST(ProgramAdvice, UploadsOnlyOnARunningRobotWithoutStopAndProgram) {
  for (int mode = -1; mode <= 8; ++mode) {
    for (int safety = 0; safety <= 23; ++safety) {
      for (std::uint32_t bits = 0; bits < 12; ++bits) {
        for (std::uint32_t runtime = 0; runtime <= 6; ++runtime) {
          const ControllerStatus status{mode, safety, 1U << bits, runtime, 1, 0};
          const ProgramAdvice advice = advise(status, true);
          const bool healthy = mode == 7 && (safety == 1 || safety == 2) && (bits < 2 || bits == 11);
          ASSERT_EQ(advice.need == ProgramNeed::kUpload, healthy && runtime == 1)
              << mode << ' ' << safety << ' ' << bits << ' ' << runtime;
          ASSERT_EQ(advice.need == ProgramNeed::kNone, healthy && runtime == 2);
          ASSERT_TRUE(healthy || !advice.sentence.detail.empty()) << "a person must learn why";
        }
      }
    }
  }
}

TEST(ProgramAdvice, AProgramOfSomebodyElseIsToldByVersionOrSilence) {
  EXPECT_EQ(advise({7, 1, 1, 2, 0, 0}, true).need, ProgramNeed::kWait);
  EXPECT_EQ(advise({7, 1, 1, 2, 2, 0}, true).need, ProgramNeed::kWait);
  EXPECT_EQ(advise({7, 1, 1, 2, 1, 0}, false).need, ProgramNeed::kWait);
  EXPECT_EQ(advise({7, 1, 1, 2, 1, 0}, true).need, ProgramNeed::kNone);
}

TEST(ArmStatus, GivesBackWhatWasPublished) {
  SharedArmStatus shared;
  EXPECT_EQ(shared.snapshot().packages, 0U);
  shared.publish(7, {-1, 22, 0xABC, 5, 1, 11}, false);
  shared.count_command();
  const ArmSnapshot got = shared.snapshot();
  EXPECT_EQ(got.packages, 7U);
  EXPECT_EQ(got.commands, 1U);
  EXPECT_EQ(got.controller.robot_mode, -1);
  EXPECT_EQ(got.controller.safety_status, 22);
  EXPECT_EQ(got.controller.safety_status_bits, 0xABCU);
  EXPECT_EQ(got.controller.runtime_state, 5U);
  EXPECT_EQ(got.controller.program_version, 1);
  EXPECT_EQ(got.controller.time_scale_source, 11);
  EXPECT_FALSE(got.answers);
  shared.publish(8, {1000, -1000, 0, 4'000'000'000U, 257, 0}, true);
  EXPECT_NE(shared.snapshot().controller.robot_mode, 7) << "absurd values must not become healthy ones";
  EXPECT_NE(shared.snapshot().controller.program_version, 1);
}

TEST(EchoWatch, WaitsForItsPatienceOnly) {
  const auto at = [](int ms) { return TimePoint(std::chrono::milliseconds(1'000 + ms)); };
  EchoWatch watch(std::chrono::milliseconds(100));
  watch.reset(5);
  EXPECT_TRUE(watch.answers(at(10'000))) << "nothing was asked";
  watch.sent(6, at(0));
  watch.sent(7, at(90));
  EXPECT_TRUE(watch.answers(at(100)));
  EXPECT_FALSE(watch.answers(at(101))) << "new commands do not extend the time";
  watch.seen(6, at(110));
  EXPECT_TRUE(watch.answers(at(200))) << "late, but moving";
  watch.seen(6, at(220));
  EXPECT_FALSE(watch.answers(at(220)));
  watch.seen(7, at(230));
  EXPECT_TRUE(watch.answers(at(10'000)));
}

TEST(StatusText, EveryCodeHasATextAndEveryStopAnAdvice) {
  for (int code = -2; code < 25; ++code) {
    EXPECT_STRNE(rtde::safety_text(code), "");
    EXPECT_STRNE(rtde::robot_mode_text(code), "");
    EXPECT_STRNE(rtde::runtime_text(code), "");
    EXPECT_STRNE(rtde::time_scale_text(code), "");
    EXPECT_EQ(std::string_view(rtde::safety_advice(code)).empty(), code == 1 || code == 2) << code;
  }
}

}  // namespace
}  // namespace embody::ur
