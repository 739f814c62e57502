#include "drivers/sim/ur/ur_controller.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/math/pose.hpp"
#include "drivers/sim/ur/flange_pose.hpp"
#include "drivers/sim/ur/rtde_server.hpp"
#include "drivers/transport/clock.hpp"

namespace embody::sim {
namespace {

enum Request : unsigned {
  kProtectiveStop = 1U << 0U,
  kEmergencyStop = 1U << 1U,
  kClearStop = 1U << 2U,
  kStopProgram = 1U << 3U,
  kStartProgram = 1U << 4U,
  kDisconnect = 1U << 5U,
};

Vector6 pose_vector(const math::Pose& X_BE) {
  Vector6 pose;
  pose << X_BE.translation(), math::log_so3(X_BE.linear());
  return pose;
}

}  // namespace

/// What belongs to the control thread: robot, server, and the way between the robot and the variables.
class UrController::Loop {
 public:
  explicit Loop(const UrControllerConfig& config) : robot(config.robot), frequency_hz_(config.frequency_hz) {
    server.shared().frequency_hz = config.frequency_hz;
    RtdeVariables& values = server.shared().variables;
    for (const char* name : {"speed_scaling", "target_speed_fraction"}) values.set(values.at(name), 1.0);
    values.set(values.at("time_scale_source"), std::int32_t{1});
  }

  void apply(unsigned requests) {
    if ((requests & kClearStop) != 0) robot.clear_stop();
    if ((requests & kStopProgram) != 0) robot.set_program_running(false);
    if ((requests & kStartProgram) != 0) robot.set_program_running(true);
    if ((requests & kProtectiveStop) != 0) robot.protective_stop();
    if ((requests & kEmergencyStop) != 0) robot.emergency_stop();
    if ((requests & kDisconnect) != 0) server.disconnect_all();
  }

  [[nodiscard]] RegisterInputs inputs() {
    RtdeVariables& values = server.shared().variables;
    RegisterInputs in;
    in.sequence = values.get<std::int32_t>(sequence_in_);
    in.mode = values.get<std::int32_t>(mode_in_);
    for (int i = 0; i < 6; ++i) {
      in.q_target_rad[i] = values.get<double>(targets_in_[static_cast<std::size_t>(i)]);
      in.qd_target_rad_s[i] = values.get<double>(targets_in_[static_cast<std::size_t>(i) + 6]);
    }
    return in;
  }

  void write_outputs(std::uint64_t cycle) {
    RtdeVariables& values = server.shared().variables;
    values.set(timestamp_, static_cast<double>(cycle) / frequency_hz_);
    values.set_vector(actual_q_, robot.q_rad());
    values.set_vector(actual_qd_, robot.qd_rad_s());
    values.set_vector(target_q_, robot.q_target_rad());
    values.set_vector(target_qd_, robot.qd_target_rad_s());
    values.set_vector(tcp_pose_, pose_vector(ur10e_flange_pose(robot.q_rad())));
    const SafetyStatus& safety = robot.safety();
    values.set(robot_mode_, safety.robot_mode);
    values.set(safety_mode_, safety.safety_status);
    values.set(safety_status_, safety.safety_status);
    values.set(runtime_state_, safety.runtime_state);
    values.set(robot_bits_, safety.robot_status_bits);
    values.set(safety_bits_, safety.safety_status_bits);
    const RegisterOutputs& registers = robot.registers();
    values.set(echo_, registers.sequence);
    values.set(state_, static_cast<std::int32_t>(registers.state));
    values.set(fault_, static_cast<std::int32_t>(registers.fault));
    values.set(version_, registers.version);
  }

  RtdeServer server;
  UrRobot robot;

 private:
  using Index = RtdeVariables::Index;
  [[nodiscard]] Index at(std::string_view name) { return server.shared().variables.at(name); }
  [[nodiscard]] std::array<Index, 12> find_targets() {
    std::array<Index, 12> targets{};
    for (std::size_t i = 0; i < targets.size(); ++i) targets[i] = at("input_double_register_" + std::to_string(24 + i));
    return targets;
  }

