#pragma once
// What the simulated controller writes into its ports 30001 to 30003. Layouts as in drivers/ur_rtde/primary_codec.hpp
// and, for the 30003 stream, in the vendor's table for software 5.10 and newer (1220 bytes).
#include <vector>

#include "core/math/pose.hpp"
#include "drivers/sim/ur/safety_machine.hpp"
#include "drivers/ur_rtde/codec.hpp"
#include "drivers/ur_rtde/primary_codec.hpp"

namespace embody::sim {

using Message = std::vector<std::byte>;

/// What the messages tell about the robot.
struct RobotReport {
  double controller_time_s{0.0};
  SafetyStatus safety;
  double speed_slider{1.0};
  math::Vector6 q_rad{math::Vector6::Zero()};
  math::Vector6 qd_rad_s{math::Vector6::Zero()};
  math::Vector6 q_target_rad{math::Vector6::Zero()};
  math::Vector6 tcp_pose{math::Vector6::Zero()};  ///< position (m), rotation vector (rad)
  double payload_kg{0.0};
};

/// Robot state of ports 30001 and 30002: robot mode, joints, tool and, with `kinematics`, the arm's geometry.
[[nodiscard]] Message encode_robot_state(const RobotReport& report, const ur::UrKinematics* kinematics);
/// The state of port 30003.
[[nodiscard]] Message encode_realtime_state(const RobotReport& report);

[[nodiscard]] Message encode_text_message(std::string_view text);
[[nodiscard]] Message encode_version(const rtde::ControllerVersion& version);
[[nodiscard]] Message encode_error_code(int code, int argument, int level, std::string_view text);
[[nodiscard]] Message encode_key_message(std::string_view title, std::string_view text);
[[nodiscard]] Message encode_runtime_exception(int line, int column, std::string_view text);

}  // namespace embody::sim
