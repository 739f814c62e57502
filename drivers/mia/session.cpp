// Begin and end of a session with a Mia hand: the part that may wait.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "drivers/mia/mia_hand.hpp"
#include "drivers/transport/clock.hpp"
#include "drivers/transport/tty.hpp"

namespace embody::mia {
namespace {

constexpr double kRate_hz = 20.0;  ///< what the vendor's own nodes run at; three commands and a read take about 20 ms
constexpr Duration kProbeTime = std::chrono::milliseconds(1800);  ///< a hand may still be starting
constexpr Duration kProbeStep = std::chrono::milliseconds(150);   ///< an adapter without low latency holds bytes 16 ms
constexpr Duration kGoodbyeTime = std::chrono::milliseconds(250);

/// Sends `command` and waits for its ACK and from there on for a line that `done` accepts (it may be the ACK itself).
template <class Done>
bool exchange(int fd, const Command& command, TimePoint deadline, Done done) {
  LineAssembler lines;
  bool acknowledged = false;
  if (transport::write_tty(fd, std::as_bytes(std::span(command))) != IoStatus::kDone) return false;
  while (transport::now() < deadline && transport::wait_readable(fd, deadline)) {
    std::array<std::byte, 256> buffer;
    const auto [status, size] = transport::read_tty(fd, buffer);
    if (status == IoStatus::kDisconnected) return false;
    for (std::size_t i = 0; i < size; ++i) {
      if (!lines.push(static_cast<char>(buffer[i]))) continue;
      acknowledged = acknowledged || acknowledges(lines.line(), command);
      if (acknowledged && done(lines.line())) return true;
    }
  }
  return false;
}

bool answers_ping(int fd, TimePoint deadline) {
  for (bool old_ping = false; transport::now() < deadline; old_ping = !old_ping) {
    const TimePoint until = std::min(deadline, transport::now() + kProbeStep);
    const Command ping = encode_plain(old_ping ? kOldPingPayload : kPingPayload);
    if (exchange(fd, ping, until, [](std::string_view) { return true; })) return true;
    if (!transport::wait_readable(fd, until)) continue;
    std::array<std::byte, 256> buffer;  // a dead line is readable at once: do not spin on it
    if (transport::read_tty(fd, buffer).status == IoStatus::kDisconnected) return false;
  }
  return false;
}

std::optional<std::array<int, kMotors>> ask_positions(int fd, TimePoint deadline) {
  std::optional<std::array<int, kMotors>> counts;
  const auto is_position = [&counts](std::string_view line) {
    counts = parse_triple(line, TripleLine::kPosition);
    return counts.has_value();
  };
  for (int i = 0; i < 3; ++i) {
    const TimePoint until = std::min(deadline, transport::now() + kProbeStep);
    if (exchange(fd, encode_plain(kReadPositionsPayload), until, is_position)) break;
  }
  return counts;
}

FixedString<28> ask_firmware_id(int fd) {
  FixedString<28> text("firmware id unknown");
  const auto is_firmware = [&text](std::string_view line) {
    const auto id = parse_firmware_id(line);
    if (!id) return false;
    std::array<char, 28> printable{};
    std::transform(id->begin(), id->end(), printable.begin(), [](char c) { return c >= ' ' && c <= '~' ? c : '?'; });
    text = std::string_view(printable.data(), id->size());
    return true;
  };
  exchange(fd, encode_plain(kFirmwareIdPayload), transport::now() + kProbeStep, is_firmware);
  return text;
}

Status check_config(const MiaConfig& config) {
  if (const Status transmission = check(config.transmission); !transmission) return transmission;
  for (std::size_t i = 0; i < kMotors; ++i) {
    if (std::isfinite(config.min_rad[i]) && std::isfinite(config.max_rad[i]) && config.min_rad[i] <= config.max_rad[i])
      continue;
    return make_error(Errc::kInvalidArgument, "mia: the limits of %s are not a range", kJointNames[i]);
  }
  if (config.speed_percent < 1 || config.speed_percent > 99) {
    return make_error(Errc::kInvalidArgument, "mia: speed_percent is %d, must be 1..99", config.speed_percent);
  }
  if (config.ack_timeout <= Duration::zero() || config.lost_after_timeouts < 1) {
    return make_error(Errc::kInvalidArgument, "mia: ack_timeout and lost_after_timeouts must be positive");
  }
  return {};
}

}  // namespace

Result<HandInfo> MiaHand::connect() {
  end_session();
  if (const Status usable = check_config(config_); !usable) return usable.error();
  auto tty = transport::open_tty(config_.device);
  if (!tty) return tty.error();
  fd_ = std::move(tty->fd);
  auto info = probe();
  if (!info) {
    fd_.reset();
    return info;
  }
  lines_.clear();
  bus_ = {};
  cycle_ = {};
  told_ = {};
  stop_ = {};
  lost_ = hung_up_ = false;
  reason_ = {};
  return info;
}

Result<HandInfo> MiaHand::probe() {
  const int fd = fd_.get();
  const char* device = config_.device.c_str();
  const TimePoint deadline = transport::now() + kProbeTime;
  if (!answers_ping(fd, deadline)) {
    return make_error(Errc::kTimeout, "no Mia hand answers at %s: check power, cable and device name", device);
  }
  const auto counts = ask_positions(fd, deadline);
  if (!counts) {
    return make_error(Errc::kUnsupported,
                      "the hand at %s answers but reports no motor positions: its firmware lacks one-shot reads",
                      device);
  }
  reply_ = {};
  std::copy(counts->begin(), counts->end(), reply_.counts.begin());
  HandInfo info;
  info.fd = fd;
  info.rate_hz = kRate_hz;
  info.joint_count = kMotors;
  for (std::size_t i = 0; i < kMotors; ++i) info.joint_names[i] = kJointNames[i];
  std::array<char, 121> peer{};
  std::snprintf(peer.data(), peer.size(), "Mia hand at %s, %s", device, ask_firmware_id(fd).c_str());
  info.peer = peer.data();
  return info;
}

void MiaHand::end_session() noexcept {
  if (!fd_ || hung_up_) {
    fd_.reset();
    return;
  }
  stop_.acknowledged = false;  // say it again, whatever was said before
  request_stop();
  cycle_.read_pending = false;
  lost_ = false;
  const TimePoint deadline = transport::now() + kGoodbyeTime;
  const auto busy = [this] { return stop_.phase != StopPhase::kOver || bus_.waiting != Waiting::kNothing; };
  while (busy() && !lost_ && transport::now() < deadline) {
    if (bus_.waiting != Waiting::kNothing) {
      static_cast<void>(transport::wait_readable(fd_.get(), std::min(deadline, bus_.deadline)));
    }
    pump();
  }
  lost_ = hung_up_ = true;
  fd_.reset();
}

}  // namespace embody::mia
