#include "drivers/mia/telemetry.hpp"

#include <algorithm>
#include <utility>

namespace embody::mia {
namespace {

constexpr int kGiveUpAfter = 3;
constexpr std::size_t kSensors = 7;  ///< with kUnused

constexpr std::size_t row(char channel) noexcept {
  return channel == 'A' ? 1 : 0;
}

}  // namespace

Status check(const TelemetryConfig& config) noexcept {
  std::array<int, kSensors> seen{};
  for (const StrainField field : config.strain_fields) ++seen[static_cast<std::size_t>(field)];
  for (std::size_t i = 1; i < kSensors; ++i) {
    if (seen[i] == 1) continue;
    return make_error(Errc::kInvalidArgument,
                      "mia telemetry: strain_fields must name each of the six force sensors exactly once");
  }
  return {};
}

TelemetryReader::TelemetryReader(const TelemetryConfig& config) noexcept : config_(config) {
  data_.offset = config.strain_offset;
}

void TelemetryReader::begin() noexcept {
  data_ = {.offset = data_.offset, .tares = data_.tares};
  cycles_ = 0;
  due_ = false;
  missed_ = {};
  tare_left_ = 0;
}

bool TelemetryReader::wants(char channel) const noexcept {
  if (config_.every_cycles == 0 || missed_[row(channel)] >= kGiveUpAfter) return false;
  return channel == 'A' ? config_.forces : config_.currents;
}

void TelemetryReader::count_cycle() noexcept {
  if (config_.every_cycles == 0 || ++cycles_ < config_.every_cycles) return;
  cycles_ = 0;
  due_ = true;
}

char TelemetryReader::next_channel() noexcept {
  if (!std::exchange(due_, false)) return '\0';
  const char first = forces_next_ ? 'A' : 'C';
  const char second = forces_next_ ? 'C' : 'A';
  const char channel = wants(first) ? first : wants(second) ? second : '\0';
  forces_next_ = channel != 'A';
  return channel;
}

void TelemetryReader::missed(char channel) noexcept {
  ++missed_[row(channel)];
}

bool TelemetryReader::take(std::string_view line, TimePoint now) noexcept {
  if (const auto current = parse_triple(line, TripleLine::kCurrent)) {
    data_.current = *current;
    data_.t_currents = now;
    ++data_.current_samples;
    missed_[row('C')] = 0;
    return true;
  }
  if (const auto strain = parse_strain_gauges(line)) {
    take_strain(*strain);
    data_.t_forces = now;
    ++data_.force_samples;
    missed_[row('A')] = 0;
    return true;
  }
  return false;
}

void TelemetryReader::tare() noexcept {
  tare_left_ = kTareSamples;
  tare_sum_ = {};
}

void TelemetryReader::take_strain(const std::array<int, kStrainFields>& strain) noexcept {
  data_.strain = strain;
  if (tare_left_ > 0) {
    for (std::size_t i = 0; i < kStrainFields; ++i) tare_sum_[i] += strain[i];
    if (--tare_left_ == 0) {
      for (std::size_t i = 0; i < kStrainFields; ++i) data_.offset[i] = tare_sum_[i] / kTareSamples;
      ++data_.tares;
    }
  }
  std::array<int, kStrainFields> less = strain;
  for (std::size_t i = 0; i < kStrainFields; ++i) less[i] -= data_.offset[i];
  data_.force = forces_of(less, config_.strain_fields);
}

bool TelemetryReader::silent(TimePoint since) const noexcept {
  if (config_.every_cycles == 0) return false;
  return (config_.currents && data_.t_currents < since) || (config_.forces && data_.t_forces < since);
}

void TelemetryReader::tell(TimePoint now, HandTelemetry& telemetry) const noexcept {
  telemetry.t_current = telemetry.t_force = {};
  if (data_.current_samples > 0 && now - data_.t_currents <= kFresh) {
    telemetry.t_current = data_.t_currents;
    telemetry.current_count = kMotors;
    telemetry.current_in_ampere = false;
    std::copy(data_.current.begin(), data_.current.end(), telemetry.current_raw.begin());
  }
  if (data_.force_samples > 0 && now - data_.t_forces <= kFresh) tell_forces(data_.force, data_.t_forces, telemetry);
}

Forces forces_of(const std::array<int, kStrainFields>& strain,
                 const std::array<StrainField, kStrainFields>& fields) noexcept {
  Forces forces{};
  auto& [thumb, index, mrl] = forces;
  const std::array<int*, kSensors> place{nullptr,           &thumb.normal, &thumb.tangential, &index.normal,
                                         &index.tangential, &mrl.normal,   &mrl.tangential};
  for (std::size_t i = 0; i < kStrainFields; ++i) {
    if (int* to = place[static_cast<std::size_t>(fields[i])]) *to = strain[i];
  }
  return forces;
}

void tell_forces(const Forces& forces, TimePoint t, HandTelemetry& telemetry) noexcept {
  telemetry.t_force = t;
  // The order of Motor is that of the fingers.
  for (std::size_t i = 0; i < kMotors; ++i) telemetry.force[i] = {true, forces[i].normal, forces[i].tangential};
}

}  // namespace embody::mia
