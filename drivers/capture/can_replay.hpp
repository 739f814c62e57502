#pragma once
// The device side of a capture of CAN, played to a driver over the double of can_double.hpp. A fixture for tests.
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "core/base/result.hpp"
#include "drivers/capture/capture.hpp"
#include "drivers/capture/poll_thread.hpp"
#include "drivers/capture/replay.hpp"
#include "drivers/transport/can_frame.hpp"

namespace embody::capture {

/// What a message of the double is: a struct can_frame, or, for a driver that has ISO-TP from the kernel, a whole
/// message.
enum class CanReplayAs : std::uint8_t { kFrames, kIsoTpMessages };

/// Own thread. The first driver that connects hears what was recorded, one frame after the other, each when it has read
/// the last; further ones are refused. Before the device says something it waits until the driver has sent as many
/// frames of each identifier as had come by then, but for those of `unawaited`: a heartbeat goes by the clock and not
/// by what the device says. What the frames hold is counted, not judged. After the last chunk the connection stays
/// open, unless the recorded device has closed it.
class CanReplay {
 public:
  explicit CanReplay(Capture capture, CanReplayAs as = CanReplayAs::kFrames,
                     std::vector<transport::CanId> unawaited = {});
  CanReplay(const CanReplay&) = delete;
  CanReplay& operator=(const CanReplay&) = delete;
  ~CanReplay();

  /// Errors: kUnsupported (another link), kInvalidArgument (nothing recorded, more than one connection), those of
  /// join_isotp(), kIo.
  Status start();

  /// What the driver has to open: "unix:/path".
  [[nodiscard]] std::string interface() const { return "unix:" + folder_ + "/can"; }
  /// All was played, and read.
  [[nodiscard]] bool finished();
  /// Frames, not bytes.
  [[nodiscard]] ReplayReport report();

 private:
  class Script;

  void run();
  void accept();

  Capture capture_;
  const CanReplayAs as_;
  const std::vector<transport::CanId> unawaited_;
  std::string folder_;
  transport::UniqueFd listener_;
  std::mutex mutex_;  // of what follows
  std::unique_ptr<Script> script_;
  ReplayReport report_;
  PollThread thread_;
};

}  // namespace embody::capture
