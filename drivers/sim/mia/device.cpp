#include "drivers/sim/mia/device.hpp"

#include <algorithm>

namespace embody::sim {
namespace {

using Kind = mia::Request::Kind;

constexpr std::size_t kMaxPending = 16;

Duration stream_period(double rate_hz) noexcept {
  return from_seconds(1.0 / std::clamp(rate_hz, 1.0, 1000.0));
}

}  // namespace

MiaDevice::MiaDevice(const MiaSimulatorConfig& config, TimePoint now)
    : config_(config), body_(config, now), next_stream_(now), booted_at_(now), random_(config.seed + 1) {}

void MiaDevice::receive(std::span<const char> bytes, TimePoint now) {
  move_to(now);
  if (body_.now() < booted_at_) return;
  for (const char byte : bytes) {
    const auto command = commands_.push(byte);
    if (!command) continue;
    if (faults_.deaf > 0) {
      --faults_.deaf;
      continue;
    }
    ++counters_.commands;
    if (config_.half_duplex ? !pending_.empty() : pending_.size() >= kMaxPending) {
      ++counters_.dropped_as_early;
      continue;
    }
    const mia::Request request = mia::parse_command(*command);
    execute(*command, request);
    if (body_.now() < booted_at_) return;  // that was too much for the supply
    TimePoint due = body_.now() + delay();
    if (!pending_.empty()) due = std::max(due, pending_.back().due);
    pending_.push_back({due, *command});
  }
}

Duration MiaDevice::delay() {
  if (config_.ack_jitter <= Duration::zero()) return config_.ack_delay;
  std::uniform_int_distribution<std::int64_t> any(0, config_.ack_jitter.count());
  return config_.ack_delay + Duration(any(random_));
}

std::string MiaDevice::advance(TimePoint now) {
  std::string out;
  while (true) {
    const auto event = next_event();
    if (!event || *event > now) break;
    move_to(*event);
    if (!pending_.empty() && pending_.front().due <= body_.now()) {
      const mia::Command command = pending_.front().command;
      pending_.pop_front();
      answer(command, out);
    } else {
      for (const char channel : streams_) say(body_.data_line(channel)->view(), out);
      // A stream does not catch up on what it missed.
      next_stream_ = std::max(next_stream_ + stream_period(config_.stream_hz), now - stream_period(config_.stream_hz));
    }
  }
  move_to(now);
  return out;
}

std::optional<TimePoint> MiaDevice::next_event() const noexcept {
  std::optional<TimePoint> next;
  if (!pending_.empty()) next = pending_.front().due;
  if (!streams_.empty()) next = next ? std::min(*next, next_stream_) : next_stream_;
  return next;
}

void MiaDevice::forget_host() noexcept {
  commands_.clear();
  pending_.clear();
}

void MiaDevice::move_to(TimePoint now) {
  body_.move_to(now);
}

void MiaDevice::restart(TimePoint now) {
  move_to(now);
  ++counters_.restarts;
  body_.restart();
  streams_.clear();
  forget_host();
  booted_at_ = body_.now() + config_.boot_time;
}

/// Older firmware: motor commands, streams and the older form of grasps. Newer firmware knows everything.
bool MiaDevice::knows(Kind kind, char first) const noexcept {
  if (config_.generation == mia::Generation::kAcknowledging) return true;
  switch (kind) {
    case Kind::kMotorPosition:
    case Kind::kMotorSpeed:
    case Kind::kFingerForce:
    case Kind::kStream:
    case Kind::kStopStreams:
    case Kind::kSetGraspReferences:
      return true;
    case Kind::kGrasp:
      return first != 'e';
    default:
      return false;
  }
}

void MiaDevice::execute(const mia::Command& command, const mia::Request& request) {
  if (!knows(request.kind, command[3])) {
    ++counters_.unknown;
    return;
  }
  switch (request.kind) {
    case Kind::kMotorPosition:
    case Kind::kJointPosition:
    case Kind::kMotorSpeed:
    case Kind::kJointSpeed:
      if (!body_.execute(request)) break;
      ++counters_.motions;
      if (faults_.undervoltage) restart(body_.now());
      break;
    case Kind::kGrasp:
      ++counters_.grasps;
      if (body_.perform_grasp(request)) ++counters_.motions;
      break;
    case Kind::kSetGraspReferences:
    case Kind::kGetGraspReferences:
      ++counters_.grasps;
      if (const auto references = mia::parse_set_references(command)) body_.set_references(request, *references);
      break;
    case Kind::kStopAll:
      ++counters_.stops;
      body_.halt();
      break;
    case Kind::kRead:
      ++counters_.reads;
      break;
    case Kind::kStream:
      switch_stream(request.channel, request.on);
      break;
    case Kind::kStopStreams:
      streams_.clear();
      break;
    case Kind::kCalibrate:
      ++counters_.calibrations;
      body_.begin_calibration();
      break;
    case Kind::kStore:
      ++counters_.stores;
      break;
    case Kind::kFingerForce:
    case Kind::kFirmwareId:
      break;
    case Kind::kUnknown:
      ++counters_.unknown;
      break;
  }
}

void MiaDevice::switch_stream(char channel, bool on) noexcept {
  if (streams_.empty()) next_stream_ = body_.now();
  std::erase(streams_, channel);
  if (on) streams_.push_back(channel);
}

void MiaDevice::answer(const mia::Command& command, std::string& out) {
  mia::Ack ack = mia::encode_ack(command);
  const bool older = config_.generation == mia::Generation::kStreaming;
  if (faults_.echo_wrong > 0) {
    --faults_.echo_wrong;
    ack[1] = ack[1] == 'A' ? 'B' : 'A';
  }
  if (faults_.drop_ack > 0) {
    --faults_.drop_ack;
  } else if (!older || config_.acks_all) {
    if (say({ack.data(), ack.size()}, out)) ++counters_.acks;
  }
  const mia::Request request = mia::parse_command(command);
  if (!knows(request.kind, command[3])) return;
  if (request.kind == Kind::kRead) {
    if (const auto line = body_.data_line(request.channel)) say(line->view(), out);
  } else if (request.kind == Kind::kFirmwareId) {
    say(mia::encode_firmware_id("SIM00001").view(), out);
  } else if (request.kind == Kind::kGetGraspReferences) {
    say(mia::encode_grasp_reference_line(body_.references(request)).view(), out);
  }
}

bool MiaDevice::say(std::string_view line, std::string& out) {
  if (faults_.mute) return false;
  if (faults_.drop > 0) {
    --faults_.drop;
    return false;
  }
  std::uniform_int_distribution<int> any_byte(0, 255);
  for (; faults_.rubbish > 0; --faults_.rubbish) out += static_cast<char>(any_byte(random_));
  const std::size_t begin = out.size();
  out += line;
  if (faults_.garble > 0) {
    --faults_.garble;
    std::fill(out.begin() + static_cast<std::ptrdiff_t>(begin) + 1, out.end() - 1, '#');
  }
  return true;
}

MiaSimulatorCounters MiaDevice::counters() const noexcept {
  MiaSimulatorCounters result = counters_;
  result.skipped_bytes = commands_.skipped_bytes();
  return result;
}

}  // namespace embody::sim
