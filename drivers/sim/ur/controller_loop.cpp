#include "drivers/sim/ur/controller_loop.hpp"

#include <algorithm>

#include "drivers/ur_rtde/ur_models.hpp"

namespace embody::sim {
namespace {

constexpr int kReadOnly = 210;
constexpr int kWarning = 2;

/// "ur10e" calls itself "UR10" on the dashboard.
std::string dashboard_name(std::string model) {
  if (!model.empty() && model.back() == 'e') model.pop_back();
  std::transform(model.begin(), model.end(), model.begin(),
                 [](char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 32) : c; });
  return model;
}

}  // namespace

ControllerLoop::ControllerLoop(const UrControllerConfig& config)
    : config_(config), values_(server_.shared().variables), robot_(config.robot), settings_(config.settings) {
  RtdeShared& shared = server_.shared();
  shared.frequency_hz = config.frequency_hz;
  shared.version = config.version;
  shared.missing = config.missing;
  const auto& v = config.version;
  dashboard_info_.version = std::to_string(v.major) + "." + std::to_string(v.minor) + "." + std::to_string(v.bugfix) +
                            "." + std::to_string(v.build);
  dashboard_info_.model = dashboard_name(config.model);
  SafetyMachine& machine = robot_.machine();
  machine.set_times(config.times);
  machine.set_remote(config.remote);
  if (!config.powered) machine.power_off();
  values_.write_settings(settings_);
}

Status ControllerLoop::listen() {
  const auto model = ur::find_model(config_.model);
  if (!model) return model.error();
  kinematics_ = ur::nominal_kinematics(**model);
  kinematics_.checksum.fill(0xFFFF'FFFF);  // what a simulated arm of the vendor's has
  const std::string& address = config_.address;
  if (const Status done = server_.listen(address, config_.port); !done) return done;
  if (const Status done = primary_.listen(address, config_.primary_port); !done) return done;
  if (const Status done = secondary_.listen(address, config_.secondary_port); !done) return done;
  if (const Status done = realtime_.listen(address, config_.realtime_port); !done) return done;
  return config_.version.major >= 10 ? Status{} : dashboard_.listen(address, config_.dashboard_port);
}

ControllerPorts ControllerLoop::ports() const noexcept {
  return {server_.port(), primary_.port(), secondary_.port(), realtime_.port(), dashboard_.port()};
}

void ControllerLoop::receive(TimePoint now) {
  now_ = now;
  if (frozen()) return;
  if (!faults_.deaf) server_.receive(config_.max_clients, now);
  for (ScriptPort* port : {&primary_, &secondary_, &realtime_}) {
    const auto greet = [&] { return port == &primary_ ? greeting() : std::vector<Message>{}; };
    for (const std::string& program : port->receive(greet)) take_program(program);
  }
  dashboard_.serve(robot_, dashboard_info_);
  inputs_ = values_.inputs(server_.shared().counters.command_packages);
  if (const auto fraction = values_.speed_slider()) robot_.machine().set_speed_slider(*fraction);
}

void ControllerLoop::step(Duration dt) noexcept {
  robot_.step(inputs_, dt);
  ++cycle_;
}

void ControllerLoop::publish(std::uint64_t previous, std::uint64_t cycle) {
  if (!faults_.clock_stands) {
    const double timestamp_s = static_cast<double>(cycle - std::min(cycle, first_cycle_)) / config_.frequency_hz;
    values_.write(robot_, timestamp_s, tcp_pose());
  }
  send_texts();
  if (frozen()) return;
  server_.publish(previous, cycle);
  publish_streams(previous, cycle);
}

/// Robot states at 10 Hz, and each cycle on port 30003.
void ControllerLoop::publish_streams(std::uint64_t previous, std::uint64_t cycle) {
  const auto period = static_cast<std::uint64_t>(std::max(1.0, config_.frequency_hz / 10.0));
  if (realtime_.clients() > 0) realtime_.send(encode_realtime_state(report()));
  if (previous / period == cycle / period || primary_.clients() + secondary_.clients() == 0) return;
  const Message state = encode_robot_state(report(), nullptr);
  primary_.send(state);
  secondary_.send(state);
}

void ControllerLoop::restart_rtde() noexcept {
  server_.disconnect_all();
  first_cycle_ = cycle_;
}

void ControllerLoop::set_remote(bool remote) noexcept {
  if (robot_.machine().remote() && !remote) {
    for (ScriptPort* port : {&primary_, &secondary_, &realtime_}) port->disconnect_all();
  }
  robot_.machine().set_remote(remote);
}

RobotReport ControllerLoop::report() {
  RobotReport report;
  report.controller_time_s = static_cast<double>(cycle_ - first_cycle_) / config_.frequency_hz;
  report.safety = robot_.safety();
  report.speed_slider = robot_.machine().speed_slider();
  report.q_rad = robot_.q_rad();
  report.qd_rad_s = robot_.qd_rad_s();
  report.q_target_rad = robot_.q_target_rad();
  report.tcp_pose = tcp_pose();
  report.payload_kg = settings_.payload_kg;
  return report;
}

math::Vector6 ControllerLoop::tcp_pose() const {
  const auto& tcp = settings_.tcp;
  const math::Pose X_ET = math::pose_from({tcp[0], tcp[1], tcp[2]}, {tcp[3], tcp[4], tcp[5]});
  const math::Pose X_BT = ur::flange_pose(kinematics_, robot_.q_rad()) * X_ET;
  math::Vector6 pose;
  pose << X_BT.translation(), math::log_so3(X_BT.linear());
  return pose;
}

std::vector<Message> ControllerLoop::greeting() {
  return {encode_version(config_.version), encode_robot_state(report(), &kinematics_)};
}

void ControllerLoop::take_program(const std::string& program) {
  if (!robot_.machine().remote() || faults_.refuse_upload) {
    primary_.send(encode_error_code(kReadOnly, 0, kWarning, "socket is read-only when in local control"));
    return;
  }
  if (program.starts_with("stop program")) return robot_.set_program_running(false);
  if (!robot_.machine().may_move()) return;  // a controller in this mode ignores it
  const bool block = program.starts_with("def ") || program.starts_with("sec ");
  // What is wrong with it comes back as one of the robot's texts.
  (void)robot_.load_program(block ? program : "def unnamed():\n  " + program + "end\n");
}

void ControllerLoop::send_texts() {
  constexpr int kViolation = 3;
  while (const auto text = robot_.next_text()) {
    switch (text->kind) {
      case RobotText::Kind::kException:
        primary_.send(encode_runtime_exception(text->line, text->column, text->text.view()));
        break;
      case RobotText::Kind::kStopCode:
        primary_.send(encode_error_code(text->code, text->argument, kViolation, text->text.view()));
        break;
      case RobotText::Kind::kStarted:
        primary_.send(encode_key_message("PROGRAM_XXX_STARTED", text->text.view()));
        break;
      case RobotText::Kind::kStopped:
        primary_.send(encode_key_message("PROGRAM_XXX_STOPPED", text->text.view()));
        break;
      case RobotText::Kind::kPopup:
        robot_.machine().show_popup(text->text.view());
        break;
      case RobotText::Kind::kText:
        primary_.send(encode_text_message(text->text.view()));
        break;
    }
  }
}

}  // namespace embody::sim
