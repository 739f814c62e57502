#include "drivers/ur_rtde/status_text.hpp"

namespace embody::rtde {

const char* safety_text(int safety_status) noexcept {
  switch (safety_status) {
    case 1:
      return "normal";
    case 2:
      return "reduced";
    case 3:
      return "protective stop";
    case 4:
      return "recovery";
    case 5:
      return "safeguard stop";
    case 6:
      return "system emergency stop";
    case 7:
      return "robot emergency stop";
    case 8:
      return "violation";
    case 9:
      return "fault";
    case 10:
      return "joint identities not confirmed";
    case 11:
      return "undefined";
    case 12:
      return "automatic mode safeguard stop";
    case 13:
      return "three-position enabling device stop";
    case 14:
      return "teach pendant enabling device stop";
    case 15:
    case 16:
      return "immediate emergency stop";
    case 17:
    case 18:
    case 19:
    case 20:
      return "PROFIsafe stop";
    case 22:
      return "safety interface safeguard stop";
    default:
      return "unknown safety status";
  }
}

const char* robot_mode_text(int robot_mode) noexcept {
  switch (robot_mode) {
    case -1:
      return "no controller";
    case 0:
      return "disconnected";
    case 1:
      return "safety not confirmed";
    case 2:
      return "booting";
    case 3:
      return "power off";
    case 4:
      return "power on";
    case 5:
      return "idle, brakes on";
    case 6:
      return "backdrive";
    case 7:
      return "running";
    case 8:
      return "updating firmware";
    default:
      return "unknown robot mode";
  }
}

const char* runtime_text(int runtime_state) noexcept {
  switch (runtime_state) {
    case 0:
      return "stopping";
    case 1:
      return "stopped";
    case 2:
      return "playing";
    case 3:
      return "pausing";
    case 4:
      return "paused";
    case 5:
      return "resuming";
    default:
      return "unknown program state";
  }
}

const char* program_fault_text(int fault) noexcept {
  switch (fault) {
    case 0:
      return "none";
    case 1:
      return "commands stopped arriving";
    case 2:
      return "the first target was too far from the arm";
    case 4:
      return "a target was out of range or not a number";
    case 16:
      return "the arm was stopped or moved by something else";
    default:
      return "unknown program fault";
  }
}

const char* time_scale_text(int time_scale_source) noexcept {
  switch (time_scale_source) {
    case 0:
      return "not running";
    case 1:
      return "full speed";
    case 2:
      return "joint torque limit";
    case 3:
      return "joint acceleration limit";
    case 4:
      return "power supply limit";
    case 5:
      return "momentum limit";
    case 6:
      return "stopping time limit";
    case 7:
      return "stopping distance limit";
    case 8:
      return "tool speed limit";
    case 9:
      return "elbow speed limit";
    case 10:
      return "joint speed limit";
    case 11:
      return "change of the safety mode";
    default:
      return "unknown speed limit";
  }
}

const char* safety_advice(int safety_status) noexcept {
  switch (safety_status) {
    case 1:
    case 2:
      return "";
    case 3:
      return "look for its cause, then release it on the teach pendant";
    case 4:
      return "move the arm back inside its limits with the teach pendant";
    case 5:
    case 12:
    case 22:
      return "close the safeguard (door, light curtain), and reset it where needed";
    case 6:
    case 7:
    case 15:
    case 16:
      return "unlock the emergency stop button, then power the robot on";
    case 13:
    case 14:
      return "hold the three-position enabling device in its middle position";
    case 17:
    case 18:
    case 19:
    case 20:
      return "release the stop at the PROFIsafe controller";
    default:
      return "see the message on the teach pendant";
  }
}

}  // namespace embody::rtde
