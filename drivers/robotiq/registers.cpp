#include "drivers/robotiq/registers.hpp"

#include <algorithm>
#include <cmath>

namespace embody::robotiq {
namespace {

constexpr unsigned kActivateBit = 0x01;
constexpr unsigned kGoBit = 0x08;
constexpr unsigned kActivationShift = 4;
constexpr unsigned kObjectShift = 6;

std::uint16_t word(unsigned high, unsigned low) noexcept {
  return static_cast<std::uint16_t>((high << 8) | low);
}
std::uint8_t high(std::uint16_t word) noexcept {
  return static_cast<std::uint8_t>(word >> 8);
}
std::uint8_t low(std::uint16_t word) noexcept {
  return static_cast<std::uint8_t>(word & 0xFF);
}

}  // namespace

Registers pack(const GripperCommand& command) noexcept {
  const unsigned action = (command.activate ? kActivateBit : 0) | (command.go ? kGoBit : 0);
  return {word(action, 0), word(0, command.position), word(command.speed, command.force)};
}

GripperCommand unpack_command(const Registers& registers) noexcept {
  const unsigned action = high(registers[0]);
  return {(action & kActivateBit) != 0, (action & kGoBit) != 0, low(registers[1]), high(registers[2]),
          low(registers[2])};
}

Registers pack(const GripperStatus& status) noexcept {
  const unsigned byte0 = (status.activate ? kActivateBit : 0) | (status.go ? kGoBit : 0) |
                         (static_cast<unsigned>(status.activation) << kActivationShift) |
                         (static_cast<unsigned>(status.object) << kObjectShift);
  const unsigned faults = (status.controller_fault & 0x0FU) << 4 | (status.fault & 0x0FU);
  return {word(byte0, 0), word(faults, status.position_echo), word(status.position, status.current)};
}

GripperStatus unpack_status(const Registers& registers) noexcept {
  const unsigned byte0 = high(registers[0]);
  GripperStatus status;
  status.activate = (byte0 & kActivateBit) != 0;
  status.go = (byte0 & kGoBit) != 0;
  status.activation = static_cast<Activation>((byte0 >> kActivationShift) & 3U);
  status.object = static_cast<ObjectState>((byte0 >> kObjectShift) & 3U);
  status.fault = high(registers[1]) & 0x0F;
  status.controller_fault = high(registers[1]) >> 4;
  status.position_echo = low(registers[1]);
  status.position = high(registers[2]);
  status.current = low(registers[2]);
  return status;
}

const char* fault_text(std::uint8_t fault) noexcept {
  switch (fault) {
    case 0x0:
      return "no fault";
    case 0x5:
      return "the gripper waits for the end of its activation";
    case 0x7:
      return "the gripper was told to move before it was activated";
    case 0x8:
      return "the gripper is too hot: let it cool down";
    case 0x9:
      return "the gripper heard nothing for a second";
    case 0xA:
      return "the gripper's supply voltage is too low: check its power, then activate it again";
    case 0xB:
      return "the gripper is in automatic release: wait, then activate it again";
    case 0xC:
      return "the gripper reports an internal fault: activate it again, or ask the vendor";
    case 0xD:
      return "the gripper's activation failed: is something in the way of its fingers?";
    case 0xE:
      return "the gripper's motor took too much current: activate it again";
    case 0xF:
      return "the gripper's automatic release is over: activate it again";
    default:
      return "the gripper reports a fault that its manual does not list";
  }
}

bool allows_motion(std::uint8_t fault) noexcept {
  return fault == 0x0 || fault == 0x9;
}

bool needs_activation(std::uint8_t fault) noexcept {
  return fault >= 0xA;
}

int counts_of(const PositionScale& scale, double q_rad) noexcept {
  const double part = std::clamp((q_rad - scale.open_rad) / (scale.closed_rad - scale.open_rad), 0.0, 1.0);
  return static_cast<int>(std::lround(scale.open_counts + part * (scale.closed_counts - scale.open_counts)));
}

double angle_of(const PositionScale& scale, int counts) noexcept {
  const double part = static_cast<double>(counts - scale.open_counts) / (scale.closed_counts - scale.open_counts);
  return scale.open_rad + part * (scale.closed_rad - scale.open_rad);
}

}  // namespace embody::robotiq
