#pragma once
// One tick per package of the robot: mode machine, arm controller, command. Owns both.
#include "core/safety/mode_machine.hpp"
#include "core/teleop/arm_controller.hpp"
#include "core/teleop/clock_map.hpp"
#include "daemon/loops/edges.hpp"

namespace embody {

struct ArmLoopConfig {
  Duration period{std::chrono::milliseconds(2)};  ///< until a session tells its own
  Duration command_lifetime{std::chrono::milliseconds(20)};
  Duration arming_grace{std::chrono::milliseconds(300)};
};

class ArmLoop {
 public:
  ArmLoop(ArmBaton& arm, const TrackerBaton& tracker, const teleop::ArmControllerConfig& controller,
          const safety::ModeConfig& modes, const ArmLoopConfig& config, Edges& edges) noexcept
      : arm_(arm),
        tracker_(tracker),
        controller_(controller),
        machine_(modes),
        config_(config),
        edges_(edges),
        period_(config.period) {}
  /// Until edges.stop and the arm stands still (at most kStopTime later). No heap, lock, log or exception.
  void run() noexcept;

 private:
  static constexpr Duration kStopTime = std::chrono::seconds(3);
  static constexpr Duration kSilence = std::chrono::milliseconds(100);       // without a package: the arm is lost
  static constexpr Duration kFirstPackage = std::chrono::milliseconds(500);  // the same for the first of a session

  void read_packages() noexcept;
  void begin_session() noexcept;
  void lose_arm() noexcept;
  void take_pose() noexcept;
  void tick(TimePoint t_tick) noexcept;
  void step_modes(TimePoint now) noexcept;
  [[nodiscard]] bool arm_following(TimePoint now) const noexcept;
  [[nodiscard]] bool robot_at_rest() const noexcept;
  [[nodiscard]] teleop::ArmReference step_controller(TimePoint t_robot, double dt_s) noexcept;
  void send(const teleop::ArmReference& reference, TimePoint t_tick) noexcept;

  ArmBaton& arm_;
  const TrackerBaton& tracker_;
  teleop::ArmController controller_;
  safety::ModeMachine machine_;
  ArmLoopConfig config_;
  Edges& edges_;

  Duration period_;  // of the robot's packages
  ArmReport report_;
  teleop::ClockMap robot_clock_;
  Duration last_controller_time_{0};
  TimePoint t_package_{};  // of the newest package
  TimePoint t_session_{};  // when the driver came to this loop
  TimePoint t_expires_{};  // of the command that answers the newest package
  bool arm_alive_{false};
  bool commanding_{false};      // the last command was kTrack
  bool tracked_{false};         // the robot has followed since engaging
  bool engage_pending_{false};  // the clutch is still to be set
  bool reachable_{false};
  TimePoint t_pose_{};  // capture time of the newest usable pose
  std::uint32_t streak_{0};
  std::uint64_t last_pose_{0};  // sequence
  std::uint32_t jumps_{0};
  std::uint32_t jumps_engaged_{0};  // when motion began
  bool pose_is_new_{false};         // not yet in a command
  std::uint32_t sequence_{0};
};

}  // namespace embody
