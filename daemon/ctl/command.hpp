#pragma once
// How a subcommand of embodyctl registers itself: main.cpp holds the list.

namespace CLI {
class App;
}

namespace embody::ctl {

/// `add` adds one or more subcommands to `app`; their callbacks write `exit_code` (see exit_code.hpp).
struct Command {
  void (*add)(CLI::App& app, int& exit_code);
};

/// status, engage, disengage, stop, reset, shutdown: the clients of the control socket.
void add_control_commands(CLI::App& app, int& exit_code);
/// markers: what became of each marker of the glove, live.
void add_markers_command(CLI::App& app, int& exit_code);
/// demo: simulated lab, daemon and operator in one.
void add_demo_command(CLI::App& app, int& exit_code);
/// import-mano: a user's own hand model.
void add_import_mano_command(CLI::App& app, int& exit_code);
/// calibrate: a subject file from free finger motion.
void add_calibrate_command(CLI::App& app, int& exit_code);
/// evaluate: judges the record mapping and robot hands on recordings.
void add_evaluate_command(CLI::App& app, int& exit_code);
/// Adds `embodiment` and `similarity` to `evaluate`.
void add_evaluate_hands_commands(CLI::App& evaluate, int& exit_code);
/// convert: recordings to trajectories of a robot hand.
void add_convert_command(CLI::App& app, int& exit_code);
/// capture: the raw bytes between a driver and its device.
void add_capture_command(CLI::App& app, int& exit_code);
/// discover: QTM computers on the network.
void add_discover_command(CLI::App& app, int& exit_code);
/// arm: power, brakes and stops of the robot arm.
void add_arm_command(CLI::App& app, int& exit_code);
/// hand: calibration, activation, tare and readings of the robot hand.
void add_hand_command(CLI::App& app, int& exit_code);
/// sim: faults in a running simulated lab.
void add_sim_command(CLI::App& app, int& exit_code);
/// onboard: a hand file for any URDF.
void add_onboard_command(CLI::App& app, int& exit_code);

}  // namespace embody::ctl
