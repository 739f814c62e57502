#pragma once
// The device side of a capture, played to a driver over a real TCP port or pseudo-terminal. A fixture for tests.
#include <poll.h>

#include <ctime>
#include <list>
#include <mutex>
#include <string>
#include <vector>

#include "core/base/result.hpp"
#include "core/base/time.hpp"
#include "drivers/capture/capture.hpp"
#include "drivers/capture/poll_thread.hpp"
#include "drivers/transport/pty.hpp"

namespace embody::capture {

/// How the device's recorded chunks are cut for sending. Each piece is one send(), and the next one waits until the
/// driver has read it.
struct Chunking {
  std::size_t first{0};  ///< bytes of the first piece of a chunk; 0: all
  std::size_t rest{0};   ///< bytes of the further pieces; 0: all

  static constexpr Chunking whole() { return {0, 0}; }
  static constexpr Chunking pieces(std::size_t bytes) { return {bytes, bytes}; }
  /// Every chunk longer than `offset` in two: for offset 1 to the longest chunk these are all two-part splits.
  static constexpr Chunking two_parts(std::size_t offset) { return {offset, 0}; }
};

struct ReplayOptions {
  Chunking chunking;
  bool recorded_time{false};  ///< not before the recorded time since the connection opened; else as fast as possible
};

struct ReplayReport {
  std::size_t connections{0};  ///< taken
  std::size_t refused{0};      ///< more than were recorded
  std::size_t sent{0};         ///< bytes to the driver
  std::size_t received{0};     ///< bytes from the driver
  std::size_t different{0};    ///< of these, up to the recorded number: other than the recorded ones
  std::size_t unexpected{0};   ///< of these, beyond the recorded number
};

/// Own thread. The driver's n-th connection to a port plays the n-th recorded one of that port; the connections of a
/// serial line play one after the other. Within a connection the order is as recorded: before the device says something
/// it waits for as many bytes of the driver as had come by then. What these bytes are is counted, not judged, since
/// sequence numbers, ports and the like differ from run to run; order between connections is not kept. After its last
/// chunk a connection stays open, unless the recorded device has closed it.
///
/// That the driver has read a piece is seen in the driver's descriptor, if it is in this process; a driver in another
/// process gets a millisecond per piece instead. On a pseudo-terminal, the kernel may still join two pieces.
class ReplayDevice {
 public:
  explicit ReplayDevice(Capture capture, ReplayOptions options = {});
  ReplayDevice(const ReplayDevice&) = delete;
  ReplayDevice& operator=(const ReplayDevice&) = delete;
  ~ReplayDevice();

  /// Errors: kUnsupported (UDP; CAN: see can_replay.hpp), kInvalidArgument (nothing recorded), kIo.
  Status start();

  /// Where the driver has to connect for the device's `port`; 0: the first that was recorded.
  [[nodiscard]] std::uint16_t port(std::uint16_t device_port = 0) const noexcept;
  /// What the driver of a serial device has to open.
  [[nodiscard]] const std::string& device() const noexcept { return pty_.device; }

  /// All of every recorded connection was played, and read.
  [[nodiscard]] bool finished();
  /// Nothing happens until the driver does something: sends, reads, or connects.
  [[nodiscard]] bool waits_for_driver();
  [[nodiscard]] ReplayReport report();

 private:
  class Line;
  struct Port {
    std::uint16_t device_port{0};
    transport::UniqueFd listener;
    std::list<std::vector<Chunk>> scripts;  // still to be played
  };

  Status listen();
  void run();
  timespec serve(std::vector<pollfd>& polled);
  void accept(Port& port);

  Capture capture_;
  ReplayOptions options_;
  transport::Pty pty_;
  std::list<Port> ports_;
  std::mutex mutex_;  // of what follows, and the scripts
  std::list<Line> lines_;
  std::size_t refused_{0};
  PollThread thread_;
};

}  // namespace embody::capture
