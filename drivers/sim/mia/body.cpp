#include "drivers/sim/mia/body.hpp"

#include <algorithm>
#include <cmath>
#include <string_view>

namespace embody::sim {
namespace {

using mia::kMotors;
using mia::Motor;

constexpr Duration kSamplePeriod = std::chrono::milliseconds(10);
// Idle readings of one published hand: MRL tangential, index normal and tangential, thumb tangential and normal,
// MRL normal, two unused fields.
constexpr std::array<int, mia::kStrainFields> kIdleStrain{260, 208, 208, 215, 215, 260, 0, 0};
// The motor that loads each of these gauges in its normal direction, if any.
constexpr std::array<int, mia::kStrainFields> kLoadedBy{-1, 1, -1, -1, 0, 2, -1, -1};
constexpr int kContactStrain = 120;
// Motor currents are not documented; these only tell standing, moving and blocked apart.
constexpr int kStandingCurrent = 20;
constexpr int kMovingCurrent = 120;
constexpr double kCurrentPerPercent = 10.24;
constexpr int kCalibrationSpeed_percent = 40;

std::size_t row_of(char grasp) noexcept {
  return std::min<std::size_t>(std::string_view("CPLUDSTR").find(grasp), 7);
}

}  // namespace

MiaBody::MiaBody(const MiaSimulatorConfig& config, TimePoint now)
    : config_(config), now_(now), next_sample_(now), random_(config.seed) {
  for (std::size_t i = 0; i < kMotors; ++i) {
    motors_[i] = MiaMotor(static_cast<Motor>(i), config.start_counts[i], config.lag_s);
    motors_[i].set_contact(config.contact_counts[i]);
    references_[i].fill({0, mia::kMaxCounts, 0});
  }
  log_.reserve(config.log_capacity);
}

void MiaBody::move_to(TimePoint now) {
  now = std::max(now, now_);
  if (calibrated_at_ && *calibrated_at_ <= now) {
    const TimePoint end = *calibrated_at_;
    calibrated_at_.reset();
    move_to(end);
    for (MiaMotor& motor : motors_) {
      motor.halt();
      motor.end_calibration();
    }
  }
  while (next_sample_ <= now) {
    record(next_sample_);
    next_sample_ += kSamplePeriod;
  }
  integrate(now);
}

void MiaBody::integrate(TimePoint t) noexcept {
  for (MiaMotor& motor : motors_) motor.advance(to_seconds(t - now_));
  now_ = t;
}

void MiaBody::record(TimePoint t) {
  integrate(t);
  const MiaSample sample{t, joint_angles_rad()};
  if (log_.size() < config_.log_capacity) {
    log_.push_back(sample);
  } else if (!log_.empty()) {
    log_[log_begin_] = sample;
    log_begin_ = (log_begin_ + 1) % log_.size();
  }
}

bool MiaBody::execute(const mia::Request& request) {
  using Kind = mia::Request::Kind;
  if (calibrated_at_) return false;
  const auto m = static_cast<std::size_t>(request.motor);
  switch (request.kind) {
    case Kind::kMotorPosition:
      limit_percent_[m] = request.speed_percent;
      motors_[m].move_to(request.value, request.speed_percent);
      return true;
    case Kind::kJointPosition: {
      const double angle_rad = 0.01 * request.value;
      const auto counts = mia::motor_counts(config_.transmission, {angle_rad, angle_rad, angle_rad});
      limit_percent_[m] = request.speed_percent;
      motors_[m].move_to(counts[m], request.speed_percent);
      return true;
    }
    case Kind::kMotorSpeed:
      limit_percent_[m] = request.current_percent;
      motors_[m].drive(request.value);
      return request.value != 0;
    case Kind::kJointSpeed: {
      const auto q_rad = joint_angles_rad();
      auto next = q_rad;
      next[m] += 0.1 * request.value;
      const double counts_per_s =
          mia::motor_counts(config_.transmission, next)[m] - mia::motor_counts(config_.transmission, q_rad)[m];
      limit_percent_[m] = request.current_percent;
      motors_[m].drive(counts_per_s / motors_[m].counts_per_s_per_unit());
      return request.value != 0;
    }
    default:
      return false;
  }
}

void MiaBody::halt() noexcept {
  for (MiaMotor& motor : motors_) motor.halt();
  calibrated_at_.reset();
}

bool MiaBody::perform_grasp(const mia::Request& request) {
  if (calibrated_at_) return false;
  for (std::size_t i = 0; i < kMotors; ++i) {
    const mia::GraspReferences& way = references_[i][row_of(request.grasp)];
    motors_[i].move_to(way.open + 0.01 * request.value * (way.closed - way.open), request.speed_percent);
  }
  return true;
}

void MiaBody::set_references(const mia::Request& request, const mia::GraspReferences& references) noexcept {
  references_[static_cast<std::size_t>(request.motor)][row_of(request.grasp)] = references;
}

mia::GraspReferences MiaBody::references(const mia::Request& request) const noexcept {
  return references_[static_cast<std::size_t>(request.motor)][row_of(request.grasp)];
}

void MiaBody::begin_calibration() {
  for (MiaMotor& motor : motors_) motor.begin_calibration(kCalibrationSpeed_percent);
  calibrated_at_ = now_ + config_.calibration_time;
}

void MiaBody::restart() noexcept {
  for (MiaMotor& motor : motors_) motor.lose_counter();
  calibrated_at_.reset();
}

std::optional<mia::DataLine> MiaBody::data_line(char channel) {
  std::array<int, kMotors> values{};
  switch (channel) {
    case 'P':
      for (std::size_t i = 0; i < kMotors; ++i) values[i] = static_cast<int>(std::lround(motors_[i].counter()));
      return mia::encode_triple(mia::TripleLine::kPosition, values);
    case 'S':
      for (std::size_t i = 0; i < kMotors; ++i) values[i] = static_cast<int>(std::lround(motors_[i].speed()));
      return mia::encode_triple(mia::TripleLine::kSpeed, values);
    case 'C':
      return mia::encode_triple(mia::TripleLine::kCurrent, currents());
    case 'A':
      return mia::encode_strain_gauges(strain());
    case 'J':
      return mia::encode_joint_positions(mia::joint_angles_rad(config_.transmission, counters()));
    case 'j':
      return mia::encode_joint_speeds(joint_speeds_rad_s());
    default:
      return std::nullopt;
  }
}

std::array<int, kMotors> MiaBody::currents() const noexcept {
  std::array<int, kMotors> values{};
  for (std::size_t i = 0; i < kMotors; ++i) {
    const bool moving = std::abs(motors_[i].speed()) >= 0.5;
    values[i] = motors_[i].blocked() ? static_cast<int>(std::lround(kCurrentPerPercent * limit_percent_[i]))
                : moving             ? kMovingCurrent
                                     : kStandingCurrent;
  }
  return values;
}

std::array<int, mia::kStrainFields> MiaBody::strain() {
  std::normal_distribution<double> noise(0.0, std::max(config_.strain_noise, 1e-9));
  std::array<int, mia::kStrainFields> values{};
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (kIdleStrain[i] == 0) continue;
    const bool loaded = kLoadedBy[i] >= 0 && motors_[static_cast<std::size_t>(kLoadedBy[i])].blocked();
    values[i] = kIdleStrain[i] + (loaded ? kContactStrain : 0) + static_cast<int>(std::lround(noise(random_)));
  }
  return values;
}

