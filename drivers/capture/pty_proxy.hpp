#pragma once
// Stands between a driver and a serial device and records what passes. The driver opens a pseudo-terminal instead.
#include <atomic>
#include <optional>
#include <string>

#include "drivers/capture/capture_writer.hpp"
#include "drivers/capture/pipe.hpp"
#include "drivers/capture/poll_thread.hpp"
#include "drivers/transport/pty.hpp"

namespace embody::capture {

/// Own thread. The real line belongs to the proxy from open() on; each time that a driver opens the pseudo-terminal is
/// a connection (one who closes and opens it at once may stay the same one). What the device says while none has it
/// open is dropped. When the real line is gone, the driver sees a hang-up and the proxy is over. A pseudo-terminal has
/// no bit rate and no low-latency flag; the real line has both.
class PtyProxy {
 public:
  explicit PtyProxy(CaptureWriter& writer) : writer_(writer) {}
  PtyProxy(const PtyProxy&) = delete;
  PtyProxy& operator=(const PtyProxy&) = delete;
  ~PtyProxy() { stop(); }

  /// Opens the real line (transport::open_tty, which sends nothing) and starts. Errors: those of open_tty(), kIo.
  Status open(const std::string& device);
  void stop() { thread_.stop(); }

  /// What the driver has to open; empty before open().
  [[nodiscard]] const std::string& device() const noexcept { return device_; }
  /// The real line is gone.
  [[nodiscard]] bool over() const noexcept { return over_; }

 private:
  void run();
  void serve();
  void discard();
  void hang_up();
  void begin();
  void end_of_driver();

  CaptureWriter& writer_;
  transport::UniqueFd line_;
  transport::Pty pty_;
  std::string device_;
  std::optional<std::uint32_t> connection_;
  std::optional<Pipe> out_;
  std::optional<Pipe> in_;
  std::atomic<bool> over_{false};
  PollThread thread_;
};

}  // namespace embody::capture
