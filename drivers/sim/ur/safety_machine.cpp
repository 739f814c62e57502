#include "drivers/sim/ur/safety_machine.hpp"

namespace embody::sim {
namespace {

constexpr std::uint32_t kPowerOn = 1U << 0U;
constexpr std::uint32_t kProgramRunning = 1U << 1U;
constexpr std::uint32_t kProtectiveBit = 1U << 2U;
constexpr std::uint32_t kRobotEmergencyBit = 1U << 6U;
constexpr std::uint32_t kAnyEmergencyBit = 1U << 7U;
constexpr std::uint32_t kStoppedBit = 1U << 10U;

constexpr std::uint32_t kStopped = 1;
constexpr std::uint32_t kPlaying = 2;
constexpr std::uint32_t kPaused = 4;

}  // namespace

void SafetyMachine::protective_stop() noexcept {
  if (stopped()) return;
  status_.safety_status = 3;
  status_.safety_status_bits = kProtectiveBit | kStoppedBit;
  if (playing()) status_.runtime_state = kPaused;  // the program stays loaded
}

void SafetyMachine::emergency_stop() noexcept {
  status_.robot_mode = 3;  // power off
  status_.safety_status = 7;
  status_.safety_status_bits = kRobotEmergencyBit | kAnyEmergencyBit | kStoppedBit;
  status_.runtime_state = kStopped;
  status_.robot_status_bits = 0;
}

void SafetyMachine::clear() noexcept {
  status_ = {};
}

void SafetyMachine::set_program_running(bool running) noexcept {
  if (running && stopped()) return;
  status_.runtime_state = running ? kPlaying : kStopped;
  status_.robot_status_bits = (status_.robot_status_bits & kPowerOn) | (running ? kProgramRunning : 0U);
}

}  // namespace embody::sim
