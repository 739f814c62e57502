#pragma once
// What a running script sees of its controller.
#include <string_view>

#include "core/hal/types.hpp"

namespace embody::sim::urscript {

inline constexpr int kRegisters = 48;  ///< of each kind; addresses count from 0

enum class JointQuantity : std::uint8_t { kActualPosition, kActualSpeed, kTargetPosition, kTargetSpeed };

enum class MessageKind : std::uint8_t { kText, kPopup };

struct ServoCommand {
  Vector6 q_rad{Vector6::Zero()};
  double time_s{0.0};       ///< how long the call blocks
  double lookahead_s{0.0};  ///< 0.03 to 0.2
  double gain{0.0};         ///< 100 to 2000
};

class ScriptHost {
 public:
  virtual ~ScriptHost() = default;

  /// Length of a control cycle.
  [[nodiscard]] virtual double step_time_s() const noexcept = 0;
  /// 0 to 1: how fast motion proceeds; a servoj call takes this much longer.
  [[nodiscard]] virtual double speed_scaling() const noexcept = 0;
  /// A stopj call goes on until this is true.
  [[nodiscard]] virtual bool at_rest() const noexcept = 0;
  /// Values of all six joints, rad or rad/s.
  [[nodiscard]] virtual Vector6 joints(JointQuantity quantity) const noexcept = 0;
  [[nodiscard]] virtual bool within_limits(const Vector6& q_rad) const noexcept = 0;

  /// @pre 0 <= address < kRegisters, here and below
  [[nodiscard]] virtual std::int32_t input_int(int address) const noexcept = 0;
  [[nodiscard]] virtual double input_double(int address) const noexcept = 0;
  [[nodiscard]] virtual bool input_bool(int address) const noexcept = 0;
  virtual void set_output_int(int address, std::int32_t value) noexcept = 0;
  virtual void set_output_double(int address, double value) noexcept = 0;
  virtual void set_output_bool(int address, bool value) noexcept = 0;

  /// The motion of this and the following cycles, until the call has lasted its time.
  virtual void servoj(const ServoCommand& command) noexcept = 0;
  virtual void stopj(double deceleration_rad_s2) noexcept = 0;
  /// The motion call is over; the next one, if any, comes in the same cycle.
  virtual void motion_done() noexcept = 0;
  /// False when there is no such input variable.
  virtual bool set_watchdog(std::string_view variable, double min_frequency_hz, bool stop) noexcept = 0;
  virtual void message(MessageKind kind, std::string_view text) noexcept = 0;
};

}  // namespace embody::sim::urscript
