#pragma once
// A Universal Robots arm behind RTDE (e-Series 5.4 or newer, CB-Series 3.10 or newer, protocol version 2).
//
// RTDE carries no motion: a control program on the robot reads our input registers and writes its own state into output
// registers (docs/ur_rtde.md). service() uploads it over the primary port when the robot runs and no program plays; it
// stands still until commands come. Registers, all in the range for external clients:
//   in   int 24 sequence (31 bits), int 25 mode (0 hold, 1 track, 9 exit), double 24-29 target q (rad),
//        double 30-35 target velocity (rad/s)
//   out  int 24 newest sequence seen, int 25 state (1 hold, 2 tracking, 3 stale, 9 ended), int 26 fault code,
//        int 27 version of this register protocol (1)
#include <memory>
#include <string>

#include "core/hal/arm_driver.hpp"
#include "drivers/transport/unique_fd.hpp"
#include "drivers/ur_rtde/arm_status.hpp"
#include "drivers/ur_rtde/control_script.hpp"
#include "drivers/ur_rtde/echo_watch.hpp"
#include "drivers/ur_rtde/installation_check.hpp"
#include "drivers/ur_rtde/rtde_setup.hpp"

namespace embody {

namespace ur {
class ProgramUpload;
}

struct UrRtdeConfig {
  std::string host{"127.0.0.1"};
  std::uint16_t port{30004};
  double frequency_hz{500.0};  ///< wanted packages per second, 1 to 500 (CB3: at most 125)
  Duration reply_timeout{std::chrono::seconds(1)};
  /// How long registers may stay owned by somebody else (a lost session of ours, for instance) before connect() fails.
  Duration in_use_patience{std::chrono::seconds(4)};
  /// How long commands may fail to get through (they are dropped meanwhile) before write() ends the session.
  Duration backlog_limit{std::chrono::milliseconds(100)};
  /// How long the controller's clock may stand still before read() ends the session.
  Duration stale_after{std::chrono::milliseconds(100)};
  /// How long the program may leave commands unanswered before it counts as not running; a slow speed slider
  /// stretches the program's cycles.
  Duration echo_patience{std::chrono::milliseconds(250)};
  bool upload{true};                               ///< service() loads the control program
  std::uint16_t primary_port{30001};               ///< where it does
  Duration upload_retry{std::chrono::seconds(5)};  ///< pause after the robot has refused it
  rtde::ControlScriptConfig script;                ///< limits that the control program keeps
  ur::ExpectedInstallation expected;               ///< what service() compares
};

/// What happened since the driver exists.
struct UrCounters {
  Counter packages;         ///< states taken
  Counter missing;          ///< packages that the controller's clock passed over
  Counter stale;            ///< packages whose time stamp did not advance
  Counter commands;         ///< handed to the kernel
  Counter refused;          ///< commands that had expired or were not finite
  Counter blocked;          ///< commands dropped because earlier ones were still on the way
  Counter messages;         ///< texts of the controller
  Counter silences;         ///< times that the control program left our commands unanswered
  Counter uploads;          ///< control programs sent
  Counter upload_failures;  ///< of these: refused, or not seen to start
};

class UrRtdeArm : public ArmDriver {
 public:
  explicit UrRtdeArm(UrRtdeConfig config);
  /// Leaves mode 0 in the robot's registers, then closes. Waits at most 100 ms for the controller to have read it.
  ~UrRtdeArm() override;

  /// Negotiates version 2, sets up both recipes, writes mode 0 (nothing moves) and starts the stream. Ends a session
  /// that is still open like the destructor does. Errors: kDisconnected, kTimeout, kUnsupported (firmware too old),
  /// kNotFound (a variable is missing), kRefused (registers owned by somebody else, or the stream was refused),
  /// kMalformed, kInvalidArgument (frequency, limits of the control program).
  Result<ArmInfo> connect() override;

  /// Loads the control program when the robot runs and nothing plays, and compares arm model, payload and tool centre
  /// point with the configuration. Waits at most 0.3 s, for the connection to the program port. Errors are sentences
  /// for the operator: kRefused (the robot is off, stopped, in local control, plays another program; a setting
  /// differs), kMalformed (the robot rejects the program), kTimeout, kDisconnected.
  Status service() override;

  /// One package per call, in order. Bytes that break the protocol, joint angles that are not finite, and a
  /// controller's clock that stands still or goes back end the session.
  IoStatus read(ArmState& state) noexcept override;

  /// One package, in one send(). kEmpty while more than 4 kB of commands are on the way. kRefused when the
  /// command has expired, or tracks a target that is not finite.
  IoStatus write(const ArmCommand& command, TimePoint now) noexcept override;

  [[nodiscard]] const UrCounters& counters() const noexcept { return counters_; }
  /// The last text message of the controller.
  [[nodiscard]] std::string_view last_text() const noexcept { return last_text_.view(); }
  /// Newest modes of the controller, why it limits the speed among them; from any thread.
  [[nodiscard]] ur::ArmSnapshot snapshot() const noexcept { return shared_.snapshot(); }
  /// Version of the connected controller's software; zeros before connect().
  [[nodiscard]] const rtde::ControllerVersion& version() const noexcept { return session_.version; }
  /// Geometry that the controller reported to service(), calibration worked in; empty until then.
  [[nodiscard]] std::optional<ur::UrKinematics> kinematics() const;

 private:
  Error give_up(const Error& error);
  IoStatus take_frame(const rtde::Frame& frame, ArmState& state) noexcept;
  IoStatus take_state(rtde::Bytes fields, ArmState& state) noexcept;
  void publish_settings(rtde::Bytes fields) noexcept;
  void count_package(Duration controller_time) noexcept;
  IoStatus check_clock() noexcept;
  IoStatus end_session(std::string_view reason) noexcept;
  void close_session() noexcept;

  UrRtdeConfig config_;
  UrCounters counters_;
  transport::UniqueFd fd_;
  bool streaming_{false};
  bool answers_{true};  ///< the control program repeated our sequences in the last package
  rtde::FrameBuffer buffer_;
  rtde::Session session_;
  std::size_t time_scale_offset_{0};  ///< of optional fields, 0: the firmware has none
  std::size_t settings_offset_{0};
  TimePoint t_received_{};
  TimePoint t_advanced_{};  ///< when the controller's clock advanced last
  Duration controller_time_{0};
  TimePoint blocked_since_{};
  std::uint64_t packages_{0};
  std::uint32_t last_sequence_{0};
  ur::EchoWatch echo_;
  rtde::CommandPackage package_{};
  FixedString<120> last_text_;
  ur::SharedArmStatus shared_;  // written by read() and write(), read by service()
  std::unique_ptr<ur::ProgramUpload> program_;
};

}  // namespace embody
