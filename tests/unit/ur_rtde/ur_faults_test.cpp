// Each fault of link and controller, made to happen under a tracking arm: how soon the driver says so, that nothing
// moves that should not, and how it goes on.
#include <gtest/gtest.h>

#include "tests/unit/ur_rtde/ur_lab.hpp"

namespace embody {
namespace {

using test::ArmLoop;
using test::UrLab;
using transport::now;

double ms(Duration duration) {
  return 1e3 * to_seconds(duration);
}

/// An engaged arm with the driver's real time limits.
struct Engaged {
  explicit Engaged(UrLab& of, Duration stale_after = std::chrono::milliseconds(100))
      : lab(of), loop(config(of, stale_after)) {
    EXPECT_TRUE(loop.connected) << loop.error.detail.c_str();
    EXPECT_TRUE(loop.engage()) << loop.arm->reason();
  }
  static UrRtdeConfig config(const UrLab& of, Duration stale_after) {
    UrRtdeConfig driver = of.driver();
    driver.stale_after = stale_after;
    return driver;
  }
  /// Tracks the present position until the session ends, as a loop with ticks of 2 ms; how long that took.
  Duration until_lost(std::string_view fault) {
    lab.fault(fault);
    const TimePoint begin = now();
    const Vector6 here = loop.state.q_rad;
    while (now() < begin + test::kPatience) {
      IoStatus status = loop.arm->read(loop.state);
      if (status == IoStatus::kDone) status = loop.send(ArmAction::kTrack, here);
      if (status == IoStatus::kDisconnected) break;
      if (status == IoStatus::kEmpty) (void)transport::wait_readable(loop.fd, now() + std::chrono::milliseconds(2));
    }
    const Duration took = now() - begin;
    std::printf("%-14.*s noticed after %5.1f ms: %s\n", static_cast<int>(fault.size()), fault.data(), ms(took),
                std::string(loop.arm->reason()).c_str());
    return took;
  }
  /// Connects again; the arm has not moved meanwhile, is not tracking, and can be engaged.
  void expect_recovery() {
    const Vector6 before = loop.state.q_rad;
    const TimePoint deadline = now() + test::kPatience;
    while (!loop.connect() && now() < deadline) {
    }
    ASSERT_TRUE(loop.connected) << loop.error.detail.c_str();
    ASSERT_TRUE(loop.next());
    EXPECT_FALSE(loop.state.tracking && loop.state.package > 50);
    EXPECT_LT((loop.state.q_rad - before).cwiseAbs().maxCoeff(), 1e-3);
    if (lab.controller.safety().runtime_state != 2) lab.fault("program on");  // the script's watchdog ended it
    const auto ready = [](const ArmState& s) { return s.condition == ArmCondition::kReady && !s.tracking; };
    ASSERT_TRUE(loop.send_until(ArmAction::kHold, Vector6::Zero(), ready)) << loop.arm->reason();
    EXPECT_TRUE(loop.engage());
  }
  UrLab& lab;
  ArmLoop loop;
};

TEST(UrFaults, AClosedOrResetConnectionIsNoticedAtOnce) {
  UrLab lab;
  Engaged arm(lab);
  for (const char* fault : {"reset", "disconnect", "restart"}) {
    EXPECT_LT(arm.until_lost(fault), std::chrono::milliseconds(100)) << fault;
    arm.expect_recovery();
  }
}

TEST(UrFaults, SilenceWithoutEndAndAStandingClockAreNoticedInATenthOfASecond) {
  UrLab lab;
  Engaged arm(lab);
  for (const char* fault : {"freeze on", "clock on"}) {
    const Duration took = arm.until_lost(fault);
    EXPECT_GT(took, std::chrono::milliseconds(80)) << fault;
    EXPECT_LT(took, std::chrono::milliseconds(200)) << fault;
    EXPECT_NE(arm.loop.arm->reason().find("stands still"), std::string_view::npos);
    lab.fault("freeze off");
    lab.fault("clock off");
    arm.expect_recovery();
  }
}

TEST(UrFaults, AControllerThatDoesNotReadEndsTheSession) {
  UrLab lab;
  Engaged arm(lab, test::kPatience);
  lab.fault("deaf on");
  bool dropped = false;
  IoStatus status = IoStatus::kDone;
  const TimePoint begin = now();
  while (status != IoStatus::kDisconnected && now() < begin + test::kPatience) {
    while (arm.loop.arm->read(arm.loop.state) == IoStatus::kDone) {
    }
    status = arm.loop.send(ArmAction::kTrack, arm.loop.state.q_rad);
    dropped = dropped || status == IoStatus::kEmpty;
  }
  EXPECT_TRUE(dropped) << "newest wins: commands are dropped before the session ends";
  EXPECT_EQ(status, IoStatus::kDisconnected);
  EXPECT_EQ(arm.loop.arm->reason(), "commands do not reach the controller any more");
}

TEST(UrFaults, JitterFragmentsAndCoalescingLoseNothing) {
  UrLab lab;
  Engaged arm(lab, test::kPatience);
  for (const char* fault : {"jitter 40", "jitter 0", "coalesce 5", "coalesce 1", "fragment on"}) {
    lab.fault(fault);
    double last_s = to_seconds(arm.loop.state.controller_time);
    for (int i = 0; i < 100; ++i) {
      ASSERT_TRUE(arm.loop.next()) << fault << ": " << arm.loop.arm->reason();
      const double time_s = to_seconds(arm.loop.state.controller_time);
      ASSERT_GT(time_s, last_s) << fault << ": order is kept";
      last_s = time_s;
      arm.loop.send(ArmAction::kHold);
    }
  }
  lab.fault("fragment off");
  EXPECT_TRUE(arm.loop.engage());
}

TEST(UrFaults, AJitterOfATenthOfASecondNeverMovesTheArmByItself) {
  UrLab lab;
  Engaged arm(lab, test::kPatience);
  const Vector6 before = arm.loop.state.q_rad;
  lab.fault("jitter 100");
  for (int i = 0; i < 200; ++i) {
    ASSERT_TRUE(arm.loop.next()) << arm.loop.arm->reason();
    arm.loop.send(ArmAction::kTrack, before);
  }
  EXPECT_LT((arm.loop.state.q_rad - before).cwiseAbs().maxCoeff(), 1e-3);
}

TEST(UrFaults, TextsBetweenTheRepliesOfTheHandshakeAreSkipped) {
  UrLab lab;
  lab.fault("texts on");
  lab.fault("fragment on");
  ArmLoop loop(lab.driver());
  ASSERT_TRUE(loop.connected) << loop.error.detail.c_str();
  EXPECT_EQ(loop.arm->last_text(), "Arm is not powered");
  EXPECT_TRUE(loop.next());
}

TEST(UrFaults, RegistersInUseForAWhileAreWaitedForAndForEverAreExplained) {
  UrLab lab;
  lab.fault("in-use 0.5");
  TimePoint begin = now();
  while (lab.controller.counters().cycles < 20) std::this_thread::yield();  // the fault is in force
  ArmLoop patient(lab.driver());
  EXPECT_TRUE(patient.connected) << patient.error.detail.c_str();
  EXPECT_GT(now() - begin, std::chrono::milliseconds(400));
  patient.arm.reset();
  lab.fault("occupy on");
  UrRtdeConfig config = lab.driver();
  config.in_use_patience = std::chrono::milliseconds(300);
  const TimePoint deadline = now() + test::kPatience;
  ArmLoop refused(config);
  while (refused.connected && now() < deadline) refused.connect();  // until the fault is in force
  EXPECT_EQ(refused.error.code, Errc::kRefused);
  EXPECT_NE(refused.error.detail.view().find("fieldbus"), std::string_view::npos) << refused.error.detail.c_str();
  lab.fault("occupy off");
  while (!refused.connect() && now() < deadline) {
  }
  EXPECT_TRUE(refused.connected);
}

TEST(UrFaults, OneClientTooManyIsClosedAfterItsHandshakeAndSaysWhy) {
  sim::UrControllerConfig config = test::fast_controller();
  config.max_clients = 1;
  UrLab lab(config);
  Engaged first(lab, test::kPatience);
  UrRtdeConfig driver = lab.driver();
  driver.in_use_patience = std::chrono::seconds(3);
  const ArmLoop second(driver);
  EXPECT_FALSE(second.connected);
  EXPECT_NE(second.error.detail.view().find("too many"), std::string_view::npos) << second.error.detail.c_str();
}

TEST(UrFaults, AControllerOf125HertzIsTrackedAndLoaded) {
  sim::UrControllerConfig config = test::fast_controller();
  config.frequency_hz = 125.0;
  config.version = {3, 15, 8, 0};
  config.model = "UR10";
  config.robot.program_text = "";
  config.missing = {"payload", "payload_cog", "payload_inertia"};
  UrLab lab(config);
  UrRtdeConfig driver = lab.driver();
  driver.expected.model = "UR10";
  test::ServicedLoop serviced(driver);
  ASSERT_TRUE(serviced.ready()) << serviced.sentence();
  EXPECT_EQ(serviced.sentence(), "");
  ASSERT_TRUE(serviced.loop.engage());
  EXPECT_EQ(serviced.loop.arm->version().major, 3U);
  const Vector6 goal = serviced.loop.state.q_rad + Vector6::Constant(0.1);
  EXPECT_TRUE(serviced.loop.send_until(
      ArmAction::kTrack, goal, [&](const ArmState& s) { return (s.q_rad - goal).cwiseAbs().maxCoeff() < 2e-3; }));
}

TEST(UrFaults, AClientThatDoesNotReadIsClosedByTheControllerAndRecovers) {
  UrLab lab;
  Engaged arm(lab, test::kPatience);
  const TimePoint deadline = now() + std::chrono::seconds(20);
  while (lab.controller.counters().slow_clients_closed == 0 && now() < deadline) std::this_thread::yield();
  if (lab.controller.counters().slow_clients_closed == 0) GTEST_SKIP() << "the kernel's buffers hold more";
  while (arm.loop.arm->read(arm.loop.state) == IoStatus::kDone) {
  }
  EXPECT_EQ(arm.loop.arm->read(arm.loop.state), IoStatus::kDisconnected);
  arm.expect_recovery();
}

}  // namespace
}  // namespace embody
