#pragma once
// A controller for tests of the interpreter: registers as arrays, and a record of what the script did.
#include <array>
#include <string>
#include <vector>

#include "drivers/sim/ur/urscript/compiler.hpp"
#include "drivers/sim/ur/urscript/machine.hpp"

namespace embody::sim::urscript {

class RecordingHost : public ScriptHost {
 public:
  [[nodiscard]] double step_time_s() const noexcept override { return step_s; }
  [[nodiscard]] double speed_scaling() const noexcept override { return scaling; }
  [[nodiscard]] bool at_rest() const noexcept override { return rest; }
  [[nodiscard]] Vector6 joints(JointQuantity quantity) const noexcept override {
    return Vector6::Constant(1.0 + static_cast<int>(quantity));
  }
  [[nodiscard]] bool within_limits(const Vector6& q) const noexcept override { return q.cwiseAbs().maxCoeff() < 6.3; }
  [[nodiscard]] std::int32_t input_int(int address) const noexcept override { return ints_in[std::size_t(address)]; }
  [[nodiscard]] double input_double(int address) const noexcept override { return doubles_in[std::size_t(address)]; }
  [[nodiscard]] bool input_bool(int) const noexcept override { return true; }
  void set_output_int(int address, std::int32_t value) noexcept override { ints[std::size_t(address)] = value; }
  void set_output_double(int address, double value) noexcept override { doubles[std::size_t(address)] = value; }
  void set_output_bool(int address, bool value) noexcept override { bools[std::size_t(address)] = value; }
  void servoj(const ServoCommand& command) noexcept override {
    servo = command;
    ++servo_calls;
  }
  void stopj(double deceleration) noexcept override { stop_deceleration = deceleration; }
  void motion_done() noexcept override { ++motions_done; }
  bool set_watchdog(std::string_view name, double hz, bool) noexcept override {
    watchdog_hz = hz;
    return name.starts_with("input_");
  }
  void message(MessageKind, std::string_view text) noexcept override {
    if (keep_messages) messages.emplace_back(text);
  }

  double step_s{0.002};
  double scaling{1.0};
  bool rest{true};
  bool keep_messages{true};
  std::array<std::int32_t, kRegisters> ints_in{}, ints{};
  std::array<double, kRegisters> doubles_in{}, doubles{};
  std::array<bool, kRegisters> bools{};
  ServoCommand servo;
  int servo_calls{0};
  int motions_done{0};
  double stop_deceleration{0.0};
  double watchdog_hz{0.0};
  std::vector<std::string> messages;
};

}  // namespace embody::sim::urscript