  double frequency_hz_;
  Index sequence_in_{at("input_int_register_24")};
  Index mode_in_{at("input_int_register_25")};
  std::array<Index, 12> targets_in_{find_targets()};
  Index timestamp_{at("timestamp")};
  Index actual_q_{at("actual_q")};
  Index actual_qd_{at("actual_qd")};
  Index target_q_{at("target_q")};
  Index target_qd_{at("target_qd")};
  Index tcp_pose_{at("actual_TCP_pose")};
  Index robot_mode_{at("robot_mode")};
  Index safety_mode_{at("safety_mode")};
  Index safety_status_{at("safety_status")};
  Index runtime_state_{at("runtime_state")};
  Index robot_bits_{at("robot_status_bits")};
  Index safety_bits_{at("safety_status_bits")};
  Index echo_{at("output_int_register_24")};
  Index state_{at("output_int_register_25")};
  Index fault_{at("output_int_register_26")};
  Index version_{at("output_int_register_27")};
};

UrController::UrController(UrControllerConfig config) : config_(std::move(config)) {}

UrController::~UrController() {
  stop();
}

Status UrController::start() {
  if (loop_) return make_error(Errc::kInvalidArgument, "the simulated controller runs already");
  if (!(config_.frequency_hz >= 1.0 && config_.frequency_hz <= 1000.0)) {
    return make_error(Errc::kInvalidArgument, "the simulated controller's frequency is %g Hz; choose 1 to 1000",
                      config_.frequency_hz);
  }
  if (!config_.robot.q_start_rad.allFinite() || config_.log_capacity == 0) {
    return make_error(Errc::kInvalidArgument, "the simulated controller needs finite start angles and a log");
  }
  auto loop = std::make_unique<Loop>(config_);
  if (const Status listening = loop->server.listen(config_.address, config_.port); !listening) return listening;
  port_ = loop->server.port();
  loop_ = std::move(loop);
  log_.assign(config_.log_capacity, {});
  logged_ = 0;
  counters_ = {};
  requests_ = 0;
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
  return {};
}

void UrController::stop() noexcept {
  thread_ = {};  // asks and waits
  loop_.reset();
  has_client_ = false;
  port_ = 0;
}

UrCounters UrController::counters() const {
  const std::scoped_lock lock(mutex_);
  return counters_;
}

UrSample UrController::latest() const {
  const std::scoped_lock lock(mutex_);
  return logged_ == 0 ? UrSample{} : log_[(logged_ - 1) % log_.size()];
}

std::vector<UrSample> UrController::samples() const {
  const std::scoped_lock lock(mutex_);
  std::vector<UrSample> samples;
  const std::size_t count = std::min(logged_, log_.size());
  samples.reserve(count);
  for (std::size_t i = logged_ - count; i < logged_; ++i) samples.push_back(log_[i % log_.size()]);
  return samples;
}

void UrController::protective_stop() noexcept {
  requests_ |= kProtectiveStop;
}

void UrController::emergency_stop() noexcept {
  requests_ |= kEmergencyStop;
}

void UrController::clear_stop() noexcept {
  requests_ |= kClearStop;
}

void UrController::set_program_running(bool running) noexcept {
  requests_ |= running ? kStartProgram : kStopProgram;
}

void UrController::disconnect_clients() noexcept {
  requests_ |= kDisconnect;
}

void UrController::run(const std::stop_token& stop) {
  constexpr std::uint64_t kMostCaughtUp = 5000;  // a suspended host does not get its hours back
  const auto period = Duration(std::llround(1e9 / config_.frequency_hz));
  const TimePoint start = transport::now();
  UrCounters counters;
  std::uint64_t done = 0;
  while (!stop.stop_requested()) {
    std::this_thread::sleep_until(start + static_cast<std::int64_t>(done + 1) * period);
    const auto due = std::max(done + 1, static_cast<std::uint64_t>((transport::now() - start) / period));
    loop_->apply(requests_.exchange(0));
    if (!frozen_) loop_->server.receive(config_.max_clients);
    const RegisterInputs inputs = loop_->inputs();
    const std::uint64_t first = due - std::min(due - done, kMostCaughtUp) + 1;
    for (std::uint64_t cycle = first; cycle <= due; ++cycle) {
      loop_->robot.step(inputs, period);
      log(start + static_cast<std::int64_t>(cycle) * period, cycle);
    }
    loop_->write_outputs(due);
    if (!frozen_) loop_->server.publish(done, due);
    has_client_ = loop_->server.has_commanding_client();
    counters.cycles += due - first + 1;
    counters.late_cycles += due - done - 1;
    static_cast<RtdeCounters&>(counters) = loop_->server.shared().counters;
    done = due;
    const std::scoped_lock lock(mutex_);
    counters_ = counters;
  }
}

void UrController::log(TimePoint t, std::uint64_t cycle) {
  const UrRobot& robot = loop_->robot;
  const UrSample sample{t, cycle, robot.q_rad(), robot.qd_rad_s(), robot.q_target_rad(), robot.registers().state};
  const std::scoped_lock lock(mutex_);
  log_[logged_++ % log_.size()] = sample;
}

}  // namespace embody::sim
