#include "drivers/robotiq/robotiq_hand.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "drivers/transport/clock.hpp"
#include "drivers/transport/tty.hpp"

namespace embody::robotiq {
namespace {

constexpr Duration kRefresh = std::chrono::milliseconds(900);     ///< the gripper hears its target once a second
constexpr Duration kBelieved = std::chrono::milliseconds(250);    ///< so long is a status worth something
constexpr Duration kRequestAge = std::chrono::milliseconds(500);  ///< so long is an activation request
constexpr Duration kActivationTime = std::chrono::seconds(10);    ///< a full opening and closing takes about 2 s
constexpr int kStopTries = 4;                                     ///< the last one is a reset
constexpr int kReadsPerCall = 16;                                 ///< far more than the line carries in 20 ms

}  // namespace

RobotiqHand::RobotiqHand(RobotiqConfig config) : config_(std::move(config)) {
  show({{"requests", &counters_.requests},
        {"replies", &counters_.replies},
        {"statuses", &counters_.statuses},
        {"timeouts", &counters_.timeouts},
        {"crc_errors", &counters_.crc_errors},
        {"exceptions", &counters_.exceptions},
        {"faults", &counters_.faults},
        {"expired", &counters_.expired},
        {"withheld", &counters_.withheld},
        {"stops", &counters_.stops},
        {"activations", &counters_.activations}});
}

RobotiqHand::~RobotiqHand() {
  end_session();
}

void RobotiqHand::lose(std::string_view why) noexcept {
  lost_ = true;
  reason_ = why;
}

IoStatus RobotiqHand::read(HandDeviceState& state) noexcept {
  if (lost_) return IoStatus::kDisconnected;
  pump();
  if (lost_) return IoStatus::kDisconnected;
  if (!std::exchange(status_.fresh, false)) return IoStatus::kEmpty;
  state.reply = status_.number;
  state.t_arrival = status_.when;
  state.joint_count = 1;
  state.q_rad[0] = angle_of(config_.scale, status_.last.position);
  tell(state.telemetry);
  return IoStatus::kDone;
}

void RobotiqHand::tell(HandTelemetry& telemetry) const noexcept {
  constexpr std::uint8_t kUnderVoltage = 0xA;
  const GripperStatus& status = status_.last;
  telemetry = {};
  telemetry.supply = status.fault == kUnderVoltage ? HandSupply::kLow : HandSupply::kGood;
  telemetry.t_current = status_.when;
  telemetry.current_count = 1;
  telemetry.current_in_ampere = true;
  telemetry.current_a[0] = status.current_a();
  telemetry.why_not = why_not();
  const bool held = status.object == ObjectState::kStoppedClosing || status.object == ObjectState::kStoppedOpening;
  if (stop_.latched && !(stop_.hold_seen && !stop_.under_way)) {
    telemetry.condition = HandCondition::kStopped;
  } else if (!allows_motion(status.fault) && status.fault > 0x7) {
    telemetry.condition = HandCondition::kFault;
  } else if (!telemetry.why_not.empty()) {
    telemetry.condition = HandCondition::kNotActivated;
  } else {
    telemetry.condition = status.go && held ? HandCondition::kHoldsObject : HandCondition::kReady;
  }
}

IoStatus RobotiqHand::write(const HandCommand& command, TimePoint now) noexcept {
  if (lost_) return IoStatus::kDisconnected;
  take_up_activation(command.action, now);
  switch (command.action) {
    case HandAction::kMove:
      if (!may_move(command, now)) {
        cycle_.motion = {};
        cycle_.status_pending = true;  // what stands in the way may be over
        pump();
        return lost_ ? IoStatus::kDisconnected : IoStatus::kRefused;
      }
      stop_ = {};
      queue_move(command, now);
      break;
    case HandAction::kHold:
      cycle_.motion = {};
      stop_.hold_seen = stop_.latched;
      break;
    case HandAction::kStop:
      request_stop();
      break;
  }
  cycle_.status_pending = true;
  pump();
  return lost_ ? IoStatus::kDisconnected : IoStatus::kDone;
}

bool RobotiqHand::may_move(const HandCommand& command, TimePoint now) const noexcept {
  return now <= command.t_expires && command.joint_count == 1 && std::isfinite(command.q_rad[0]) && why_not().empty();
}

std::string_view RobotiqHand::why_not() const noexcept {
  if (lost_) return "there is no connection to the gripper";
  if (stop_.under_way) return "the gripper is being stopped";
  if (stop_.latched && !stop_.hold_seen) return "the gripper was stopped: hold first";
  if (activating()) return "the gripper is being activated";
  if (needs_activation(status_.last.fault)) return fault_text(status_.last.fault);
  if (!status_.last.activated())
    return "the gripper is not activated: ask for its activation, which opens and closes the fingers";
  if (!allows_motion(status_.last.fault)) return fault_text(status_.last.fault);
  return {};
}

bool RobotiqHand::known_activated(TimePoint now) const noexcept {
  return status_.believed && status_.last.activated() && now - status_.when <= kBelieved;
}

void RobotiqHand::queue_move(const HandCommand& command, TimePoint now) noexcept {
  const int target = counts_of(config_.scale, command.q_rad[0]);
  const bool news = !told_.known || told_.counts != target || now - told_.when >= kRefresh || !status_.last.go;
  cycle_.motion = {news, target, command.t_expires};
}

void RobotiqHand::pump() noexcept {
  drain();
  if (hung_up_) return;
  const TimePoint now = transport::now();
  if (bus_.waiting) {
    if (const auto reply = incoming_.take_reply(bus_.request)) {
      take_reply(*reply, now);
    } else if (now >= bus_.deadline) {
      take_failure(0);
    }
  }
  if (!bus_.waiting && !lost_ && now >= bus_.quiet_until) send_next(now);
}

/// Takes what the line has. Bytes that nobody waits for are rubbish.
void RobotiqHand::drain() noexcept {
  std::array<std::byte, 128> buffer;
  for (int i = 0; i < kReadsPerCall; ++i) {
    const auto [status, size] = transport::read_tty(fd_.get(), buffer);
    if (status == IoStatus::kDisconnected) {
      hung_up_ = true;
      return lose("the serial device is gone; is it unplugged?");
    }
    if (status != IoStatus::kDone) break;
    if (!bus_.waiting) continue;
    bus_.heard = true;
    incoming_.push({buffer.data(), size});
  }
}

void RobotiqHand::take_reply(const modbus::Reply& reply, TimePoint now) noexcept {
  if (reply.exception != 0) {
    ++counters_.exceptions;
    return take_failure(reply.exception);
  }
  ++counters_.replies;
  bus_.waiting = false;
  bus_.failures_in_a_row = 0;
  bus_.quiet_until = now + config_.frame_gap;
  if (reply.count == kRegisterCount) take_status(reply, now);
  switch (bus_.sent) {
    case Sent::kStatus:
      break;
    case Sent::kMotion:
      if (!stop_.latched) told_ = {true, bus_.request.values[1] & 0xFF, bus_.t_sent};
      break;
    case Sent::kStop:
      finish_stop(true);
      break;
    case Sent::kActivation:
      if (activation_.phase == ActivationPhase::kReset) {
        activation_.phase = ActivationPhase::kStart;
      } else if (activation_.phase == ActivationPhase::kStart) {
        activation_.phase = ActivationPhase::kWatch;
      }
      break;
  }
}

void RobotiqHand::take_status(const modbus::Reply& reply, TimePoint now) noexcept {
  ++counters_.statuses;
  const std::uint8_t fault_before = status_.last.fault;
  status_.last = unpack_status({reply.values[0], reply.values[1], reply.values[2]});
  if (status_.last.fault != 0 && status_.last.fault != fault_before) ++counters_.faults;
  status_.when = now;
  status_.fresh = status_.believed = true;
  ++status_.number;
  if (!status_.last.activated()) {
    cycle_.motion = {};
    told_ = {};
  }
  watch_activation(now);
}

void RobotiqHand::take_failure(std::uint8_t exception) noexcept {
  if (exception == 0) ++counters_.timeouts;
  if (exception == 0 && bus_.heard) ++counters_.crc_errors;
  ++bus_.failures_in_a_row;
  bus_.exception = exception;
  bus_.waiting = false;
  bus_.quiet_until = transport::now() + config_.frame_gap;
  if (bus_.sent == Sent::kStop) finish_stop(false);
  // A stop is tried to its end: the gripper may hear us although we do not hear the gripper.
  if (stop_.under_way || bus_.failures_in_a_row < config_.lost_after_failures) return;
  if (exception == 0) return lose("the gripper no longer answers; has it power?");
  const Error refused = make_error(Errc::kRefused, "the gripper refuses requests: Modbus exception %d, %s", exception,
                                   modbus::exception_text(exception));
  lose(refused.detail.view());
}

void RobotiqHand::send_next(TimePoint now) noexcept {
  if (stop_.under_way) return send_stop(now);
  if (activation_.phase == ActivationPhase::kReset || activation_.phase == ActivationPhase::kStart)
    return send_activation_step(now);
  const bool motion_first = !(cycle_.status_is_due && cycle_.status_pending);
  if (motion_first && send_motion(now)) return;
  if (!std::exchange(cycle_.status_pending, false)) return;
  cycle_.status_is_due = false;
  transmit(status_request(), Sent::kStatus, now);
}

/// True when a request was sent.
bool RobotiqHand::send_motion(TimePoint now) noexcept {
  const Motion motion = std::exchange(cycle_.motion, {});
  if (!motion.pending) return false;
  if (now > motion.t_expires) {
    ++counters_.expired;
    return false;
  }
  if (!known_activated(now)) {
    ++counters_.withheld;
    return false;
  }
  GripperCommand command;
  command.activate = command.go = true;
  command.position = static_cast<std::uint8_t>(motion.counts);
  command.speed = static_cast<std::uint8_t>(config_.speed);
  command.force = static_cast<std::uint8_t>(config_.force);
  told_.known = false;  // until the answer: the gripper may or may not have heard it
  cycle_.status_is_due = !config_.combined_exchange;
  if (config_.combined_exchange) cycle_.status_pending = false;
  transmit(command_request(command, config_.combined_exchange), Sent::kMotion, now);
  return true;
}

void RobotiqHand::transmit(const modbus::Request& request, Sent what, TimePoint now) noexcept {
  incoming_.clear();
  bus_.request = request;
  bus_.sent = what;
  bus_.waiting = true;
  bus_.heard = false;
  bus_.t_sent = now;
  bus_.deadline = now + config_.reply_timeout;
  ++counters_.requests;
  // A full buffer needs no care of its own: the answer will not come.
  if (transport::write_tty(fd_.get(), modbus::encode_request(request).view()) != IoStatus::kDisconnected) return;
  hung_up_ = true;
  lose("the serial device is gone; is it unplugged?");
}

modbus::Request RobotiqHand::status_request() const noexcept {
  return modbus::read_request(static_cast<std::uint8_t>(config_.slave), modbus::Function::kReadHolding, kStatusAddress,
                              kRegisterCount);
}

modbus::Request RobotiqHand::command_request(const GripperCommand& command, bool with_status) const noexcept {
  modbus::Request request =
      modbus::write_request(static_cast<std::uint8_t>(config_.slave), kCommandAddress, pack(command));
  if (!with_status) return request;
  request.function = modbus::Function::kReadWriteMultiple;
  request.read_address = kStatusAddress;
  request.read_count = kRegisterCount;
  return request;
}

void RobotiqHand::request_stop() noexcept {
  stop_.latched = true;
  stop_.hold_seen = false;
  cycle_.motion = {};
  if (stop_.under_way || stop_.acknowledged) return;
  stop_.under_way = true;
  stop_.tries = 0;
  told_ = {};
  ++counters_.stops;
}

void RobotiqHand::send_stop(TimePoint now) noexcept {
  ++stop_.tries;
  GripperCommand command;  // a reset
  if (!activating() && stop_.tries < kStopTries && known_activated(now)) {
    command.activate = true;
    command.position = status_.last.position;
    command.speed = static_cast<std::uint8_t>(config_.speed);
    command.force = static_cast<std::uint8_t>(config_.force);
  }
  if (!command.activate) status_.believed = false;  // after a reset that it heard, a "stop" would be an activation
  transmit(command_request(command, false), Sent::kStop, now);
}

void RobotiqHand::finish_stop(bool acknowledged) noexcept {
  if (!acknowledged && stop_.tries < kStopTries) return;
  stop_.under_way = false;
  stop_.acknowledged = acknowledged;
  activation_ = {};
}

void RobotiqHand::request_activation() noexcept {
  activation_asked_.store(transport::now().time_since_epoch().count(), std::memory_order_relaxed);
}

void RobotiqHand::take_up_activation(HandAction action, TimePoint now) noexcept {
  const auto asked = activation_asked_.load(std::memory_order_relaxed);
  if (asked == 0) return;
  const bool waits = now - TimePoint(Duration(asked)) <= kRequestAge && now - status_.when > kBelieved;
  if (waits && action != HandAction::kStop) return;  // for a status: an activated gripper must not move for nothing
  activation_asked_.store(0, std::memory_order_relaxed);
  if (now - TimePoint(Duration(asked)) > kRequestAge) return;
  if (action == HandAction::kStop || stop_.under_way || (stop_.latched && !stop_.hold_seen) || activating()) return;
  if (known_activated(now) && !needs_activation(status_.last.fault)) return;
  activation_ = {ActivationPhase::kReset, now + kActivationTime};
  cycle_.motion = {};
  ++counters_.activations;
}

void RobotiqHand::send_activation_step(TimePoint now) noexcept {
  if (now > activation_.deadline) {
    activation_ = {};
    return;
  }
  GripperCommand command;
  command.activate = activation_.phase == ActivationPhase::kStart;
  status_.believed = false;
  transmit(command_request(command, false), Sent::kActivation, now);
}

/// An activation ends with success, with a fault, or with its time.
void RobotiqHand::watch_activation(TimePoint now) noexcept {
  if (activation_.phase != ActivationPhase::kWatch) return;
  const bool failed = needs_activation(status_.last.fault) || now > activation_.deadline;
  if (failed || status_.last.activated()) activation_ = {};
}

}  // namespace embody::robotiq
