// Begin and end of a session with a Mia hand, and its calibration: the part that may wait.
#include <algorithm>
#include <cstdio>
#include <utility>

#include "drivers/mia/mia_hand.hpp"
#include "drivers/mia/probe.hpp"
#include "drivers/transport/clock.hpp"
#include "drivers/transport/tcp.hpp"

namespace embody::mia {
namespace {

constexpr double kRate_hz = 20.0;  ///< what the vendor's own nodes run at; three commands and a read take about 20 ms
constexpr Duration kGoodbyeTime = std::chrono::milliseconds(250);
constexpr Duration kCalibrationTime = std::chrono::seconds(30);
constexpr Duration kCalibrationStill = std::chrono::seconds(1);
constexpr Duration kCalibrationPoll = std::chrono::milliseconds(100);
constexpr int kCalibrationTries = 3;

}  // namespace

Result<HandInfo> MiaHand::connect() {
  end_session();
  if (const Status usable = check(config_); !usable) return usable.error();
  auto line = open_();
  if (!line) return line.error();
  line_ = std::move(*line);
  auto info = start_session();
  if (!info) line_.reset();
  return info;
}

Result<HandInfo> MiaHand::start_session() {
  const auto probed = probe(*line_, config_);
  if (!probed) return probed.error();
  const TimePoint now = transport::now();
  generation_ = probed->generation;
  if (watch_.begin(probed->counts, now)) doubt_calibration();
  restarted_ = false;
  stop_.begin(generation_ == Generation::kAcknowledging);
  telemetry_.begin();
  queue_ = {};
  exchange_ = {};
  reply_ = {.q_rad = probed->q_rad};
  stream_ = {.t_line = now, .t_position = now};
  read_pending_ = false;
  timeouts_in_a_row_ = missed_replies_ = 0;
  t_session_ = now;
  lost_ = hung_up_ = false;
  reason_ = {};
  return describe(probed->firmware.view());
}

HandInfo MiaHand::describe(std::string_view firmware) const {
  HandInfo info;
  info.fd = line_->fd();
  info.rate_hz = kRate_hz;
  info.joint_count = kMotors;
  for (std::size_t i = 0; i < kMotors; ++i) info.joint_names[i] = kJointNames[i];
  const char* protocol = generation_ == Generation::kStreaming ? "streaming protocol" : "acknowledging protocol";
  std::array<char, 121> peer{};
  // The warning comes first: a long device name must not cut it off.
  std::snprintf(peer.data(), peer.size(), "%sMia hand at %s, %.*s, %s%s",
                calibration_in_doubt() ? "CALIBRATION TO BE CONFIRMED, " : "", config_.device.c_str(),
                static_cast<int>(firmware.size()), firmware.data(), protocol,
                config_.space == Space::kJoint ? ", joint space" : "");
  info.peer = peer.data();
  return info;
}

void MiaHand::lose(std::string_view reason) noexcept {
  lost_ = true;
  reason_ = reason;
}

void MiaHand::hang_up() noexcept {
  hung_up_ = true;
  const std::string_view known = line_ ? line_->reason() : std::string_view{};
  lose(known.empty() ? std::string_view("the serial device is gone; is it unplugged?") : known);
}

void MiaHand::doubt_calibration() noexcept {
  if (std::exchange(restarted_, true)) return;
  ++counters_.restarts;
  if (!config_.motion_after_restart) calibration_in_doubt_.store(true, std::memory_order_relaxed);
}

void MiaHand::hand_restarted() noexcept {
  doubt_calibration();
  lose(
      "the Mia hand restarted while in use, its supply may have dropped: check the supply, calibrate the hand, and "
      "confirm the calibration; until then it does not move");
}

void MiaHand::end_session() noexcept {
  if (!line_ || hung_up_) {
    line_.reset();
    return;
  }
  request_stop();
  stop_.repeat();  // say it again, whatever was heard before
  read_pending_ = false;
  lost_ = false;
  stream_.t_line = stream_.t_position = transport::now();  // whatever ended the session does not end the farewell
  stream_.t_answered = {};
  const TimePoint deadline = stream_.t_line + kGoodbyeTime;
  while ((!stop_.over() || exchange_.busy()) && !lost_) {
    const TimePoint now = transport::now();
    if (now >= deadline) break;
    const TimePoint next =
        generation_ == Generation::kStreaming ? now + std::chrono::milliseconds(2) : exchange_.deadline();
    if (exchange_.busy() || generation_ == Generation::kStreaming) {
      static_cast<void>(transport::wait_readable(line_->fd(), std::min(deadline, next)));
    }
    pump();
  }
  if (stop_.heard()) watch_.told_to_stop();
  if (generation_ == Generation::kStreaming) {  // leave the line as it was found
    for (const char channel : {'P', 'C', 'A'}) static_cast<void>(line_->send(encode_stream(channel, false)));
  }
  lost_ = hung_up_ = true;
  line_.reset();
}

Status MiaHand::calibrate(const std::function<bool()>& cancelled) {
  const char* device = config_.device.c_str();
  if (lost_ || !line_) return make_error(Errc::kDisconnected, "the hand at %s is not connected", device);
  if (generation_ == Generation::kStreaming) {
    return make_error(Errc::kUnsupported,
                      "the firmware of the hand at %s has no calibration command: use the vendor's tool", device);
  }
  if (stop_.latched()) return make_error(Errc::kRefused, "the hand at %s is stopped: it does not calibrate", device);
  queue_ = {};
  exchange_.abandon();
  const auto heard = [this] {
    const TimePoint deadline = transport::now() + std::chrono::milliseconds(150);
    return ask(*line_, encode_plain(kCalibratePayload), deadline, [](std::string_view) { return true; });
  };
  bool started = false;
  for (int i = 0; i < kCalibrationTries && !started; ++i) started = heard();
  if (!started) return make_error(Errc::kTimeout, "the hand at %s does not acknowledge the calibration", device);

  std::array<double, kMotors> last{};
  TimePoint t_moved = transport::now();
  for (const TimePoint t_end = t_moved + kCalibrationTime; transport::now() < t_end;) {
    if (cancelled && cancelled()) {
      end_session();
      return make_error(Errc::kRefused, "interrupted: the hand at %s was told to stop (AS)%s; calibrate it again",
                        device, stop_.heard() ? "" : ", but did not answer: watch it");
    }
    const TimePoint next = transport::now() + kCalibrationPoll;
    const auto counts = ask_counts(*line_, config_, next);
    const TimePoint now = transport::now();
    if (!counts || *counts != last) t_moved = now;  // a busy hand may be silent
    if (counts) last = *counts;
    if (now - t_moved >= kCalibrationStill) {
      static_cast<void>(watch_.begin(last, now));
      return {};
    }
    while (transport::now() < next) {
      std::string_view rest;
      static_cast<void>(transport::wait_readable(line_->fd(), next));
      if (line_->receive(rest) != IoStatus::kDisconnected) continue;
      hang_up();
      return make_error(Errc::kDisconnected, "%s", reason_.c_str());
    }
  }
  return make_error(Errc::kTimeout, "the hand at %s still moves 30 s after its calibration began", device);
}

}  // namespace embody::mia
