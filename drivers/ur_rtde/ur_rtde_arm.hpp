#pragma once
// A Universal Robots arm behind RTDE (e-Series 5.4 or newer, protocol version 2).
//
// RTDE carries no motion: a control program on the robot reads our input registers and writes its own state into output
// registers (docs/ur_rtde.md). That program is not part of this driver and has to be running on the controller; until
// it runs, states arrive with condition kProgramStopped and nothing moves. Registers, all in the range for external
// clients:
//   in   int 24 sequence (31 bits), int 25 mode (0 hold, 1 track, 9 exit), double 24-29 target q (rad),
//        double 30-35 target velocity (rad/s)
//   out  int 24 newest sequence seen, int 25 state (1 hold, 2 tracking, 3 stale, 9 ended), int 26 fault code,
//        int 27 version of this register protocol (1)
#include <string>

#include "core/hal/arm_driver.hpp"
#include "drivers/transport/unique_fd.hpp"
#include "drivers/ur_rtde/arm_package.hpp"
#include "drivers/ur_rtde/frame_buffer.hpp"

namespace embody {

struct UrRtdeConfig {
  std::string host{"127.0.0.1"};
  std::uint16_t port{30004};
  double frequency_hz{500.0};  ///< wanted packages per second, 1 to 500 (CB3: at most 125)
  Duration reply_timeout{std::chrono::seconds(1)};
  /// How long registers may stay owned by somebody else (a lost session of ours, for instance) before connect() fails.
  Duration in_use_patience{std::chrono::seconds(4)};
  /// How long commands may fail to get through (they are dropped meanwhile) before write() ends the session.
  Duration backlog_limit{std::chrono::milliseconds(100)};
};

class UrRtdeArm : public ArmDriver {
 public:
  explicit UrRtdeArm(UrRtdeConfig config);
  /// Leaves mode 0 in the robot's registers, then closes. Waits at most 100 ms for the controller to have read it.
  ~UrRtdeArm() override;

  /// Negotiates version 2, sets up both recipes, writes mode 0 (nothing moves) and starts the stream. Ends a session
  /// that is still open like the destructor does. Errors: kDisconnected, kTimeout, kUnsupported (firmware too old),
  /// kNotFound (a variable is missing), kRefused (registers owned by somebody else, or the stream was refused),
  /// kMalformed, kInvalidArgument (frequency).
  Result<ArmInfo> connect() override;
  Status service() override;

  /// One package per call, in order. Bytes that break the protocol and joint angles that are not finite end the
  /// session.
  IoStatus read(ArmState& state) noexcept override;

  /// One package, in one send(). kEmpty while more than 4 kB of commands are on the way. kRefused when the
  /// command has expired, or tracks a target that is not finite.
  IoStatus write(const ArmCommand& command, TimePoint now) noexcept override;

  /// The last text message of the controller.
  [[nodiscard]] std::string_view last_text() const noexcept { return last_text_.view(); }

 private:
  Result<rtde::ControllerVersion> negotiate(TimePoint deadline);
  Status setup_outputs(double frequency_hz, TimePoint deadline);
  Status setup_inputs(TimePoint deadline);
  Status start_stream(TimePoint deadline);
  Result<rtde::Frame> exchange(rtde::PackageType type, rtde::Bytes request, TimePoint deadline);
  Status idle_until(TimePoint until);
  Result<rtde::ParsedFrame> next_frame(TimePoint deadline);
  Error give_up(const Error& error);
  void remember_text(rtde::Bytes payload) noexcept;
  IoStatus send_hold(std::uint32_t sequence) noexcept;
  IoStatus end_session(std::string_view reason) noexcept;
  void close_session() noexcept;

  UrRtdeConfig config_;
  transport::UniqueFd fd_;
  bool streaming_{false};
  rtde::FrameBuffer buffer_;
  TimePoint t_received_{};
  TimePoint blocked_since_{};
  std::uint64_t packages_{0};
  std::uint32_t last_sequence_{0};
  std::uint8_t output_recipe_{0};
  std::uint8_t input_recipe_{0};
  rtde::CommandPackage package_{};
  FixedString<120> last_text_;
};

}  // namespace embody
