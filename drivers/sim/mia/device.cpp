#include "drivers/sim/mia/device.hpp"

#include <algorithm>
#include <cmath>

namespace embody::sim {
namespace {

using mia::kMotors;
using mia::Motor;

constexpr Duration kSamplePeriod = std::chrono::milliseconds(10);
constexpr std::size_t kMaxPending = 16;
// Idle readings of one published hand: MRL tangential, index normal and tangential, thumb tangential and normal,
// MRL normal, two unused fields.
constexpr std::array<int, 8> kIdleStrain{260, 208, 208, 215, 215, 260, 0, 0};
// Motor currents are not documented; these only tell standing, moving and blocked apart.
constexpr int kStandingCurrent = 20;
constexpr int kMovingCurrent = 120;
constexpr double kCurrentPerPercent = 10.24;

Duration stream_period(double rate_hz) noexcept {
  return from_seconds(1.0 / std::clamp(rate_hz, 1.0, 1000.0));
}

}  // namespace

MiaDevice::MiaDevice(const MiaSimulatorConfig& config, TimePoint now)
    : config_(config), now_(now), next_sample_(now), next_stream_(now) {
  for (std::size_t i = 0; i < kMotors; ++i) {
    motors_[i] = MiaMotor(static_cast<Motor>(i), config.start_counts[i], config.lag_s);
  }
  log_.reserve(config.log_capacity);
}

void MiaDevice::receive(std::span<const char> bytes, TimePoint now) {
  move_to(now);
  for (const char byte : bytes) {
    const auto command = commands_.push(byte);
    if (!command) continue;
    ++counters_.commands;
    if (config_.half_duplex ? !pending_.empty() : pending_.size() >= kMaxPending) {
      ++counters_.dropped_as_early;
      continue;
    }
    execute(mia::parse_command(*command));
    pending_.push_back({now_ + config_.ack_delay, *command});
  }
}

std::string MiaDevice::advance(TimePoint now) {
  std::string out;
  while (true) {
    const auto event = next_event();
    if (!event || *event > now) break;
    move_to(*event);
    if (!pending_.empty() && pending_.front().due <= now_) {
      answer(pending_.front().command, out);
      pending_.pop_front();
    } else {
      for (const char channel : streams_) say(data_line(channel)->view(), out);
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
  now = std::max(now, now_);
  while (next_sample_ <= now) {
    record(next_sample_);
    next_sample_ += kSamplePeriod;
  }
  for (MiaMotor& motor : motors_) motor.advance(to_seconds(now - now_));
  now_ = now;
}

void MiaDevice::record(TimePoint t) {
  for (MiaMotor& motor : motors_) motor.advance(to_seconds(t - now_));
  now_ = t;
  const MiaSample sample{t, joint_angles_rad()};
  if (log_.size() < config_.log_capacity) {
    log_.push_back(sample);
  } else if (!log_.empty()) {
    log_[log_begin_] = sample;
    log_begin_ = (log_begin_ + 1) % log_.size();
  }
}

void MiaDevice::execute(const mia::Request& request) {
  using Kind = mia::Request::Kind;
  const auto m = static_cast<std::size_t>(request.motor);
  switch (request.kind) {
    case Kind::kMotorPosition:
      ++counters_.motions;
      motors_[m].move_to(request.value, request.speed_percent);
      break;
    case Kind::kJointPosition: {
      ++counters_.motions;
      const double angle_rad = 0.01 * request.value;
      const auto counts = mia::motor_counts(config_.transmission, {angle_rad, angle_rad, angle_rad});
      motors_[m].move_to(counts[m], request.speed_percent);
      break;
    }
    case Kind::kMotorSpeed:
      if (request.value != 0) ++counters_.motions;
      current_percent_[m] = request.current_percent;
      motors_[m].drive(request.value);
      break;
    case Kind::kStopAll:
      ++counters_.stops;
      for (MiaMotor& motor : motors_) motor.halt();
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
    case Kind::kFirmwareId:
      break;
    case Kind::kUnknown:
      ++counters_.unknown;
      break;
  }
}

void MiaDevice::switch_stream(char channel, bool on) noexcept {
  if (streams_.empty()) next_stream_ = now_;
  std::erase(streams_, channel);
  if (on) streams_.push_back(channel);
}

void MiaDevice::answer(const mia::Command& command, std::string& out) {
  const mia::Ack ack = mia::encode_ack(command);
  if (say({ack.data(), ack.size()}, out)) ++counters_.acks;
  const mia::Request request = mia::parse_command(command);
  if (request.kind == mia::Request::Kind::kRead) {
    if (const auto line = data_line(request.channel)) say(line->view(), out);
  } else if (request.kind == mia::Request::Kind::kFirmwareId) {
    say(mia::encode_firmware_id("SIM00001").view(), out);
  }
}

bool MiaDevice::say(std::string_view line, std::string& out) {
  if (mute_) return false;
  if (drop_ > 0) {
    --drop_;
    return false;
  }
  const std::size_t begin = out.size();
  out += line;
  if (garble_ > 0) {
    --garble_;
    std::fill(out.begin() + static_cast<std::ptrdiff_t>(begin) + 1, out.end() - 1, '#');
  }
  return true;
}

std::optional<mia::DataLine> MiaDevice::data_line(char channel) const noexcept {
  std::array<int, kMotors> positions{}, speeds{}, currents{};
  for (std::size_t i = 0; i < kMotors; ++i) {
    const MiaMotor& motor = motors_[i];
    positions[i] = static_cast<int>(std::lround(motor.counts()));
    speeds[i] = static_cast<int>(std::lround(motor.speed()));
    currents[i] = motor.blocked()  ? static_cast<int>(std::lround(kCurrentPerPercent * current_percent_[i]))
                  : speeds[i] != 0 ? kMovingCurrent
                                   : kStandingCurrent;
  }
  switch (channel) {
    case 'P':
      return mia::encode_triple(mia::TripleLine::kPosition, positions);
    case 'S':
      return mia::encode_triple(mia::TripleLine::kSpeed, speeds);
    case 'C':
      return mia::encode_triple(mia::TripleLine::kCurrent, currents);
    case 'A':
      return mia::encode_strain_gauges(kIdleStrain);
    case 'J': {
      auto q_rad = joint_angles_rad();
      const auto index = static_cast<std::size_t>(Motor::kIndex);
      q_rad[index] = mia::index_delta_rad(config_.transmission.index, motors_[index].counts());
      return mia::encode_joint_positions(q_rad);
    }
    case 'j':
      return mia::encode_joint_speeds(joint_speeds_rad_s());
    default:
      return std::nullopt;
  }
}

std::array<double, kMotors> MiaDevice::joint_speeds_rad_s() const noexcept {
  const auto& [thumb, index, mrl] = config_.transmission;
  const auto at = [this](Motor motor) { return motors_[static_cast<std::size_t>(motor)]; };
  const double counts = at(Motor::kIndex).counts();
  const double rad_per_count = mia::index_delta_rad(index, counts + 0.5) - mia::index_delta_rad(index, counts - 0.5);
  return {at(Motor::kThumb).counts_per_s() * thumb.rad_per_count, at(Motor::kIndex).counts_per_s() * rad_per_count,
          at(Motor::kMrl).counts_per_s() * mrl.rad_per_count};
}

std::array<double, kMotors> MiaDevice::motor_counts() const noexcept {
  return {motors_[0].counts(), motors_[1].counts(), motors_[2].counts()};
}

std::array<double, kMotors> MiaDevice::joint_angles_rad() const noexcept {
  return mia::joint_angles_rad(config_.transmission, motor_counts());
}

std::vector<MiaSample> MiaDevice::log() const {
  std::vector<MiaSample> ordered(log_);
  std::rotate(ordered.begin(), ordered.begin() + static_cast<std::ptrdiff_t>(log_begin_), ordered.end());
  return ordered;
}

MiaSimulatorCounters MiaDevice::counters() const noexcept {
  MiaSimulatorCounters result = counters_;
  result.skipped_bytes = commands_.skipped_bytes();
  return result;
}

}  // namespace embody::sim
