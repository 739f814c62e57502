#include "drivers/ur_rtde/ur_rtde_arm.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <future>
#include <numbers>

#include "drivers/sim/ur/ur_controller.hpp"
#include "tests/support/heap_counter.hpp"
#include "tests/unit/ur_rtde/arm_loop.hpp"

namespace embody {
namespace {

using sim::ProgramState;
using sim::UrController;
using test::kPatience;
using transport::now;

class UrRtdeArmOnSimulator : public testing::Test {
 protected:
  UrRtdeArmOnSimulator() { EXPECT_TRUE(controller.start().ok()); }
  UrController controller{sim::UrControllerConfig{}};
  const Vector6 start = sim::UrRobotConfig{}.q_start_rad;
};

TEST_F(UrRtdeArmOnSimulator, ConnectsAndReportsAReadyRobotWithoutMovingIt) {
  sim::UrControllerConfig patient;
  patient.robot.program.watchdog_hz = 1.0;  // a busy machine must not end the program meanwhile
  UrController waiting(patient);
  ASSERT_TRUE(waiting.start().ok());
  UrRtdeConfig config;
  config.port = waiting.port();
  UrRtdeArm arm(config);
  const auto info = arm.connect();
  ASSERT_TRUE(info.ok()) << info.error().detail.c_str();
  EXPECT_EQ(info->rate_hz, 500.0);
  EXPECT_NE(info->peer.view().find("5.12.4"), std::string_view::npos) << info->peer.c_str();
  ArmState state;
  for (std::uint64_t package = 1; package <= 50;) {
    ASSERT_TRUE(transport::wait_readable(info->fd, now() + kPatience));
    while (arm.read(state) == IoStatus::kDone) {
      EXPECT_EQ(state.package, package++);
    }
  }
  EXPECT_EQ(state.condition, ArmCondition::kReady);
  EXPECT_FALSE(state.tracking);
  EXPECT_EQ(state.q_rad, start);
  EXPECT_EQ(state.q_target_rad, start);
  EXPECT_EQ(state.controller_time.count() % 2'000'000, 0) << "time stamps lie on the 2 ms grid";
  EXPECT_LE(now() - state.t_arrival, kPatience);
  EXPECT_TRUE(waiting.has_client());
}

TEST_F(UrRtdeArmOnSimulator, ReportsTheRateThatTheControllerReallySends) {
  UrRtdeConfig config;
  config.port = controller.port();
  config.frequency_hz = 120.0;  // one package each floor(500 / 120) = 4 cycles
  UrRtdeArm arm(config);
  const auto info = arm.connect();
  ASSERT_TRUE(info.ok()) << info.error().detail.c_str();
  EXPECT_EQ(info->rate_hz, 125.0);
}

TEST_F(UrRtdeArmOnSimulator, TracksASineAtFiveHundredHertzWithOneCommandPerPackage) {
  constexpr int kPackages = 1000;
  constexpr double kAmplitude = 0.05, kOmega = std::numbers::pi;
  test::ArmLoop loop(controller.port());
  ASSERT_TRUE(loop.connected) << loop.error.detail.c_str();
  ASSERT_TRUE(loop.engage());
  const sim::UrCounters before = controller.counters();
  std::vector<std::uint32_t> lags;
  std::vector<double> errors;
  Duration first_time{}, last_time{};
  for (int i = 0; i < kPackages; ++i) {
    ASSERT_TRUE(loop.next()) << loop.arm->reason();
    if (!loop.state.tracking) {  // the host may stall for longer than the program waits
      ASSERT_TRUE(loop.engage());
    }
    if (i == 0) first_time = loop.state.controller_time;
    last_time = loop.state.controller_time;
    lags.push_back(loop.sequence - loop.state.echo_sequence);
    const double t = to_seconds(loop.state.controller_time - first_time);
    const auto wave = [&](double at) { return start + Vector6::Constant(kAmplitude * (1.0 - std::cos(kOmega * at))); };
    errors.push_back((loop.state.q_rad - wave(std::max(0.0, t - 0.05))).cwiseAbs().maxCoeff());
    ASSERT_EQ(loop.send(ArmAction::kTrack, wave(t), Vector6::Constant(kAmplitude * kOmega * std::sin(kOmega * t))),
              IoStatus::kDone);
  }
  const sim::UrCounters after = controller.counters();
  std::sort(lags.begin(), lags.end());
  std::sort(errors.begin(), errors.end());
  const double rate = (kPackages - 1) / to_seconds(last_time - first_time);
  std::printf("packages %d at %.1f Hz, echo lag median %u p99 %u packages, error p95 %.4f rad, late cycles %llu\n",
              kPackages, rate, lags[kPackages / 2], lags[kPackages * 99 / 100], errors[kPackages * 95 / 100],
              static_cast<unsigned long long>(after.late_cycles - before.late_cycles));
  EXPECT_LE(lags[kPackages / 2], 2U);
  EXPECT_LE(lags[kPackages * 9 / 10], 3U);
  EXPECT_LT(errors[kPackages / 2], 0.005);
  EXPECT_GT(errors.back(), 1e-5) << "an arm without any error does not move";
  EXPECT_EQ(after.sequence_gaps, 0U);
  EXPECT_EQ(after.sequence_duplicates, 0U);
  EXPECT_GE(after.command_packages - before.command_packages + 5, static_cast<std::uint64_t>(kPackages));
}

TEST_F(UrRtdeArmOnSimulator, AFrozenSenderLeavesTheProgramStaleAndTheArmStill) {
  test::ArmLoop loop(controller.port());
  ASSERT_TRUE(loop.engage());
  const Vector6 far = start + Vector6::Constant(1.5);
  ASSERT_TRUE(loop.send_until(ArmAction::kTrack, far, [&](const ArmState& s) {
    return s.qd_rad_s[0] > 0.4 && s.q_target_rad[0] < start[0] + 1.0;
  }));
  const auto stale = [&] { return controller.latest().program_state == ProgramState::kStale; };
  while (!stale()) ASSERT_TRUE(loop.next());  // reads, but sends nothing any more
  for (int i = 0; i < 400; ++i) ASSERT_TRUE(loop.next());
  EXPECT_FALSE(loop.state.tracking);
  EXPECT_EQ(loop.state.program_fault, 1);
  EXPECT_LT(loop.state.qd_rad_s.cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_LT(loop.state.q_rad[0], far[0] - 0.2) << "it must not go on to the last target";

  const auto samples = controller.samples();
  const auto begin = std::find_if(samples.begin(), samples.end(),
                                  [](const auto& s) { return s.program_state == ProgramState::kStale; });
  ASSERT_NE(begin, samples.end());
  const auto still = begin + 200;  // 1 rad/s at 4 rad/s2 is a quarter of a second; then the program ends
  ASSERT_LT(still, samples.end());
  for (auto s = still; s != samples.end(); ++s) ASSERT_EQ(s->q_target_rad, still->q_target_rad);
}

TEST_F(UrRtdeArmOnSimulator, AfterALostSessionNothingMovesBeforeHoldAndThenTrack) {
  test::ArmLoop lost(controller.port());
  ASSERT_TRUE(lost.engage());
  ASSERT_TRUE(lost.send_until(ArmAction::kTrack, start + Vector6::Constant(1.0),
                              [](const ArmState& s) { return s.qd_rad_s[0] > 0.3; }));
  controller.disconnect_clients();  // the registers keep mode 1 and the far target
  while (lost.next()) {
  }
  EXPECT_EQ(lost.send(ArmAction::kTrack, start), IoStatus::kDisconnected);
  EXPECT_FALSE(lost.arm->reason().empty());

  test::ArmLoop loop(controller.port());
  ASSERT_TRUE(loop.connected) << loop.error.detail.c_str();
  for (int i = 0; i < 400; ++i) ASSERT_TRUE(loop.next());  // comes to rest without any command
  EXPECT_FALSE(loop.state.tracking);
  EXPECT_EQ(loop.state.condition, ArmCondition::kProgramStopped) << "without any commands the program ends itself";
  const Vector6 rest = loop.state.q_rad;
  controller.set_program_running(true);
  loop.sequence = 1000;
  loop.send(ArmAction::kHold);
  ASSERT_TRUE(loop.send_until(ArmAction::kHold, Vector6::Zero(), [&](const ArmState& s) {
    return s.condition == ArmCondition::kReady && s.echo_sequence == loop.sequence;
  }));
  for (int i = 0; i < 100; ++i) {  // the target of the lost session is not taken up again
    loop.send(ArmAction::kTrack, start + Vector6::Constant(1.0));
    ASSERT_TRUE(loop.next());
  }
  EXPECT_LT((loop.state.q_rad - rest).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_EQ(loop.state.program_fault, 2);
  ASSERT_TRUE(loop.engage());
  const Vector6 near = rest + Vector6::Constant(0.05);
  EXPECT_TRUE(loop.send_until(ArmAction::kTrack, near,
                              [&](const ArmState& s) { return (s.q_rad - near).cwiseAbs().maxCoeff() < 1e-3; }));
}

TEST_F(UrRtdeArmOnSimulator, ASecondClientIsToldWhoMayOwnTheRegisters) {
  test::ArmLoop owner(controller.port());
  ASSERT_TRUE(owner.connected);
  const TimePoint begin = now();
  test::ArmLoop second(controller.port(), std::chrono::milliseconds(300));
  EXPECT_FALSE(second.connected);
  EXPECT_GE(now() - begin, std::chrono::milliseconds(100)) << "it must have tried again";
  EXPECT_EQ(second.error.code, Errc::kRefused);
  EXPECT_NE(second.error.detail.view().find("input_int_register_24"), std::string_view::npos);
  EXPECT_NE(second.error.detail.view().find("fieldbus"), std::string_view::npos) << second.error.detail.c_str();
}

TEST_F(UrRtdeArmOnSimulator, WaitsForRegistersThatALostSessionStillOwns) {
  auto owner = std::make_unique<test::ArmLoop>(controller.port());
  ASSERT_TRUE(owner->connected);
  auto second = std::async(std::launch::async, [&] { return test::ArmLoop(controller.port()).connected; });
  const TimePoint deadline = now() + kPatience;
  while (controller.counters().clients_accepted < 2 && now() < deadline) ASSERT_TRUE(owner->next());
  for (int i = 0; i < 20; ++i) ASSERT_TRUE(owner->next());  // long enough to be refused at least once
  owner.reset();
  EXPECT_TRUE(second.get());
}

TEST_F(UrRtdeArmOnSimulator, StopsOfTheRobotShowInItsCondition) {
  test::ArmLoop loop(controller.port());
  ASSERT_TRUE(loop.engage());
  const auto becomes = [&](ArmCondition condition) {
    return loop.send_until(ArmAction::kHold, Vector6::Zero(),
                           [=](const ArmState& s) { return s.condition == condition; });
  };
  controller.protective_stop();
  EXPECT_TRUE(becomes(ArmCondition::kProtectiveStop));
  EXPECT_FALSE(loop.state.tracking);
  controller.clear_stop();
  EXPECT_TRUE(becomes(ArmCondition::kReady));
  controller.emergency_stop();
  EXPECT_TRUE(becomes(ArmCondition::kEmergencyStop));
  controller.clear_stop();
  EXPECT_TRUE(becomes(ArmCondition::kReady));
  controller.set_program_running(false);
  EXPECT_TRUE(becomes(ArmCondition::kProgramStopped));
  controller.set_program_running(true);
  EXPECT_TRUE(becomes(ArmCondition::kReady));
  EXPECT_TRUE(loop.engage());
}

TEST_F(UrRtdeArmOnSimulator, RefusesCommandsThatHaveExpiredOrAreNotFinite) {
  test::ArmLoop loop(controller.port());
  ASSERT_TRUE(loop.next());
  ArmCommand command;
  command.action = ArmAction::kTrack;
  EXPECT_EQ(loop.arm->write(command, now()), IoStatus::kRefused) << "no expiry set";
  const TimePoint t = now();
  command.t_expires = t;
  EXPECT_EQ(loop.arm->write(command, t + Duration(1)), IoStatus::kRefused);
  EXPECT_EQ(loop.arm->write(command, t), IoStatus::kDone);
  for (int i = 0; i < 6; ++i) {
    ArmCommand bad = command;
    bad.q_rad[i] = std::nan("");
    EXPECT_EQ(loop.arm->write(bad, t), IoStatus::kRefused);
    bad = command;
    bad.qd_rad_s[i] = HUGE_VAL;
    EXPECT_EQ(loop.arm->write(bad, t), IoStatus::kRefused);
  }
  const TimePoint deadline = now() + kPatience;
  while (controller.counters().command_packages < 2 && now() < deadline) ASSERT_TRUE(loop.next());
  EXPECT_EQ(controller.counters().command_packages, 2U) << "the greeting and the one command that was sent";
}

TEST_F(UrRtdeArmOnSimulator, ReadAndWriteDoNotTouchTheHeap) {
  const std::uint64_t before_control = test::heap_allocations();
  void* volatile block = std::malloc(1);
  std::free(block);
#if !defined(EMBODY_SANITIZED)
  ASSERT_GT(test::heap_allocations(), before_control) << "the counter must count";
#endif
  test::ArmLoop loop(controller.port());
  ASSERT_TRUE(loop.engage());
  std::uint64_t before = test::heap_allocations();
  for (int i = 0; i < 200; ++i) {
    const bool more = loop.next();
    const IoStatus sent = loop.send(ArmAction::kTrack, start);
    if (!more || sent != IoStatus::kDone) break;
  }
  EXPECT_EQ(test::heap_allocations() - before, 0U);
  controller.disconnect_clients();
  before = test::heap_allocations();
  while (loop.next()) {
  }
  loop.send(ArmAction::kTrack, start);
  EXPECT_EQ(test::heap_allocations() - before, 0U);
  EXPECT_GE(loop.state.package, 200U);
}

TEST_F(UrRtdeArmOnSimulator, TheDestructorLeavesModeZeroAndTheArmStill) {
  {
    test::ArmLoop loop(controller.port());
    ASSERT_TRUE(loop.engage());
    ASSERT_TRUE(loop.send_until(ArmAction::kTrack, start + Vector6::Constant(1.0),
                                [](const ArmState& s) { return s.qd_rad_s[0] > 0.3; }));
  }
  const TimePoint deadline = now() + kPatience;
  while (controller.has_client() && now() < deadline) std::this_thread::yield();
  EXPECT_FALSE(controller.has_client());
  while (controller.latest().program_state != ProgramState::kHold && now() < deadline) std::this_thread::yield();
  EXPECT_EQ(controller.latest().program_state, ProgramState::kHold) << "held, not merely stale";
}

TEST_F(UrRtdeArmOnSimulator, ConnectingAgainReleasesTheOldSession) {
  test::ArmLoop loop(controller.port());
  ASSERT_TRUE(loop.engage());
  const auto info = loop.arm->connect();
  ASSERT_TRUE(info.ok()) << info.error().detail.c_str();
  loop.fd = info->fd;
  ASSERT_TRUE(loop.next());
  EXPECT_EQ(loop.state.package, 1U);
  EXPECT_TRUE(loop.engage());
}

}  // namespace
}  // namespace embody