std::array<double, kMotors> MiaBody::joint_speeds_rad_s() const noexcept {
  const auto& [thumb, index, mrl] = config_.transmission;
  const auto at = [this](Motor motor) { return motors_[static_cast<std::size_t>(motor)]; };
  const double counts = at(Motor::kIndex).counter();
  const double rad_per_count = mia::index_delta_rad(index, counts + 0.5) - mia::index_delta_rad(index, counts - 0.5);
  return {at(Motor::kThumb).counts_per_s() * thumb.rad_per_count, at(Motor::kIndex).counts_per_s() * rad_per_count,
          at(Motor::kMrl).counts_per_s() * mrl.rad_per_count};
}

std::array<double, kMotors> MiaBody::counters() const noexcept {
  return {motors_[0].counter(), motors_[1].counter(), motors_[2].counter()};
}

std::array<double, kMotors> MiaBody::motor_counts() const noexcept {
  return {motors_[0].counts(), motors_[1].counts(), motors_[2].counts()};
}

std::array<double, kMotors> MiaBody::joint_angles_rad() const noexcept {
  return mia::joint_angles_rad(config_.transmission, motor_counts());
}

std::vector<MiaSample> MiaBody::log() const {
  std::vector<MiaSample> ordered(log_);
  std::rotate(ordered.begin(), ordered.begin() + static_cast<std::ptrdiff_t>(log_begin_), ordered.end());
  return ordered;
}

}  // namespace embody::sim
