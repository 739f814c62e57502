#include "drivers/mia/mia_hand.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "drivers/mia/serial_line.hpp"
#include "drivers/transport/clock.hpp"

namespace embody::mia {
namespace {

constexpr Duration kRefresh = std::chrono::milliseconds(900);           ///< acknowledged targets are repeated so often
constexpr Duration kStreamingRefresh = std::chrono::milliseconds(250);  ///< where nobody tells what arrived
constexpr Duration kBlind = std::chrono::milliseconds(300);  ///< streaming: positions this old are no basis for motion
constexpr Duration kReadingsOverdue = std::chrono::seconds(3);  ///< several turns of both channels
constexpr Duration kStopPoll = std::chrono::milliseconds(50);
constexpr Duration kStopPatience = std::chrono::milliseconds(500);
constexpr int kLinesPerCall = 64;  ///< far more than the line carries in 20 ms

constexpr std::size_t at(Motor motor) noexcept {
  return static_cast<std::size_t>(motor);
}

}  // namespace

MiaHand::MiaHand(const MiaConfig& config) : MiaHand(config, serial_line(config.device)) {}

MiaHand::MiaHand(MiaConfig config, OpenLine open)
    : config_(std::move(config)), open_(std::move(open)), watch_(config_.speed_percent), telemetry_(config_.telemetry) {
  show({{"commands", &counters_.commands},
        {"acks", &counters_.acks},
        {"timeouts", &counters_.timeouts},
        {"retries", &counters_.retries},
        {"resyncs", &counters_.resyncs},
        {"late_acks", &counters_.late_acks},
        {"mismatches", &counters_.mismatches},
        {"replies", &counters_.replies},
        {"implausible", &counters_.implausible},
        {"expired", &counters_.expired},
        {"stops", &counters_.stops},
        {"restarts", &counters_.restarts}});
}

MiaHand::~MiaHand() {
  end_session();
}

double MiaHand::thumb_opposition() const noexcept {
  return thumb_opposition_rad(reply_.q_rad[at(Motor::kIndex)]);
}

IoStatus MiaHand::read(HandDeviceState& state) noexcept {
  if (lost_) return IoStatus::kDisconnected;
  pump();
  if (lost_) return IoStatus::kDisconnected;
  if (!std::exchange(reply_.ready, false)) return IoStatus::kEmpty;
  state.reply = reply_.number;
  state.t_arrival = reply_.t_arrival;
  state.joint_count = kMotors;
  std::copy(reply_.q_rad.begin(), reply_.q_rad.end(), state.q_rad.begin());
  tell(reply_.t_arrival, state.telemetry);
  return IoStatus::kDone;
}

void MiaHand::tell(TimePoint now, HandTelemetry& telemetry) const noexcept {
  telemetry = {};
  telemetry_.tell(now, telemetry);
  if (calibration_in_doubt()) {
    telemetry.condition = HandCondition::kRestarted;
    telemetry.why_not = "the hand restarted: check its supply, calibrate it, then start the daemon again";
  } else if (stop_.latched() && !stop_.may_open()) {
    telemetry.condition = HandCondition::kStopped;
    telemetry.why_not = "the hand was stopped: hold first";
  } else {
    const bool silent = now - t_session_ > kReadingsOverdue && telemetry_.silent(now - kReadingsOverdue);
    telemetry.condition = silent ? HandCondition::kNoReadings : HandCondition::kReady;
  }
}

IoStatus MiaHand::write(const HandCommand& command, TimePoint now) noexcept {
  if (lost_) return IoStatus::kDisconnected;
  switch (command.action) {
    case HandAction::kMove:
      if (!may_move(command, now)) {
        drop_motion();
        return IoStatus::kRefused;
      }
      if (stop_.latched()) stop_.open();
      queue_move(command, now);
      break;
    case HandAction::kHold:
      drop_motion();
      stop_.hold();
      break;
    case HandAction::kStop:
      request_stop();
      break;
  }
  t_written_ = transport::now();
  read_pending_ = true;
  telemetry_.count_cycle();
  const bool overdue = exchange_.busy() && t_written_ >= exchange_.deadline();
  if (overdue || command.action == HandAction::kStop) {
    pump();
  } else {
    turn(t_written_);
  }
  return lost_ ? IoStatus::kDisconnected : IoStatus::kDone;
}

bool MiaHand::may_move(const HandCommand& command, TimePoint now) const noexcept {
  if (now > command.t_expires || command.joint_count != kMotors || calibration_in_doubt()) return false;
  if (stop_.latched() && (!stop_.may_open() || reply_.t_arrival <= t_stop_over_)) return false;
  if (generation_ == Generation::kStreaming && transport::now() - stream_.t_position > kBlind) return false;
  return std::all_of(command.q_rad.begin(), command.q_rad.begin() + kMotors, [](double q) { return std::isfinite(q); });
}

void MiaHand::queue_move(const HandCommand& command, TimePoint now) noexcept {
  std::array<double, kMotors> q_rad{};
  for (std::size_t i = 0; i < kMotors; ++i) {
    q_rad[i] = std::clamp(command.q_rad[i], config_.min_rad[i], config_.max_rad[i]);
  }
  const auto counts = motor_counts(config_.transmission, q_rad);
  const Duration refresh = generation_ == Generation::kStreaming ? kStreamingRefresh : kRefresh;
  for (std::size_t i = 0; i < kMotors; ++i) {
    const double lowest = i == at(Motor::kIndex) ? -kMaxCounts : 0;
    const int target = config_.space == Space::kJoint
                           ? joint_hundredths(static_cast<Motor>(i), q_rad[i])
                           : static_cast<int>(std::lround(std::clamp<double>(counts[i], lowest, kMaxCounts)));
    queue_.queue(i, target, command.t_expires, now, refresh);
  }
}

void MiaHand::drop_motion() noexcept {
  queue_.drop();
}

void MiaHand::pump() noexcept {
  for (int i = 0; i < kLinesPerCall && !lost_; ++i) {
    std::string_view line;
    const IoStatus status = line_->receive(line);
    if (status == IoStatus::kDisconnected) return hang_up();
    if (status != IoStatus::kDone) break;
    if (generation_ == Generation::kStreaming) {
      take_streamed(line, transport::now());
    } else {
      take_answer(line, transport::now());
    }
  }
  if (lost_) return;
  const TimePoint now = transport::now();
  if (exchange_.take_time(now) == Exchange::Event::kTimedOut) take_timeout(now);
  if (generation_ == Generation::kStreaming) supervise_stream(now);
  if (!lost_) turn(now);
}

/// Sends what is next, as far as the line takes it.
void MiaHand::turn(TimePoint now) noexcept {
  watch_stop(now);
  if (generation_ == Generation::kStreaming) {
    turn_streaming(now);
  } else if (!exchange_.busy()) {
    send_next(now);
  }
}

void MiaHand::take_positions(const std::array<double, kMotors>& counts, const std::array<double, kMotors>& q_rad,
                             TimePoint now) noexcept {
  missed_replies_ = 0;
  switch (watch_.take(counts, now)) {
    case MotionWatch::Verdict::kImplausible:
      ++counters_.implausible;
      return;
    case MotionWatch::Verdict::kRestarted:
      ++counters_.implausible;
      static_cast<void>(watch_.begin(counts, now));
      return hand_restarted();
    case MotionWatch::Verdict::kPlausible:
      break;
  }
  reply_ = {true, q_rad, now, reply_.number + 1};
  ++counters_.replies;
}

std::optional<Outgoing> MiaHand::next_motion(std::size_t motor, TimePoint now) noexcept {
  const auto value = queue_.take(motor, now, counters_.expired);
  if (!value) return std::nullopt;
  Outgoing outgoing{.purpose = Purpose::kMotion, .motor = motor, .value = *value};
  if (config_.space == Space::kJoint) {
    std::array<double, kMotors> target_rad{};
    target_rad[motor] = 0.01 * *value;
    watch_.told(motor, motor_counts(config_.transmission, target_rad)[motor]);
    outgoing.command = encode_joint_position(static_cast<Motor>(motor), target_rad[motor], config_.speed_percent);
  } else {
    watch_.told(motor, *value);
    outgoing.command = encode_motor_position(static_cast<Motor>(motor), *value, config_.speed_percent);
  }
  return outgoing;
}

void MiaHand::transmit(const Outgoing& outgoing, TimePoint now) noexcept {
  ++counters_.commands;
  if (generation_ == Generation::kAcknowledging) exchange_.start(outgoing, now, config_.ack_timeout);
  // A full buffer needs no care of its own: the ACK will not come, or the next refresh tells it again.
  if (line_->send(outgoing.command) == IoStatus::kDisconnected) hang_up();
}

void MiaHand::request_stop() noexcept {
  drop_motion();
  if (exchange_.draining()) exchange_.abandon();  // a stop does not wait for what is late
  if (!stop_.request()) return;
  ++counters_.stops;
  queue_.forget();
}

void MiaHand::finish_stop_step(bool acknowledged, TimePoint now) noexcept {
  stop_.finish(acknowledged);
  if (!stop_.over()) return;
  t_stop_over_ = now;
  if (stop_.heard()) watch_.told_to_stop();
}

/// After a stop: asks for positions until the hand stands still; stops it again when it does not.
void MiaHand::watch_stop(TimePoint now) noexcept {
  if (!stop_.latched() || !stop_.over()) return;
  if (watch_.still() && reply_.t_arrival > t_stop_over_) {
    stop_.confirm();
    watch_.told_to_stop();
    return;
  }
  if (now - t_asked_ >= kStopPoll) read_pending_ = true;
  if (now - t_stop_over_ < kStopPatience || reply_.t_arrival <= t_stop_over_) return;
  ++counters_.stops;
  stop_.repeat();
}

}  // namespace embody::mia
