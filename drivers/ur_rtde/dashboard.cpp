#include "drivers/ur_rtde/dashboard.hpp"

#include <algorithm>
#include <array>
#include <thread>

#include "drivers/transport/clock.hpp"
#include "drivers/transport/tcp.hpp"
#include "drivers/ur_rtde/status_text.hpp"

namespace embody::ur {
namespace {

constexpr int kIdle = 5;
constexpr int kRunning = 7;
constexpr std::size_t kLongestReply = 4096;

/// The command as one line of printable characters: nothing a caller passes can become a second command.
std::string one_line(std::string_view command) {
  constexpr std::size_t kLongest = 240;
  std::string line(command.substr(0, kLongest));
  std::replace_if(
      line.begin(), line.end(), [](char c) { return static_cast<unsigned char>(c) < ' '; }, ' ');
  return line;
}

}  // namespace

Dashboard::Dashboard(DashboardConfig config) : config_(std::move(config)) {}

Result<int> Dashboard::robot_mode() {
  const auto reply = ask("robotmode");
  return reply ? parse_robot_mode(*reply) : reply.error();
}

Result<int> Dashboard::safety_status() {
  auto reply = ask("safetystatus");
  if (reply && reply->starts_with("could not understand")) reply = ask("safetymode");  // before 5.4
  return reply ? parse_safety_status(*reply) : reply.error();
}

Result<bool> Dashboard::in_remote_control() {
  const auto reply = ask("is in remote control");
  return reply ? parse_flag(*reply) : reply.error();
}

Result<std::string> Dashboard::polyscope_version() {
  const auto reply = ask("PolyscopeVersion");
  return reply ? parse_polyscope_version(*reply) : reply.error();
}

Result<std::string> Dashboard::serial_number() {
  return ask("get serial number");
}

Result<std::string> Dashboard::robot_model() {
  return ask("get robot model");
}

Status Dashboard::power_on() {
  return request("power on", "Powering on");
}

Status Dashboard::power_off() {
  return request("power off", "Powering off");
}

Status Dashboard::release_brakes() {
  return request("brake release", "Brake releasing");
}

Status Dashboard::unlock_protective_stop() {
  return request("unlock protective stop", "Protective stop releasing");
}

Status Dashboard::close_safety_popup() {
  return request("close safety popup", "closing safety popup");
}

Status Dashboard::close_popup() {
  return request("close popup", "closing popup");
}

Status Dashboard::popup(std::string_view text) {
  return request("popup " + std::string(text.substr(0, 200)), "showing popup");
}

Status Dashboard::stop_program() {
  return request("stop", "Stopped");
}

Status Dashboard::bring_up(const BringUpConfig& config, const std::function<bool()>& cancelled) {
  const auto safety = safety_status();
  if (!safety) return safety.error();
  if (*safety != 1 && *safety != 2) {
    return make_error(Errc::kRefused, "the robot is not brought up: its safety status is %s; release that first",
                      rtde::safety_text(*safety));
  }
  auto mode = robot_mode();
  if (!mode) return mode.error();
  if (*mode == kRunning) return {};
  if (*mode != kIdle) {
    if (const Status done = power_on(); !done) return done;
    const TimePoint by = transport::now() + config.power_timeout;
    if (const Status done = wait_for_mode(kIdle, by, config, cancelled); !done) return done;
  }
  if (const Status done = release_brakes(); !done) return done;
  return wait_for_mode(kRunning, transport::now() + config.brake_timeout, config, cancelled);
}

Status Dashboard::wait_for_mode(int wanted, TimePoint deadline, const BringUpConfig& config,
                                const std::function<bool()>& cancelled) {
  while (true) {
    const auto mode = robot_mode();
    if (!mode) return mode.error();
    if (*mode == wanted) return {};
    if (cancelled && cancelled()) {
      return make_error(Errc::kRefused, "bringing up the robot was cancelled; it is now: %s",
                        rtde::robot_mode_text(*mode));
    }
    if (transport::now() >= deadline) {
      return make_error(Errc::kTimeout, "the robot does not become '%s'; it stays: %s", rtde::robot_mode_text(wanted),
                        rtde::robot_mode_text(*mode));
    }
    std::this_thread::sleep_for(config.poll_period);
  }
}

Status Dashboard::request(std::string_view command, std::string_view expected) {
  const auto reply = ask(command);
  return reply ? check_acknowledged(command, *reply, expected) : reply.error();
}

// A connection that died since the last call shows in the first attempt only: try once more.
Result<std::string> Dashboard::ask(std::string_view command) {
  if (config_.controller_major >= 10) {
    return make_error(Errc::kUnsupported, "there is no dashboard on PolyScope X: use the teach pendant");
  }
  const std::string line = one_line(command) + "\n";
  const bool fresh = !fd_;
  const TimePoint deadline = transport::now() + config_.reply_timeout;
  if (const Status connected = connect(deadline); !connected) return connected.error();
  Status sent = transport::send_all(fd_.get(), std::as_bytes(std::span(line)), deadline);
  auto reply = sent ? receive_line(deadline) : Result<std::string>(sent.error());
  if (reply) return reply;
  fd_.reset();
  if (!fresh && reply.error().code == Errc::kDisconnected) return ask(command);
  return make_error(reply.error().code, "dashboard of %s:%u, '%s': %s", config_.host.c_str(), unsigned{config_.port},
                    one_line(command).c_str(), reply.error().detail.c_str());
}

Status Dashboard::connect(TimePoint deadline) {
  if (fd_) return {};
  auto fd = transport::tcp_connect(config_.host, config_.port, deadline);
  if (!fd) {
    return make_error(fd.error().code, "no dashboard server: %s; is the controller on?", fd.error().detail.c_str());
  }
  fd_ = std::move(*fd);
  pending_.clear();
  const auto banner = receive_line(deadline);
  if (banner && banner->find("Dashboard Server") != std::string::npos) return {};
  fd_.reset();
  if (!banner) return banner.error();
  return make_error(Errc::kMalformed, "%s:%u is not a dashboard server of Universal Robots", config_.host.c_str(),
                    unsigned{config_.port});
}

Result<std::string> Dashboard::receive_line(TimePoint deadline) {
  std::string line;
  std::array<std::byte, 512> bytes;
  while (!take_line(pending_, line)) {
    if (pending_.size() > kLongestReply) return make_error(Errc::kMalformed, "the dashboard's reply never ends");
    if (!transport::wait_readable(fd_.get(), deadline)) {
      return make_error(Errc::kTimeout, "the dashboard does not answer within %.1f s",
                        to_seconds(config_.reply_timeout));
    }
    const auto received = transport::receive(fd_.get(), bytes);
    if (received.status == IoStatus::kDisconnected) {
      return make_error(Errc::kDisconnected, "the dashboard closed the connection");
    }
    pending_.append(reinterpret_cast<const char*>(bytes.data()), received.size);
  }
  return line;
}

}  // namespace embody::ur
