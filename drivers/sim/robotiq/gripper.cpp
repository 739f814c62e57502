#include "drivers/sim/robotiq/gripper.hpp"

#include <algorithm>
#include <cmath>

namespace embody::sim {
namespace {

using robotiq::Activation;
using robotiq::GripperCommand;
using robotiq::ObjectState;

constexpr std::size_t kMaxPending = 16;
constexpr Duration kSilence = std::chrono::seconds(1);  ///< after which the gripper reports fault 9
constexpr std::uint8_t kSilenceFault = 9;
constexpr std::uint8_t kMovingCurrent = 16;  ///< 160 mA, the figure of the manual's examples
constexpr std::uint8_t kIllegalFunction = 1, kIllegalAddress = 2, kDeviceFailure = 4;

bool take_one(int& count) noexcept {
  if (count <= 0) return false;
  --count;
  return true;
}

/// The registers address .. address + count - 1 lie within those from `base` on.
bool within(std::uint16_t address, std::uint16_t count, std::uint16_t base) noexcept {
  return address >= base && address + count <= base + robotiq::kRegisterCount;
}

}  // namespace

RobotiqGripper::RobotiqGripper(const RobotiqGripperConfig& config, TimePoint now)
    : config_(config), now_(now), last_heard_(now), counts_(config.start_counts) {
  if (!config.activated) return;
  command_.activate = true;
  written_ = robotiq::pack(command_);
  activation_ = Activation::kDone;
}

void RobotiqGripper::receive(std::span<const std::byte> bytes, TimePoint now) {
  move_to(now);
  incoming_.push(bytes);
  while (const auto request = incoming_.take_request()) {
    if (request->slave != config_.slave) continue;
    ++counters_.requests;
    if (!pending_.empty()) ++counters_.too_early;
    if (pending_.size() < kMaxPending) execute(*request);
  }
}

std::vector<std::byte> RobotiqGripper::advance(TimePoint now) {
  move_to(now);
  std::vector<std::byte> out;
  while (!pending_.empty() && pending_.front().due <= now_) {
    out.insert(out.end(), pending_.front().bytes.begin(), pending_.front().bytes.end());
    pending_.pop_front();
  }
  return out;
}

std::optional<TimePoint> RobotiqGripper::next_event() const noexcept {
  return pending_.empty() ? std::nullopt : std::optional(pending_.front().due);
}

void RobotiqGripper::forget_host() noexcept {
  incoming_.clear();
  pending_.clear();
}

void RobotiqGripper::apply(const RobotiqFault& fault) noexcept {
  using Kind = RobotiqFault::Kind;
  switch (fault.kind) {
    case Kind::kDrop:
      drop_ = fault.number;
      break;
    case Kind::kGarble:
      garble_ = fault.number;
      break;
    case Kind::kCrc:
      crc_ = fault.number;
      break;
    case Kind::kException:
      exception_ = fault.number;
      break;
    case Kind::kMute:
      mute_ = fault.on;
      break;
    case Kind::kFault:
      fault_ = static_cast<std::uint8_t>(fault.number);
      if (robotiq::needs_activation(fault_)) activation_ = Activation::kReset;
      break;
    case Kind::kDeactivate:
      written_ = {};
      command_ = {};
      activation_ = Activation::kReset;
      fault_ = 0;
      break;
    case Kind::kObject:
      object_mm_ = fault.number;
      break;
    case Kind::kDelay:
      config_.reply_delay = std::chrono::milliseconds(fault.number);
      break;
    case Kind::kUnplug:
    case Kind::kPlug:
      break;
  }
}

double RobotiqGripper::object_counts() const noexcept {
  return object_mm_ < 0.0 ? 1e9 : robotiq::kMaxCounts * (1.0 - object_mm_ / config_.stroke_mm);
}

void RobotiqGripper::move_to(TimePoint now) noexcept {
  now = std::max(now, now_);
  // Small steps, so that what an object or an end stops is stopped there whatever the caller's pace.
  constexpr double kStep_s = 0.002;
  double left_s = std::min(to_seconds(now - now_), 60.0);
  while (left_s > 0.0) {
    const double dt_s = std::min(left_s, kStep_s);
    left_s -= dt_s;
    moving_ = false;
    if (activation_ == Activation::kRunning) step_activation(dt_s);
    if (activation_ == Activation::kDone && command_.go) step_motion(dt_s);
  }
  now_ = now;
  if (command_.activate && fault_ == 0 && now_ - last_heard_ > kSilence) fault_ = kSilenceFault;
}

/// True when `target` is reached. `speed` in counts/s.
bool RobotiqGripper::approach(double target, double speed, double dt_s) noexcept {
  const double before = counts_;
  counts_ += std::clamp(target - counts_, -speed * dt_s, speed * dt_s);
  travelled_ += std::abs(counts_ - before);
  moving_ = counts_ != before;
  return std::abs(target - counts_) < 1e-9;
}

void RobotiqGripper::step_activation(double dt_s) noexcept {
  constexpr int kLegs = 3;
  const double speed = kLegs * (config_.max_counts - config_.min_counts) / std::max(config_.activation_s, 1e-3);
  const double target = activation_leg_ == 1 ? std::min(config_.max_counts, object_counts()) : config_.min_counts;
  if (approach(target, speed, dt_s) && ++activation_leg_ == kLegs) activation_ = Activation::kDone;
}

void RobotiqGripper::step_motion(double dt_s) noexcept {
  const double mm_s =
      config_.slowest_mm_s + (config_.fastest_mm_s - config_.slowest_mm_s) * command_.speed / robotiq::kMaxCounts;
  const double wanted = std::clamp<double>(command_.position, config_.min_counts, config_.max_counts);
  const double obstacle = object_counts();
  const bool blocked = wanted > obstacle && counts_ <= obstacle + 1e-9;
  const bool there = approach(blocked ? obstacle : wanted, mm_s * robotiq::kMaxCounts / config_.stroke_mm, dt_s);
  object_ = !there ? ObjectState::kMoving : blocked ? ObjectState::kStoppedClosing : ObjectState::kAtRequest;
}

void RobotiqGripper::execute(const modbus::Request& request) {
  last_heard_ = now_;
  if (fault_ == kSilenceFault) fault_ = 0;
  modbus::Reply reply;
  if (take_one(exception_)) {
    reply.exception = kDeviceFailure;
  } else {
    reply = answer(request);
  }
  say(request, reply);
}

modbus::Reply RobotiqGripper::answer(const modbus::Request& request) noexcept {
  modbus::Reply reply;
  const bool reads = request.read_count > 0;
  const bool writes = request.write_count > 0;
  const bool reads_command = reads && within(request.read_address, request.read_count, robotiq::kCommandAddress);
  const bool reads_status = reads && within(request.read_address, request.read_count, robotiq::kStatusAddress);
  if (!reads && !writes) reply.exception = kIllegalFunction;
  if (reads && !reads_command && !reads_status) reply.exception = kIllegalAddress;
  if (writes && !within(request.write_address, request.write_count, robotiq::kCommandAddress))
    reply.exception = kIllegalAddress;
  if (reply.exception != 0) return reply;
  if (writes) {
    const std::size_t first = request.write_address - robotiq::kCommandAddress;
    std::copy_n(request.values.begin(), request.write_count, written_.begin() + static_cast<std::ptrdiff_t>(first));
    obey(robotiq::unpack_command(written_));
  }
  if (reads) {
    const robotiq::Registers source = reads_status ? robotiq::pack(status()) : written_;
    const std::size_t first =
        request.read_address - (reads_status ? robotiq::kStatusAddress : robotiq::kCommandAddress);
    std::copy_n(source.begin() + static_cast<std::ptrdiff_t>(first), request.read_count, reply.values.begin());
    reply.count = request.read_count;
    if (reads_status) ++counters_.reads;
  }
  return reply;
}

void RobotiqGripper::obey(const GripperCommand& command) noexcept {
  const bool rising = command.activate && !command_.activate;
  command_ = command;
  if (!command.activate) {
    ++counters_.resets;
    activation_ = Activation::kReset;
    fault_ = command.go ? 0x7 : 0;
    return;
  }
  if (rising) {
    ++counters_.activations;
    activation_ = Activation::kRunning;
    activation_leg_ = 0;
    fault_ = 0;
  } else if (command.go && activation_ == Activation::kDone) {
    ++counters_.motions;
    object_ = ObjectState::kMoving;
    if (fault_ == 0x5) fault_ = 0;
  } else if (!command.go) {
    ++counters_.stops;
  }
  if (command.go && activation_ == Activation::kRunning) fault_ = 0x5;
}

robotiq::GripperStatus RobotiqGripper::status() const noexcept {
  robotiq::GripperStatus status;
  status.activate = command_.activate;
  status.go = command_.go && activation_ == Activation::kDone;
  status.activation = activation_;
  status.object = status.go ? object_ : ObjectState::kMoving;
  status.fault = fault_;
  status.position_echo = command_.position;
  status.position = static_cast<std::uint8_t>(std::clamp<long>(std::lround(counts_), 0, robotiq::kMaxCounts));
  status.current = moving_ ? kMovingCurrent : std::uint8_t{0};
  return status;
}

void RobotiqGripper::say(const modbus::Request& request, const modbus::Reply& reply) {
  const modbus::Frame frame = modbus::encode_reply(request, reply);
  if (mute_ || take_one(drop_)) return;
  std::vector<std::byte> bytes(frame.view().begin(), frame.view().end());
  if (take_one(garble_)) std::fill(bytes.begin() + 1, bytes.end(), std::byte{'#'});
  if (take_one(crc_)) bytes.back() ^= std::byte{0x55};
  pending_.push_back({now_ + config_.reply_delay, std::move(bytes)});
}

RobotiqGripperCounters RobotiqGripper::counters() const noexcept {
  RobotiqGripperCounters counters = counters_;
  counters.skipped_bytes = incoming_.skipped_bytes();
  return counters;
}

}  // namespace embody::sim
