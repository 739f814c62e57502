#pragma once
// Receives a sensor's datagrams in place of a driver, records them and passes them on. One direction.
#include <string>

#include "drivers/capture/capture_writer.hpp"
#include "drivers/capture/poll_thread.hpp"

namespace embody::capture {

/// Own thread. The driver sees datagrams that come from 127.0.0.1, whoever has sent them.
class UdpForwarder {
 public:
  explicit UdpForwarder(CaptureWriter& writer) : writer_(writer) {}
  UdpForwarder(const UdpForwarder&) = delete;
  UdpForwarder& operator=(const UdpForwarder&) = delete;
  ~UdpForwarder() { stop(); }

  /// Receives at `address`:`port` (0: a free one), sends to 127.0.0.1:`driver_port`, and starts. Errors:
  /// kInvalidArgument, kIo (the port is taken).
  Status open(const std::string& address, std::uint16_t port, std::uint16_t driver_port);
  void stop() { thread_.stop(); }
  [[nodiscard]] std::uint16_t port() const noexcept { return port_; }

 private:
  void run();

  CaptureWriter& writer_;
  transport::UniqueFd from_;
  transport::UniqueFd to_;
  std::uint16_t port_{0};
  PollThread thread_;
};

}  // namespace embody::capture
