#include "drivers/mia/probe.hpp"

#include <algorithm>

#include "drivers/transport/clock.hpp"
#include "drivers/transport/tcp.hpp"

namespace embody::mia {
namespace {

constexpr Duration kProbeTime = std::chrono::milliseconds(1800);
constexpr Duration kStep = std::chrono::milliseconds(150);  ///< an adapter without low latency holds bytes 16 ms
constexpr Duration kHushStep = std::chrono::milliseconds(60);
constexpr Duration kStreamTime = std::chrono::milliseconds(1000);  ///< stream periods are not documented
constexpr int kTries = 3;

using Counts = std::array<double, kMotors>;

TimePoint in(Duration span) {
  return transport::now() + span;
}

bool anything(std::string_view) {
  return true;
}

/// Waits for a line that `done` accepts. kDone, kEmpty (deadline) or kDisconnected.
IoStatus listen(HandLine& line, TimePoint deadline, const std::function<bool(std::string_view)>& done) {
  while (transport::now() < deadline) {
    std::string_view text;
    const IoStatus status = line.receive(text);
    if (status == IoStatus::kDisconnected) return status;
    if (status == IoStatus::kDone && done(text)) return status;
    if (status != IoStatus::kDone && !transport::wait_readable(line.fd(), deadline)) return IoStatus::kEmpty;
  }
  return IoStatus::kEmpty;
}

bool answers_ping(HandLine& line, TimePoint deadline) {
  for (bool old_ping = false; transport::now() < deadline; old_ping = !old_ping) {
    const TimePoint until = std::min(deadline, in(kStep));
    const Command ping = encode_plain(old_ping ? kOldPingPayload : kPingPayload);
    if (ask(line, ping, until, anything)) return true;
    // Rubbish instead of an answer: do not ping faster for that, and do not spin on a dead line.
    if (listen(line, until, [](std::string_view) { return false; }) == IoStatus::kDisconnected) return false;
  }
  return false;
}

/// What an earlier host left on would fill the line, and could be taken for answers.
void hush(HandLine& line) {
  for (const char channel : {'P', 'S', 'A', 'C'}) {
    static_cast<void>(ask(line, encode_stream(channel, false), in(kHushStep), anything));
  }
}

FixedString<28> ask_firmware_id(HandLine& line) {
  FixedString<28> text("firmware id unknown");
  static_cast<void>(ask(line, encode_plain(kFirmwareIdPayload), in(kStep), [&text](std::string_view reply) {
    const auto id = parse_firmware_id(reply);
    if (!id) return false;
    std::array<char, 28> printable{};
    std::transform(id->begin(), id->end(), printable.begin(), [](char c) { return c >= ' ' && c <= '~' ? c : '?'; });
    text = std::string_view(printable.data(), id->size());
    return true;
  }));
  return text;
}

std::optional<Counts> as_counts(const std::optional<std::array<int, kMotors>>& whole) {
  if (!whole) return std::nullopt;
  return Counts{1.0 * (*whole)[0], 1.0 * (*whole)[1], 1.0 * (*whole)[2]};
}

std::optional<Counts> ask_joint_angles(HandLine& line, TimePoint deadline) {
  std::optional<Counts> q_rad;
  static_cast<void>(ask(line, encode_read('J'), deadline, [&q_rad](std::string_view text) {
    q_rad = parse_joint_positions(text);
    return q_rad.has_value();
  }));
  return q_rad;
}

std::optional<Counts> start_stream(HandLine& line) {
  std::optional<Counts> counts;
  const auto is_position = [&counts](std::string_view text) {
    counts = as_counts(parse_triple(text, TripleLine::kPosition));
    return counts.has_value();
  };
  for (const TimePoint deadline = in(kStreamTime); !counts && transport::now() < deadline;) {
    if (line.send(encode_stream('P', true)) == IoStatus::kDisconnected) break;
    if (listen(line, std::min(deadline, in(2 * kStep)), is_position) == IoStatus::kDisconnected) break;
  }
  return counts;
}

/// The acknowledging generation's positions in the configured space, or nothing.
std::optional<Probed> probe_acknowledging(HandLine& line, const MiaConfig& config) {
  Probed probed;
  probed.firmware = ask_firmware_id(line);
  if (config.space == Space::kJoint) {
    std::optional<Counts> q_rad;
    for (int i = 0; i < kTries && !q_rad; ++i) q_rad = ask_joint_angles(line, in(kStep));
    if (!q_rad) return std::nullopt;
    probed.q_rad = *q_rad;
    probed.counts = motor_counts(config.transmission, *q_rad);
    return probed;
  }
  std::optional<Counts> counts;
  for (int i = 0; i < kTries && !counts; ++i) counts = ask_counts(line, config, in(kStep));
  if (!counts) return std::nullopt;
  probed.counts = *counts;
  probed.q_rad = joint_angles_rad(config.transmission, *counts);
  return probed;
}

}  // namespace

bool ask(HandLine& line, const Command& command, TimePoint deadline,
         const std::function<bool(std::string_view)>& done) {
  if (line.send(command) != IoStatus::kDone) return false;
  bool acknowledged = false;
  return listen(line, deadline, [&](std::string_view text) {
           acknowledged = acknowledged || acknowledges(text, command);
           return acknowledged && done(text);
         }) == IoStatus::kDone;
}

std::optional<Counts> ask_counts(HandLine& line, const MiaConfig& config, TimePoint deadline) {
  if (config.space == Space::kJoint) {
    const auto q_rad = ask_joint_angles(line, deadline);
    if (!q_rad) return std::nullopt;
    return motor_counts(config.transmission, *q_rad);
  }
  std::optional<Counts> counts;
  static_cast<void>(ask(line, encode_read('P'), deadline, [&counts](std::string_view text) {
    counts = as_counts(parse_triple(text, TripleLine::kPosition));
    return counts.has_value();
  }));
  return counts;
}

Result<Probed> probe(HandLine& line, const MiaConfig& config) {
  const char* device = config.device.c_str();
  const bool answered = answers_ping(line, in(kProbeTime));
  if (!answered && config.generation != Generation::kStreaming) {
    return make_error(Errc::kTimeout, "no Mia hand answers at %s: check power, cable and device name", device);
  }
  if (config.generation != Generation::kStreaming) {
    hush(line);
    if (const auto probed = probe_acknowledging(line, config)) return *probed;
    if (config.space == Space::kJoint) {
      return make_error(Errc::kUnsupported,
                        "the hand at %s tells no joint angles: its firmware is older; set space to motor", device);
    }
    if (config.generation == Generation::kAcknowledging) {
      return make_error(Errc::kUnsupported,
                        "the hand at %s answers but reports no motor positions: its firmware lacks one-shot reads",
                        device);
    }
  }
  const auto counts = start_stream(line);
  if (!counts) {
    return make_error(answered ? Errc::kUnsupported : Errc::kTimeout,
                      answered ? "the hand at %s answers but tells no positions, neither on request nor as a stream"
                               : "no Mia hand streams positions at %s: check power, cable and device name",
                      device);
  }
  Probed probed;
  probed.generation = Generation::kStreaming;
  probed.counts = *counts;
  probed.q_rad = joint_angles_rad(config.transmission, *counts);
  return probed;
}

}  // namespace embody::mia
