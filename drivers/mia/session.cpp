// Begin and end of a session with a Mia hand: the part that may wait.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "drivers/mia/mia_hand.hpp"
#include "drivers/transport/clock.hpp"
#include "drivers/transport/tcp.hpp"

namespace embody::mia {
namespace {

constexpr double kRate_hz = 20.0;  ///< what the vendor's own nodes run at; three commands and a read take about 20 ms
constexpr Duration kProbeTime = std::chrono::milliseconds(1800);  ///< a hand may still be starting
constexpr Duration kProbeStep = std::chrono::milliseconds(150);   ///< an adapter without low latency holds bytes 16 ms
constexpr Duration kGoodbyeTime = std::chrono::milliseconds(250);

/// Sends `command` and waits for its ACK and from there on for a line that `done` accepts (it may be the ACK itself).
template <class Done>
bool exchange(HandLine& line, const Command& command, TimePoint deadline, Done done) {
  bool acknowledged = false;
  if (line.send(command) != IoStatus::kDone) return false;
  while (transport::now() < deadline) {
    std::string_view text;
    const IoStatus status = line.receive(text);
    if (status == IoStatus::kDisconnected) return false;
    if (status != IoStatus::kDone) {
      if (!transport::wait_readable(line.fd(), deadline)) return false;
      continue;
    }
    acknowledged = acknowledged || acknowledges(text, command);
    if (acknowledged && done(text)) return true;
  }
  return false;
}

bool answers_ping(HandLine& line, TimePoint deadline) {
  for (bool old_ping = false; transport::now() < deadline; old_ping = !old_ping) {
    const TimePoint until = std::min(deadline, transport::now() + kProbeStep);
    const Command ping = encode_plain(old_ping ? kOldPingPayload : kPingPayload);
    if (exchange(line, ping, until, [](std::string_view) { return true; })) return true;
    if (!transport::wait_readable(line.fd(), until)) continue;
    std::string_view rubbish;  // a dead line is readable at once: do not spin on it
    if (line.receive(rubbish) == IoStatus::kDisconnected) return false;
  }
  return false;
}

std::optional<std::array<int, kMotors>> ask_positions(HandLine& line, TimePoint deadline) {
  std::optional<std::array<int, kMotors>> counts;
  const auto is_position = [&counts](std::string_view text) {
    counts = parse_triple(text, TripleLine::kPosition);
    return counts.has_value();
  };
  for (int i = 0; i < 3; ++i) {
    const TimePoint until = std::min(deadline, transport::now() + kProbeStep);
    if (exchange(line, encode_plain(kReadPositionsPayload), until, is_position)) break;
  }
  return counts;
}

FixedString<28> ask_firmware_id(HandLine& line) {
  FixedString<28> text("firmware id unknown");
  const auto is_firmware = [&text](std::string_view reply) {
    const auto id = parse_firmware_id(reply);
    if (!id) return false;
    std::array<char, 28> printable{};
    std::transform(id->begin(), id->end(), printable.begin(), [](char c) { return c >= ' ' && c <= '~' ? c : '?'; });
    text = std::string_view(printable.data(), id->size());
    return true;
  };
  exchange(line, encode_plain(kFirmwareIdPayload), transport::now() + kProbeStep, is_firmware);
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
  auto line = open_();
  if (!line) return line.error();
  line_ = std::move(*line);
  auto info = probe();
  if (!info) {
    line_.reset();
    return info;
  }
  bus_ = {};
  cycle_ = {};
  told_ = {};
  stop_ = {};
  lost_ = hung_up_ = false;
  reason_ = {};
  return info;
}

Result<HandInfo> MiaHand::probe() {
  const char* device = config_.device.c_str();
  const TimePoint deadline = transport::now() + kProbeTime;
  if (!answers_ping(*line_, deadline)) {
    return make_error(Errc::kTimeout, "no Mia hand answers at %s: check power, cable and device name", device);
  }
  const auto counts = ask_positions(*line_, deadline);
  if (!counts) {
    return make_error(Errc::kUnsupported,
                      "the hand at %s answers but reports no motor positions: its firmware lacks one-shot reads",
                      device);
  }
  reply_ = {};
  std::copy(counts->begin(), counts->end(), reply_.counts.begin());
  HandInfo info;
  info.fd = line_->fd();
  info.rate_hz = kRate_hz;
  info.joint_count = kMotors;
  for (std::size_t i = 0; i < kMotors; ++i) info.joint_names[i] = kJointNames[i];
  std::array<char, 121> peer{};
  std::snprintf(peer.data(), peer.size(), "Mia hand at %s, %s", device, ask_firmware_id(*line_).c_str());
  info.peer = peer.data();
  return info;
}

void MiaHand::end_session() noexcept {
  if (!line_ || hung_up_) {
    line_.reset();
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
      static_cast<void>(transport::wait_readable(line_->fd(), std::min(deadline, bus_.deadline)));
    }
    pump();
  }
  lost_ = hung_up_ = true;
  line_.reset();
}

}  // namespace embody::mia
