#pragma once
// The shipped robot hands (config/hands) for tests: description, hand file, and forward kinematics written anew.
#include <array>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "core/embodiment/embodiment_config.hpp"
#include "core/robot/urdf_model.hpp"

namespace embody::test {

inline constexpr std::array<const char*, 4> kHandFiles{"mia", "shadow", "robotiq_2f140", "barrett"};

/// config/hands/NAME.toml. Throws if it cannot be read.
EmbodimentConfig hand_config(const std::string& name);

/// config/hands/NAME.urdf. Throws if it cannot be read.
robot::RobotModel hand_model(const std::string& name);

/// Values of all joints, by joint of the model: those named, else 0; mimic joints follow. Throws for an unknown name.
std::vector<double> joint_angles(const robot::RobotModel& model, const std::map<std::string, double>& named_rad);

/// Values of all joints for the motor coordinates of a hand file, its couplings included.
std::vector<double> motor_angles(const robot::RobotModel& model, const EmbodimentConfig& config,
                                 std::span<const double> r_rad);

/// X_PL by link, P the root link.
std::vector<Pose> link_poses(const robot::RobotModel& model, std::span<const double> q_rad);

/// The point `p_L` of a link in P. Throws for an unknown link.
Eigen::Vector3d point_P(const robot::RobotModel& model, std::span<const double> q_rad, const std::string& link,
                        const Eigen::Vector3d& p_L);

}  // namespace embody::test
