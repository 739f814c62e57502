// The arm driver against the simulated controller over TCP, at 500 Hz: a minute of sine with feed-forward, then a step
// of 1 rad. The controller runs the control program's own text. Usage: bench_closed_loop [SECONDS]
//
// Cycles are counted in the robot's time, so a host that stalls shows as late cycles and not as a slow robot; in
// virtual time the same measure is a test (tests/unit/urscript/closed_loop_test.cpp).
#include <poll.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "daemon/app/thread.hpp"
#include "drivers/sim/ur/ur_controller.hpp"
#include "drivers/transport/clock.hpp"
#include "drivers/ur_rtde/ur_rtde_arm.hpp"
#include "tests/support/closed_loop.hpp"

namespace {

using namespace embody;
using test::CycleSample;
using test::Sine;

constexpr double kCycle_s = 0.002;
constexpr double kStep_rad = 1.0;
constexpr double kStepTime_s = 4.0;

/// Target of the sender at a time of the robot's clock.
struct Target {
  ArmAction action{ArmAction::kHold};
  Vector6 q_rad{Vector6::Zero()};
  Vector6 qd_rad_s{Vector6::Zero()};
};

/// Answers each package with one command and remembers when its sequence came back.
class Sender {
 public:
  explicit Sender(UrRtdeArm& arm, int fd) : arm_(arm), fd_(fd) {}

  /// Until the robot's clock has advanced by `seconds`; false when the session ended.
  template <typename Motion>
  bool run(double seconds, Motion&& motion) {
    double begin_s = -1.0;
    for (;;) {
      pollfd entry{fd_, POLLIN, 0};
      ::poll(&entry, 1, 100);
      for (;;) {
        const IoStatus status = arm_.read(state);
        if (status == IoStatus::kDisconnected) return std::fprintf(stderr, "%.*s\n", 200, arm_.reason().data()), false;
        if (status != IoStatus::kDone) break;
        const double t_s = to_seconds(state.controller_time);
        if (begin_s < 0.0) begin_s = t_s;
        note_echo();
        answer(motion(t_s - begin_s));
        if (t_s - begin_s >= seconds) return true;
      }
    }
  }

  ArmState state;
  std::vector<double> echo_cycles;
  std::uint64_t lost_tracking{0};  ///< packages in which the program did not track although it should

 private:
  void answer(const Target& target) {
    if (target.action == ArmAction::kTrack && was_tracking_ && !state.tracking) ++lost_tracking;
    was_tracking_ = state.tracking && target.action == ArmAction::kTrack;
    ArmCommand command;
    command.sequence = ++sequence_;
    command.action = target.action;
    command.q_rad = target.q_rad;
    command.qd_rad_s = target.qd_rad_s;
    const TimePoint now = transport::now();
    command.t_expires = now + std::chrono::milliseconds(20);
    sent_[sequence_ % sent_.size()] = cycle();
    arm_.write(command, now);
  }
  void note_echo() {
    if (state.echo_sequence == echo_ || state.echo_sequence + sent_.size() <= sequence_ || sequence_ == 0) return;
    echo_ = state.echo_sequence;
    echo_cycles.push_back(static_cast<double>(cycle() - sent_[echo_ % sent_.size()]));
  }
  [[nodiscard]] std::int64_t cycle() const { return std::llround(to_seconds(state.controller_time) / kCycle_s); }

