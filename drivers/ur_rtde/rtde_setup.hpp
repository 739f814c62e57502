#pragma once
// Set-up of an RTDE session: one request at a time, each reply checked, until the stream runs. Waits, and allocates.
#include "core/base/time.hpp"
#include "drivers/ur_rtde/arm_package.hpp"
#include "drivers/ur_rtde/frame_buffer.hpp"

namespace embody::rtde {

struct SetupConfig {
  double frequency_hz{500.0};  ///< wanted packages per second
  Duration reply_timeout{std::chrono::seconds(1)};
  Duration in_use_patience{std::chrono::seconds(4)};
  std::uint32_t greeting_sequence{0};  ///< of the mode 0 command that is sent before the stream starts
};

struct Session {
  ControllerVersion version;
  double rate_hz{0.0};  ///< packages per second that the controller really sends
  OutputRecipe outputs;
  std::uint8_t output_id{0};
  std::uint8_t input_id{0};
};

class Setup {
 public:
  /// `fd` is a fresh connection; `buffer` is empty, and holds the beginning of the stream afterwards.
  Setup(int fd, FrameBuffer& buffer, const SetupConfig& config) : fd_(fd), buffer_(buffer), config_(config) {}

  /// Errors: kDisconnected, kTimeout, kUnsupported (protocol version), kNotFound (a variable is missing), kRefused
  /// (registers owned by somebody else, or the stream was refused), kMalformed.
  Result<Session> run(TimePoint deadline);
  /// What the controller said last, empty when it said nothing.
  [[nodiscard]] const FixedString<120>& last_text() const noexcept { return last_text_; }

 private:
  Status negotiate(TimePoint deadline);
  Status setup_outputs(TimePoint deadline);
  Status setup_inputs(TimePoint deadline);
  Status start_stream(TimePoint deadline);
  Result<Frame> exchange(PackageType type, Bytes request, TimePoint deadline);
  Status idle_until(TimePoint until);
  Result<ParsedFrame> next_frame(TimePoint deadline);

  int fd_;
  FrameBuffer& buffer_;
  SetupConfig config_;
  Session session_;
  FixedString<120> last_text_;
};

}  // namespace embody::rtde
