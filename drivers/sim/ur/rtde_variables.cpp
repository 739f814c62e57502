#include "drivers/sim/ur/rtde_variables.hpp"

namespace embody::sim {
namespace {

using rtde::DataType;

constexpr std::array<rtde::Variable, 33> kOutputs{{
    {"timestamp", DataType::kDouble},
    {"actual_q", DataType::kVector6d},
    {"actual_qd", DataType::kVector6d},
    {"target_q", DataType::kVector6d},
    {"target_qd", DataType::kVector6d},
    {"target_qdd", DataType::kVector6d},
    {"actual_TCP_pose", DataType::kVector6d},
    {"target_TCP_pose", DataType::kVector6d},
    {"actual_TCP_speed", DataType::kVector6d},
    {"actual_TCP_force", DataType::kVector6d},
    {"ft_raw_wrench", DataType::kVector6d},
    {"tcp_offset", DataType::kVector6d},
    {"actual_digital_input_bits", DataType::kUint64},
    {"actual_digital_output_bits", DataType::kUint64},
    {"robot_mode", DataType::kInt32},
    {"joint_mode", DataType::kVector6Int32},
    {"safety_mode", DataType::kInt32},
    {"safety_status", DataType::kInt32},
    {"runtime_state", DataType::kUint32},
    {"robot_status_bits", DataType::kUint32},
    {"safety_status_bits", DataType::kUint32},
    {"speed_scaling", DataType::kDouble},
    {"target_speed_fraction", DataType::kDouble},
    {"time_scale_source", DataType::kInt32},
    {"actual_execution_time", DataType::kDouble},
    {"script_control_line", DataType::kUint32},
    {"payload", DataType::kDouble},
    {"payload_cog", DataType::kVector3d},
    {"payload_inertia", DataType::kVector6d},
    {"output_bit_registers0_to_31", DataType::kUint32},
    {"output_bit_registers32_to_63", DataType::kUint32},
    {"actual_main_voltage", DataType::kDouble},
    {"actual_robot_voltage", DataType::kDouble},
}};

constexpr std::array<rtde::Variable, 13> kInputs{{
    {"speed_slider_mask", DataType::kUint32},
    {"speed_slider_fraction", DataType::kDouble},
    {"standard_digital_output_mask", DataType::kUint8},
    {"standard_digital_output", DataType::kUint8},
    {"configurable_digital_output_mask", DataType::kUint8},
    {"configurable_digital_output", DataType::kUint8},
    {"tool_digital_output_mask", DataType::kUint8},
    {"tool_digital_output", DataType::kUint8},
    {"standard_analog_output_mask", DataType::kUint8},
    {"standard_analog_output_type", DataType::kUint8},
    {"standard_analog_output_0", DataType::kDouble},
    {"standard_analog_output_1", DataType::kDouble},
    {"external_force_torque", DataType::kVector6d},
}};

}  // namespace

RtdeVariables::RtdeVariables() {
  add_outputs();
  add_registers();
  add_inputs();
}

std::optional<RtdeVariables::Index> RtdeVariables::find(std::string_view name) const {
  const auto found = names_.find(name);
  if (found == names_.end()) return std::nullopt;
  return found->second;
}

void RtdeVariables::set_vector(Index index, const math::Vector6& value) noexcept {
  const auto target = bytes(index);
  for (int i = 0; i < 6; ++i) rtde::store(target, sizeof(double) * static_cast<std::size_t>(i), value[i]);
}

void RtdeVariables::add(const std::string& name, rtde::DataType type, Access access) {
  names_.emplace(name, entries_.size());
  entries_.push_back({type, access, values_.size()});
  values_.resize(values_.size() + rtde::wire_size(type));
}

void RtdeVariables::add_outputs() {
  for (const rtde::Variable& variable : kOutputs) add(std::string(variable.name), variable.type, Access::kOutput);
}

void RtdeVariables::add_registers() {
  constexpr int kNumbers = 48;
  for (int i = 0; i < kNumbers; ++i) {
    const std::string number = std::to_string(i);
    add("output_int_register_" + number, DataType::kInt32, Access::kOutput);
    add("output_double_register_" + number, DataType::kDouble, Access::kOutput);
    add("input_int_register_" + number, DataType::kInt32, Access::kRegister);
    add("input_double_register_" + number, DataType::kDouble, Access::kRegister);
  }
  add("input_bit_registers0_to_31", DataType::kUint32, Access::kRegister);
  add("input_bit_registers32_to_63", DataType::kUint32, Access::kRegister);
  for (int i = 64; i < 128; ++i) {
    add("output_bit_register_" + std::to_string(i), DataType::kBool, Access::kOutput);
    add("input_bit_register_" + std::to_string(i), DataType::kBool, Access::kRegister);
  }
}

void RtdeVariables::add_inputs() {
  for (const rtde::Variable& variable : kInputs) add(std::string(variable.name), variable.type, Access::kInput);
}

}  // namespace embody::sim
