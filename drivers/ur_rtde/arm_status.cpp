#include "drivers/ur_rtde/arm_status.hpp"

#include <algorithm>

namespace embody::ur {
namespace {

// Layout of the one word that holds all modes, from bit 0: robot mode, safety status, program state, program version,
// speed limit reason (8 bits each), safety bits (16), answers (1).
std::uint64_t byte_of(std::int64_t value) noexcept {
  return static_cast<std::uint8_t>(std::clamp<std::int64_t>(value, -128, 127));
}

std::int32_t signed_byte(std::uint64_t word, unsigned shift) noexcept {
  return static_cast<std::int8_t>(static_cast<std::uint8_t>(word >> shift));
}

}  // namespace

void SharedArmStatus::publish(std::uint64_t packages, const rtde::ControllerStatus& status, bool answers) noexcept {
  std::uint64_t word = byte_of(status.robot_mode);
  word |= byte_of(status.safety_status) << 8U;
  word |= byte_of(status.runtime_state) << 16U;
  word |= byte_of(status.program_version) << 24U;
  word |= byte_of(status.time_scale_source) << 32U;
  word |= std::uint64_t{status.safety_status_bits & 0xFFFFU} << 40U;
  word |= std::uint64_t{answers} << 56U;
  modes_.store(word, std::memory_order_relaxed);
  packages_.store(packages, std::memory_order_release);
}

void SharedArmStatus::publish_settings(const rtde::ArmSettings& settings) noexcept {
  settings_[0].store(settings.payload_kg, std::memory_order_relaxed);
  for (std::size_t i = 0; i < 3; ++i) settings_[1 + i].store(settings.cog_m[i], std::memory_order_relaxed);
  for (std::size_t i = 0; i < 6; ++i) settings_[4 + i].store(settings.tcp[i], std::memory_order_relaxed);
}

ArmSnapshot SharedArmStatus::snapshot() const noexcept {
  ArmSnapshot snapshot;
  snapshot.packages = packages_.load(std::memory_order_acquire);
  snapshot.commands = commands_.load(std::memory_order_relaxed);
  const std::uint64_t word = modes_.load(std::memory_order_relaxed);
  snapshot.controller.robot_mode = signed_byte(word, 0);
  snapshot.controller.safety_status = signed_byte(word, 8);
  snapshot.controller.runtime_state = static_cast<std::uint32_t>(signed_byte(word, 16));
  snapshot.controller.program_version = signed_byte(word, 24);
  snapshot.controller.time_scale_source = signed_byte(word, 32);
  snapshot.controller.safety_status_bits = static_cast<std::uint32_t>((word >> 40U) & 0xFFFFU);
  snapshot.answers = ((word >> 56U) & 1U) != 0;
  return snapshot;
}

rtde::ArmSettings SharedArmStatus::settings() const noexcept {
  rtde::ArmSettings settings;
  settings.payload_kg = settings_[0].load(std::memory_order_relaxed);
  for (std::size_t i = 0; i < 3; ++i) settings.cog_m[i] = settings_[1 + i].load(std::memory_order_relaxed);
  for (std::size_t i = 0; i < 6; ++i) settings.tcp[i] = settings_[4 + i].load(std::memory_order_relaxed);
  return settings;
}

}  // namespace embody::ur
