#include "tests/unit/capture/replay_drivers.hpp"

#include <algorithm>
#include <cstdio>

#include "drivers/mia/can_line.hpp"
#include "drivers/mia/compact/mia_can_hand.hpp"
#include "drivers/mia/mia_hand.hpp"
#include "drivers/qualisys/qualisys_tracker.hpp"
#include "drivers/transport/clock.hpp"
#include "drivers/transport/tcp.hpp"
#include "drivers/ur_rtde/ur_rtde_arm.hpp"
#include "tests/unit/capture/device_captures.hpp"

namespace embody::test {
namespace {

using capture::CanReplay;
using capture::CanReplayAs;
using capture::Capture;
using capture::ReplayDevice;
using capture::ReplayOptions;

constexpr Duration kPatience = std::chrono::seconds(20);  // of the drivers too: one byte at a time takes its time

std::string hex(double value) {
  char text[40];
  std::snprintf(text, sizeof text, " %a", value);
  return text;
}

template <class Values>
std::string all_hex(const Values& values, std::size_t count) {
  std::string text;
  for (std::size_t i = 0; i < count; ++i) text += hex(values[static_cast<long>(i)]);
  return text;
}

std::string line_of(const MarkerFrame& frame) {
  std::string line = std::to_string(frame.frame_number) + " epoch " + std::to_string(frame.label_epoch);
  for (std::size_t i = 0; i < frame.count; ++i) {
    const Marker& marker = frame.markers[i];
    line += marker.visible ? all_hex(marker.p_W, 3) + hex(marker.confidence) : " -";
  }
  return line + (frame.body.visible ? all_hex(frame.body.X_W.matrix().reshaped(), 16) : " -");
}

std::string line_of(const ArmState& state) {
  return std::to_string(state.package) + " " + std::to_string(state.controller_time.count()) + all_hex(state.q_rad, 6) +
         all_hex(state.qd_rad_s, 6) + all_hex(state.q_target_rad, 6) + " " +
         std::to_string(static_cast<int>(state.condition)) + " " + std::to_string(state.robot_mode) + " " +
         std::to_string(state.safety_status) + hex(state.speed_scaling);
}

std::string line_of(const HandDeviceState& state) {
  std::string line = std::to_string(state.reply);
  for (std::size_t i = 0; i < state.joint_count; ++i) line += hex(state.q_rad[i]);
  return line;
}

/// The device itself ends the session.
bool breaks_off(const Capture& capture) {
  const auto& last = capture.chunks.back();
  return last.event == capture::Event::kClose && last.by == capture::End::kDevice;
}

/// Connects and reads to the end of the capture or of the session; `act` sends what the driver has to say after so many
/// readings.
template <class Reading, class Device, class Driver, class Act>
Replayed run(const Capture& capture, Device& device, Driver& driver, Act act) {
  Replayed result;
  const auto info = driver.connect();
  if (!info) {
    result.failure = std::string(info.error().detail.view());
    return result;
  }
  const TimePoint deadline = transport::now() + kPatience;
  Reading reading;
  while (true) {
    const bool finished = !breaks_off(capture) && device.finished();  // before reading: all that was sent is here
    const IoStatus status = driver.read(reading);
    if (status == IoStatus::kDone) {
      result.readings.push_back(line_of(reading));
    } else if (status == IoStatus::kDisconnected) {
      result.failure = std::string(driver.reason());
      break;
    } else if (finished) {
      break;
    } else if (transport::now() > deadline) {
      result.failure = "the capture does not come to its end";
      break;
    } else {
      act(result.readings.size());
      static_cast<void>(transport::wait_readable(info->fd, transport::now() + std::chrono::milliseconds(1)));
    }
  }
  result.report = device.report();
  return result;
}

constexpr auto kSayNothing = [](std::size_t) {};

/// kHold whenever the last position has come.
template <class Device>
Replayed run_hand(const Capture& capture, Device& device, HandDriver& hand) {
  std::size_t holds = 0;
  return run<HandDeviceState>(capture, device, hand, [&](std::size_t replies) {
    if (holds > replies) return;
    HandCommand hold;
    hold.t_expires = transport::now() + kPatience;
    if (hand.write(hold, transport::now()) == IoStatus::kDone) ++holds;
  });
}

}  // namespace

Replayed replay_tracker(const Capture& capture, ReplayOptions options, const std::vector<std::string>& markers) {
  ReplayDevice device(capture, options);
  if (const Status started = device.start(); !started) return {{}, std::string(started.error().detail.view()), {}};
  qualisys::QualisysConfig config;
  config.port = device.port();
  config.reply_timeout = kPatience;
  config.backlog_limit = kPatience;  // no frame is left out because a replay is slower or faster than its clock
  qualisys::QualisysTracker tracker(config, markers);
  return run<MarkerFrame>(capture, device, tracker, kSayNothing);
}

Replayed replay_arm(const Capture& capture, ReplayOptions options, double frequency_hz) {
  ReplayDevice device(capture, options);
  if (const Status started = device.start(); !started) return {{}, std::string(started.error().detail.view()), {}};
  UrRtdeConfig config;
  config.port = device.port();
  config.frequency_hz = frequency_hz;
  config.reply_timeout = kPatience;
  config.stale_after = kPatience;
  config.upload = false;
  UrRtdeArm arm(config);
  return run<ArmState>(capture, device, arm, kSayNothing);
}

Replayed replay_hand(const Capture& capture, ReplayOptions options) {
  ReplayDevice device(capture, options);
  if (const Status started = device.start(); !started) return {{}, std::string(started.error().detail.view()), {}};
  mia::MiaConfig config;
  config.device = device.device();
  config.telemetry.every_cycles = kSerialTelemetry_cycles;
  config.ack_timeout = std::chrono::seconds(2);
  mia::MiaHand hand(config);
  return run_hand(capture, device, hand);
}

Replayed replay_can_tunnel(const Capture& capture, CanReplayAs as) {
  CanReplay device(capture, as);
  if (const Status started = device.start(); !started) return {{}, std::string(started.error().detail.view()), {}};
  mia::CanTunnelConfig tunnel;
  tunnel.interface = device.interface();
  tunnel.framing = as == CanReplayAs::kFrames ? mia::CanFraming::kSegments : mia::CanFraming::kIsoTp;
  tunnel.message_timeout = kPatience;
  mia::MiaConfig config;
  config.device = tunnel.interface;
  config.telemetry.every_cycles = kTunnelTelemetry_cycles;
  config.ack_timeout = std::chrono::seconds(2);
  mia::MiaHand hand(config, mia::can_line(tunnel));
  return run_hand(capture, device, hand);
}

Replayed replay_can_compact(const Capture& capture) {
  mia::compact::CompactConfig config;
  CanReplay device(capture, CanReplayAs::kFrames, {config.ids.at(mia::compact::kHeartbeatId)});
  if (const Status started = device.start(); !started) return {{}, std::string(started.error().detail.view()), {}};
  config.interface = device.interface();
  config.ack_timeout = std::chrono::seconds(2);
  config.state_timeout = kPatience;
  mia::compact::MiaCanHand hand(config);
  Replayed result = run_hand(capture, device, hand);
  if (!result.readings.empty()) {
    const std::string& last = result.readings.back();
    result.readings = {last.substr(last.find(' '))};  // without the count of readings
  }
  const auto& counters = hand.counters();
  const auto text = [](std::uint64_t count) { return std::to_string(count); };
  result.readings.push_back(text(counters.damaged) + " damaged, " + text(counters.lost_states) + " lost, " +
                            text(counters.repeated_states) + " repeated");
  return result;
}

std::size_t longest_chunk(const Capture& capture) {
  std::size_t longest = 0;
  for (const auto& chunk : capture.chunks) {
    if (chunk.event == capture::Event::kIn) longest = std::max(longest, chunk.bytes.size());
  }
  return longest;
}

}  // namespace embody::test
