#include "drivers/sim/ur/safety_machine.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace embody::sim {
namespace {

constexpr std::uint32_t kPowerBit = 1U << 0U;
constexpr std::uint32_t kProgramBit = 1U << 1U;
constexpr std::uint32_t kNormalBit = 1U << 0U;
constexpr std::uint32_t kProtectiveBit = 1U << 2U;
constexpr std::uint32_t kSafeguardBit = 1U << 4U;
constexpr std::uint32_t kRobotEmergencyBit = 1U << 6U;
constexpr std::uint32_t kAnyEmergencyBit = 1U << 7U;
constexpr std::uint32_t kViolationBit = 1U << 8U;
constexpr std::uint32_t kFaultBit = 1U << 9U;
constexpr std::uint32_t kStoppedBit = 1U << 10U;

enum Mode : std::int32_t { kBooting = 2, kPowerOff = 3, kPowerOn = 4, kIdle = 5, kRunning = 7 };
enum Safety : std::int32_t { kNormal = 1, kProtective = 3, kSafeguard = 5, kEmergency = 7, kViolation = 8, kFault = 9 };
enum Runtime : std::uint32_t { kStopped = 1, kPlaying = 2, kPaused = 4 };

}  // namespace

void SafetyMachine::advance(Duration dt) noexcept {
  in_mode_ += dt;
  const auto next = [this](std::int32_t mode) {
    status_.robot_mode = mode;
    in_mode_ = Duration(0);
  };
  switch (status_.robot_mode) {
    case kBooting:
      if (in_mode_ >= times_.boot) next(kPowerOn);
      break;
    case kPowerOn:
      if (in_mode_ >= times_.power) next(kIdle);
      break;
    case kIdle:
      if (releasing_brakes_ && in_mode_ >= times_.brakes) {
        releasing_brakes_ = false;
        next(kRunning);
      }
      break;
    default:
      break;
  }
}

void SafetyMachine::protective_stop() noexcept {
  if (stopped()) return;
  stop(kProtective, kProtectiveBit);
  if (playing()) set_runtime(kPaused);  // the program stays loaded
}

void SafetyMachine::emergency_stop() noexcept {
  if (status_.safety_status == kViolation || status_.safety_status == kFault) return;
  stop(kEmergency, kRobotEmergencyBit | kAnyEmergencyBit);
  cut_power();
}

void SafetyMachine::release_emergency_stop() noexcept {
  if (status_.safety_status == kEmergency) back_to_normal();
}

void SafetyMachine::safeguard_stop(bool open) noexcept {
  if (open) {
    if (stopped()) return;
    stop(kSafeguard, kSafeguardBit);
    resume_ = playing() && times_.safeguard_resumes;
    if (playing()) set_runtime(kPaused);
  } else if (status_.safety_status == kSafeguard) {
    back_to_normal();
    if (std::exchange(resume_, false)) set_runtime(kPlaying);
  }
}

void SafetyMachine::fault() noexcept {
  stop(kFault, kFaultBit);
  cut_power();
}

void SafetyMachine::violation() noexcept {
  stop(kViolation, kViolationBit);
  cut_power();
}

void SafetyMachine::clear() noexcept {
  status_ = {};
  in_mode_ = Duration(0);
  releasing_brakes_ = resume_ = false;
}

bool SafetyMachine::power_on() noexcept {
  if (stopped()) return false;
  if (status_.robot_mode != kPowerOff) return true;  // is on already
  status_.robot_mode = kBooting;
  status_.robot_status_bits |= kPowerBit;
  in_mode_ = Duration(0);
  return true;
}

bool SafetyMachine::power_off() noexcept {
  cut_power();
  return true;
}

bool SafetyMachine::release_brakes() noexcept {
  if (stopped()) return false;
  if (status_.robot_mode == kRunning) return true;
  if (status_.robot_mode != kIdle) return false;
  if (!std::exchange(releasing_brakes_, true)) in_mode_ = Duration(0);
  return true;
}

bool SafetyMachine::unlock_protective_stop() noexcept {
  if (status_.safety_status != kProtective || in_mode_ < times_.unlock) return false;
  back_to_normal();
  return true;
}

bool SafetyMachine::restart_safety() noexcept {
  if (status_.safety_status != kViolation && status_.safety_status != kFault) return false;
  back_to_normal();
  return true;
}

bool SafetyMachine::pause_program() noexcept {
  if (!playing()) return false;
  set_runtime(kPaused);
  return true;
}

void SafetyMachine::set_program_running(bool running) noexcept {
  if (running && !may_move()) return;
  resume_ = false;
  set_runtime(running ? kPlaying : kStopped);
}

void SafetyMachine::set_speed_slider(double fraction) noexcept {
  if (std::isfinite(fraction)) speed_slider_ = std::clamp(fraction, 0.0, 1.0);
}

void SafetyMachine::stop(std::int32_t safety_status, std::uint32_t bits) noexcept {
  status_.safety_status = safety_status;
  status_.safety_status_bits = bits | kStoppedBit;
  in_mode_ = Duration(0);
}

void SafetyMachine::cut_power() noexcept {
  status_.robot_mode = kPowerOff;
  status_.robot_status_bits &= ~kPowerBit;
  releasing_brakes_ = resume_ = false;
  in_mode_ = Duration(0);
  set_runtime(kStopped);
}

void SafetyMachine::back_to_normal() noexcept {
  status_.safety_status = kNormal;
  status_.safety_status_bits = kNormalBit;
  in_mode_ = Duration(0);
  popup_ = {};
}

void SafetyMachine::set_runtime(std::uint32_t state) noexcept {
  status_.runtime_state = state;
  const std::uint32_t program = state == kPlaying ? kProgramBit : 0U;
  status_.robot_status_bits = (status_.robot_status_bits & ~kProgramBit) | program;
}

}  // namespace embody::sim
