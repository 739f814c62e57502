#include "drivers/sim/ur/rtde_values.hpp"

#include <algorithm>
#include <cmath>

namespace embody::sim {

RtdeValues::RtdeValues(RtdeVariables& variables) : values_(variables) {}

std::array<RtdeValues::Index, 12> RtdeValues::find_targets() const {
  std::array<Index, 12> targets{};
  for (std::size_t i = 0; i < targets.size(); ++i) {
    targets[i] = values_.at("input_double_register_" + std::to_string(24 + i));
  }
  return targets;
}

RegisterInputs RtdeValues::inputs(std::uint64_t packages) noexcept {
  RegisterInputs in;
  in.packages = packages;
  in.sequence = values_.get<std::int32_t>(sequence_in_);
  in.mode = values_.get<std::int32_t>(mode_in_);
  for (int i = 0; i < 6; ++i) {
    in.q_target_rad[i] = values_.get<double>(targets_in_[static_cast<std::size_t>(i)]);
    in.qd_target_rad_s[i] = values_.get<double>(targets_in_[static_cast<std::size_t>(i) + 6]);
  }
  return in;
}

std::optional<double> RtdeValues::speed_slider() noexcept {
  const double fraction = values_.get<double>(slider_);
  if (values_.get<std::uint32_t>(slider_mask_) == 0 || !std::isfinite(fraction)) return std::nullopt;
  return std::clamp(fraction, 0.0, 1.0);
}

void RtdeValues::write(UrRobot& robot, double timestamp_s, const math::Vector6& tcp_pose) noexcept {
  constexpr std::int32_t kNotRunning = 0, kNotLimited = 1;
  values_.set(timestamp_, timestamp_s);
  values_.set_vector(actual_q_, robot.q_rad());
  values_.set_vector(actual_qd_, robot.qd_rad_s());
  values_.set_vector(target_q_, robot.q_target_rad());
  values_.set_vector(target_qd_, robot.qd_target_rad_s());
  values_.set_vector(tcp_pose_, tcp_pose);
  const SafetyStatus& safety = robot.safety();
  values_.set(robot_mode_, safety.robot_mode);
  values_.set(safety_mode_, safety.safety_status);
  values_.set(safety_status_, safety.safety_status);
  values_.set(runtime_state_, safety.runtime_state);
  values_.set(robot_bits_, safety.robot_status_bits);
  values_.set(safety_bits_, safety.safety_status_bits);
  values_.set(scaling_, robot.machine().speed_slider());
  values_.set(fraction_, robot.machine().speed_slider());
  values_.set(time_scale_, safety.runtime_state == 2 ? kNotLimited : kNotRunning);
  values_.set(line_, static_cast<std::uint32_t>(robot.program_line()));
  write_registers(robot.registers());
}

void RtdeValues::write_registers(const RegisterOutputs& registers) noexcept {
  if (!echo_frozen_) values_.set(echo_, registers.sequence);
  values_.set(state_, static_cast<std::int32_t>(registers.state));
  values_.set(fault_, static_cast<std::int32_t>(registers.fault));
  values_.set(version_, registers.version);
}

void RtdeValues::write_settings(const rtde::ArmSettings& settings) noexcept {
  values_.set(payload_, settings.payload_kg);
  const auto store_all = [](std::span<std::byte> target, std::span<const double> source) {
    for (std::size_t i = 0; i < source.size(); ++i) rtde::store(target, sizeof(double) * i, source[i]);
  };
  store_all(values_.bytes(payload_cog_), settings.cog_m);
  store_all(values_.bytes(tcp_offset_), settings.tcp);
}

}  // namespace embody::sim
