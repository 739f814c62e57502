#pragma once
// The simulated controller without its thread: robot, ports, and one control cycle at a time.
#include "drivers/sim/ur/controller_config.hpp"
#include "drivers/sim/ur/dashboard_port.hpp"
#include "drivers/sim/ur/rtde_server.hpp"
#include "drivers/sim/ur/rtde_values.hpp"
#include "drivers/sim/ur/script_port.hpp"

namespace embody::sim {

/// Ports of a listening controller, 0 for those that it does not have.
struct ControllerPorts {
  std::uint16_t rtde{0};
  std::uint16_t primary{0};
  std::uint16_t secondary{0};
  std::uint16_t realtime{0};
  std::uint16_t dashboard{0};
};

/// Faults that last until they are taken back.
struct ControllerFaults {
  bool frozen{false};         ///< nothing is sent or read, the sockets stay open
  bool deaf{false};           ///< nothing is read
  bool clock_stands{false};   ///< packages go out with the same time stamp
  bool refuse_upload{false};  ///< C210 although in remote control
  TimePoint frozen_until{};   ///< frozen for a while
};

class ControllerLoop {
 public:
  explicit ControllerLoop(const UrControllerConfig& config);

  /// Errors: kInvalidArgument, kIo, kNotFound (model).
  [[nodiscard]] Status listen();
  [[nodiscard]] ControllerPorts ports() const noexcept;

  /// Before the cycles of one round: takes what clients sent.
  void receive(TimePoint now);
  /// One control cycle of length `dt`.
  void step(Duration dt) noexcept;
  /// After the cycles `previous` (exclusive) to `cycle` (inclusive): sends what is due.
  void publish(std::uint64_t previous, std::uint64_t cycle);

  /// Closes the RTDE connections as a restarting controller does; the clock begins anew.
  void restart_rtde() noexcept;
  /// From remote to local control the ports 30001 to 30003 lose their clients.
  void set_remote(bool remote) noexcept;
  void set_settings(const rtde::ArmSettings& settings) noexcept { values_.write_settings(settings_ = settings); }

  [[nodiscard]] UrRobot& robot() noexcept { return robot_; }
  [[nodiscard]] RtdeServer& server() noexcept { return server_; }
  [[nodiscard]] RtdeValues& values() noexcept { return values_; }
  [[nodiscard]] ControllerFaults& faults() noexcept { return faults_; }
  [[nodiscard]] const rtde::ArmSettings& settings() const noexcept { return settings_; }

 private:
  [[nodiscard]] bool frozen() const noexcept { return faults_.frozen || now_ < faults_.frozen_until; }
  [[nodiscard]] RobotReport report();
  [[nodiscard]] math::Vector6 tcp_pose() const;
  [[nodiscard]] std::vector<Message> greeting();
  void take_program(const std::string& program);
  void send_texts();
  void publish_streams(std::uint64_t previous, std::uint64_t cycle);

  UrControllerConfig config_;
  ur::UrKinematics kinematics_;
  RtdeServer server_;
  RtdeValues values_;
  UrRobot robot_;
  ScriptPort primary_, secondary_, realtime_;
  DashboardPort dashboard_;
  DashboardInfo dashboard_info_;
  ControllerFaults faults_;
  rtde::ArmSettings settings_;
  TimePoint now_{};
  RegisterInputs inputs_;
  std::uint64_t cycle_{0};
  std::uint64_t first_cycle_{0};  ///< where the clock was zero
};

}  // namespace embody::sim
