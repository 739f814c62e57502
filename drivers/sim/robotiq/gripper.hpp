#pragma once
// What a Robotiq gripper does with the bytes it gets: no thread, no file, no clock. Time is an argument.
#include <deque>
#include <optional>
#include <span>
#include <vector>

#include "core/base/time.hpp"
#include "drivers/robotiq/modbus.hpp"
#include "drivers/robotiq/registers.hpp"
#include "drivers/sim/robotiq/fault_words.hpp"

namespace embody::sim {

struct RobotiqGripperConfig {
  int slave{9};
  Duration reply_delay{std::chrono::milliseconds(2)};
  bool activated{false};  ///< at power-up: as if a host had been here before
  double start_counts{100.0};
  double min_counts{3.0};  ///< where the fingers stop when they are open
  double max_counts{252.0};
  double activation_s{1.5};                        ///< to open, close and open again
  double stroke_mm{140.0};                         ///< of 255 counts
  double slowest_mm_s{30.0}, fastest_mm_s{250.0};  ///< at rSP 0 and 255; vendor's data sheet of the 2F-140
};

struct RobotiqGripperCounters {
  std::uint64_t requests{0};     ///< intact frames to this slave
  std::uint64_t reads{0};        ///< of these: with a status
  std::uint64_t motions{0};      ///< of these: "go" to an activated gripper
  std::uint64_t stops{0};        ///< of these: activated, not "go"
  std::uint64_t resets{0};       ///< of these: rACT 0
  std::uint64_t activations{0};  ///< of these: rACT from 0 to 1
  std::uint64_t skipped_bytes{0};
  std::uint64_t too_early{0};  ///< requests that came before the answer to the last one
};

/// Time never runs backwards: an earlier `now` counts as the latest one seen.
class RobotiqGripper {
 public:
  RobotiqGripper(const RobotiqGripperConfig& config, TimePoint now);

  using Byte = std::byte;  ///< of receive()

  /// Takes bytes of the host that arrived at `now`.
  void receive(std::span<const std::byte> bytes, TimePoint now);
  /// Moves on to `now`; returns what the gripper has to say until then.
  std::vector<std::byte> advance(TimePoint now);
  /// When advance() will next have something to say; nothing: not before the host speaks.
  [[nodiscard]] std::optional<TimePoint> next_event() const noexcept;
  /// The host has gone: half a frame and answers under way are forgotten; a motion goes on.
  void forget_host() noexcept;
  /// Everything but kUnplug and kPlug, which are the line's.
  void apply(const RobotiqFault& fault) noexcept;

  [[nodiscard]] double counts() const noexcept { return counts_; }
  /// Length of the way that the fingers have gone so far, in counts.
  [[nodiscard]] double travelled_counts() const noexcept { return travelled_; }
  [[nodiscard]] robotiq::GripperStatus status() const noexcept;
  [[nodiscard]] RobotiqGripperCounters counters() const noexcept;

 private:
  struct Pending {
    TimePoint due{};
    std::vector<std::byte> bytes;
  };

  void move_to(TimePoint now) noexcept;
  bool approach(double target, double speed, double dt_s) noexcept;
  void step_activation(double dt_s) noexcept;
  void step_motion(double dt_s) noexcept;
  void execute(const modbus::Request& request);
  modbus::Reply answer(const modbus::Request& request) noexcept;
  void obey(const robotiq::GripperCommand& command) noexcept;
  void say(const modbus::Request& request, const modbus::Reply& reply);
  [[nodiscard]] double object_counts() const noexcept;

  RobotiqGripperConfig config_;
  modbus::Assembler incoming_;
  std::deque<Pending> pending_;
  TimePoint now_;
  TimePoint last_heard_;
  robotiq::Registers written_{};  ///< the command registers
  robotiq::GripperCommand command_;
  robotiq::Activation activation_{robotiq::Activation::kReset};
  int activation_leg_{0};
  robotiq::ObjectState object_{robotiq::ObjectState::kMoving};
  std::uint8_t fault_{0};
  double counts_;
  double travelled_{0.0};
  bool moving_{false};
  RobotiqGripperCounters counters_;

  // Faults
  bool mute_{false};
  int drop_{0}, garble_{0}, crc_{0}, exception_{0};
  double object_mm_{-1.0};
};

}  // namespace embody::sim
