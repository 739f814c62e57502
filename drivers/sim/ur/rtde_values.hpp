#pragma once
// The way between the simulated robot and the variables that RTDE clients see.
#include "drivers/sim/ur/rtde_variables.hpp"
#include "drivers/sim/ur/ur_robot.hpp"
#include "drivers/ur_rtde/arm_package.hpp"
#include "drivers/ur_rtde/primary_codec.hpp"

namespace embody::sim {

class RtdeValues {
 public:
  explicit RtdeValues(RtdeVariables& variables);

  /// What clients wrote; `packages` of them so far.
  [[nodiscard]] RegisterInputs inputs(std::uint64_t packages) noexcept;
  /// Speed slider that a client set, 0 to 1; nullopt while the mask is 0.
  [[nodiscard]] std::optional<double> speed_slider() noexcept;
  void write(UrRobot& robot, double timestamp_s, const math::Vector6& tcp_pose) noexcept;
  void write_settings(const rtde::ArmSettings& settings) noexcept;
  /// output_int_register_24 keeps its value.
  void freeze_echo(bool frozen) noexcept { echo_frozen_ = frozen; }

 private:
  using Index = RtdeVariables::Index;
  void write_registers(const RegisterOutputs& registers) noexcept;
  [[nodiscard]] std::array<Index, 12> find_targets() const;

  RtdeVariables& values_;
  bool echo_frozen_{false};
  std::array<Index, 12> targets_in_{find_targets()};
  Index sequence_in_{values_.at("input_int_register_24")};
  Index mode_in_{values_.at("input_int_register_25")};
  Index slider_mask_{values_.at("speed_slider_mask")};
  Index slider_{values_.at("speed_slider_fraction")};
  Index timestamp_{values_.at("timestamp")};
  Index actual_q_{values_.at("actual_q")};
  Index actual_qd_{values_.at("actual_qd")};
  Index target_q_{values_.at("target_q")};
  Index target_qd_{values_.at("target_qd")};
  Index tcp_pose_{values_.at("actual_TCP_pose")};
  Index robot_mode_{values_.at("robot_mode")};
  Index safety_mode_{values_.at("safety_mode")};
  Index safety_status_{values_.at("safety_status")};
  Index runtime_state_{values_.at("runtime_state")};
  Index robot_bits_{values_.at("robot_status_bits")};
  Index safety_bits_{values_.at("safety_status_bits")};
  Index scaling_{values_.at("speed_scaling")};
  Index fraction_{values_.at("target_speed_fraction")};
  Index time_scale_{values_.at("time_scale_source")};
  Index line_{values_.at("script_control_line")};
  Index echo_{values_.at("output_int_register_24")};
  Index state_{values_.at("output_int_register_25")};
  Index fault_{values_.at("output_int_register_26")};
  Index version_{values_.at("output_int_register_27")};
  Index payload_{values_.at("payload")};
  Index payload_cog_{values_.at("payload_cog")};
  Index tcp_offset_{values_.at("tcp_offset")};
};

}  // namespace embody::sim
