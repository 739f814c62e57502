#pragma once
// Helpers of the Qualisys tests: made-up recordings, waiting with a deadline, a peer that follows a script.
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "core/hal/hand_tracker.hpp"
#include "drivers/qualisys/codec.hpp"
#include "drivers/recording/recording.hpp"
#include "drivers/transport/unique_fd.hpp"

namespace embody::test {

using Bytes = std::vector<std::byte>;

/// `frames` random frames within 1 m; every marker is missing in one frame of ten. All floats are exact in mm / 8.
recording::Recording random_recording(std::vector<std::string> names, std::size_t frames, double rate_hz,
                                      unsigned seed);

/// True as soon as `condition` holds, false after ten seconds.
bool eventually(const std::function<bool()>& condition);

/// Reads until `tracker` has a frame or ends the session; kEmpty only after ten seconds.
IoStatus next_frame(HandTracker& tracker, int fd, MarkerFrame& frame);

/// A server that greets, then answers each text packet with what the script returns. Serves any number of clients.
class ScriptedPeer {
 public:
  using Script = std::function<std::vector<Bytes>(std::string_view command)>;
  ScriptedPeer(Bytes greeting, Script script);
  ~ScriptedPeer();
  [[nodiscard]] std::uint16_t port() const noexcept { return port_; }

 private:
  void run();
  Bytes greeting_;
  Script script_;
  transport::UniqueFd listener_;
  transport::UniqueFd stop_;
  std::uint16_t port_{0};
  std::thread thread_;
};

/// The greeting of QTM.
Bytes welcome();

/// Plays a sound QTM with `labels`, except that `exception`, where it returns something, comes first.
ScriptedPeer::Script sound_script(std::vector<std::string> labels, ScriptedPeer::Script exception);

}  // namespace embody::test