  UrRtdeArm& arm_;
  int fd_;
  std::uint32_t sequence_{0};
  std::uint32_t echo_{0};
  bool was_tracking_{false};
  std::array<std::int64_t, 1024> sent_{};  ///< cycle of the package that the command answered, by sequence
};

std::vector<CycleSample> samples_between(const sim::UrController& controller, double begin_s, double end_s) {
  std::vector<CycleSample> samples;
  for (const sim::UrSample& sample : controller.samples()) {
    const double t_s = static_cast<double>(sample.cycle) * kCycle_s;
    if (t_s >= begin_s && t_s < end_s) {
      samples.push_back({t_s - begin_s, sample.q_target_rad, sample.q_rad, sample.qd_rad_s});
    }
  }
  return samples;
}

double quantile(std::vector<double> values, double q) {
  std::sort(values.begin(), values.end());
  return values.at(static_cast<std::size_t>(q * static_cast<double>(values.size() - 1)));
}

void print_sine(const std::vector<CycleSample>& samples, const Sine& sine, const std::vector<double>& echo) {
  const test::SineFollowing result = test::judge_sine(samples, sine);
  std::printf("sine of %.1f rad at %.1f Hz, %zu cycles\n", sine.amplitude_rad, sine.frequency_hz, samples.size());
  std::printf("  command echo, cycles          p50 %.0f  p99 %.0f  max %.0f   (%zu)\n", quantile(echo, 0.5),
              quantile(echo, 0.99), quantile(echo, 1.0), echo.size());
  std::printf("  target_q - command, rad       p99 %.5f  max %.5f\n", result.target_error_p99_rad,
              result.target_error_rad);
  std::printf("  actual_q - command, rad       p99 %.5f  max %.5f   after one lag of %.1f ms\n",
              result.joint_error_p99_rad, result.joint_error_rad, result.lag_s * 1e3);
}

void print_step(const std::vector<CycleSample>& samples, const Vector6& start_rad, const Vector6& goal_rad,
                const rtde::ControlScriptConfig& limits) {
  const test::StepFollowing result = test::judge_step(samples, start_rad, goal_rad, kCycle_s);
  std::printf("step of %.1f rad, all joints settled after %.2f s\n", kStep_rad, result.settled_s);
  const auto row = [](const char* name, const Vector6& values) {
    std::printf("  %-29s", name);
    for (const double value : values) std::printf(" %8.4f", value);
    std::printf("\n");
  };
  row("largest |actual_qd|, rad/s", result.speed_rad_s);
  row("limit", limits.max_velocity_rad_s);
  row("largest |actual_qdd|, rad/s2", result.acceleration_rad_s2);
  row("limit", limits.max_acceleration_rad_s2);
  row("overshoot, rad", result.overshoot_rad);
}

int run(double seconds) {
  sim::UrControllerConfig simulated;
  simulated.log_capacity = static_cast<std::size_t>((seconds + kStepTime_s + 10.0) / kCycle_s);
  sim::UrController controller(simulated);
  if (const Status started = controller.start(); !started) {
    return std::fprintf(stderr, "%s\n", started.error().detail.c_str()), 1;
  }
  UrRtdeConfig config;
  config.port = controller.port();
  config.upload = false;  // the simulated robot plays the program already
  UrRtdeArm arm(config);
  const auto info = arm.connect();
  if (!info) return std::fprintf(stderr, "%s\n", info.error().detail.c_str()), 1;
  const bool fifo = may_use_fifo(46);
  std::printf("scheduling of the sender: %s\n", fifo ? "SCHED_FIFO 46" : "normal (FIFO is not permitted)");

  Sender sender(arm, info->fd);
  int exit_code = 0;
  const auto hold = [&](double) { return Target{}; };
  const auto body = [&] {
    if (!sender.run(0.1, hold)) return void(exit_code = 1);
    Sine sine;
    sine.centre_rad = sender.state.q_rad;
    if (!sender.run(0.1, [&](double) { return Target{ArmAction::kTrack, sine.centre_rad, Vector6::Zero()}; })) {
      return void(exit_code = 1);
    }
    sender.echo_cycles.clear();
    const double begin_s = to_seconds(sender.state.controller_time) + kCycle_s;
    if (!sender.run(seconds, [&](double t_s) {
          return Target{ArmAction::kTrack, sine.q_rad(t_s), sine.qd_rad_s(t_s)};
        })) {
      return void(exit_code = 1);
    }
    const double end_s = to_seconds(sender.state.controller_time);
    print_sine(samples_between(controller, begin_s, end_s), sine, sender.echo_cycles);

    const Vector6 start = sender.state.q_rad;
    if (!sender.run(1.0, [&](double) { return Target{ArmAction::kTrack, start, Vector6::Zero()}; })) {
      return void(exit_code = 1);
    }
    const Vector6 goal = start + Vector6::Constant(kStep_rad);
    const double step_s = to_seconds(sender.state.controller_time) + kCycle_s;
    if (!sender.run(kStepTime_s, [&](double) { return Target{ArmAction::kTrack, goal, Vector6::Zero()}; })) {
      return void(exit_code = 1);
    }
    print_step(samples_between(controller, step_s, to_seconds(sender.state.controller_time)), start, goal,
               config.script);
  };
  {
    Thread thread;
    if (!thread.start({"sender", fifo ? 46 : 0, {}, false}, body)) return 1;
  }
  const sim::UrCounters counters = controller.counters();
  std::printf("cycles %llu, of these late on this host %llu; sequence gaps %llu; tracking lost %llu times\n",
              static_cast<unsigned long long>(counters.cycles), static_cast<unsigned long long>(counters.late_cycles),
              static_cast<unsigned long long>(counters.sequence_gaps),
              static_cast<unsigned long long>(sender.lost_tracking));
  return exit_code;
}

}  // namespace

int main(int argc, char** argv) {
  const double seconds = argc > 1 ? std::atof(argv[1]) : 60.0;
  if (!(seconds >= 5.0 && seconds <= 3600.0)) {
    return std::fprintf(stderr, "usage: bench_closed_loop [SECONDS]   5 to 3600, default 60\n"), 2;
  }
  return run(seconds);
}
