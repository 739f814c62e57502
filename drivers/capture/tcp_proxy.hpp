#pragma once
// Stands between a driver and its device on TCP and records what passes. The driver connects to us instead.
#include <netinet/in.h>

#include <list>
#include <memory>
#include <string>
#include <vector>

#include "drivers/capture/capture_writer.hpp"
#include "drivers/capture/poll_thread.hpp"

namespace embody::capture {

/// Own thread. Every connection of a driver becomes one of ours to the device; bytes, half-closes and resets are passed
/// on in both directions, at once and unchanged. A device that refuses the connection shows as a reset: the driver has
/// connected by then. At most 64 connections at a time; more are closed.
class TcpProxy {
 public:
  explicit TcpProxy(CaptureWriter& writer);
  TcpProxy(const TcpProxy&) = delete;
  TcpProxy& operator=(const TcpProxy&) = delete;
  ~TcpProxy();  ///< stop()

  /// Before start(): listens at `listen_address` (IPv4 of this computer) for connections to `host`:`port` of the
  /// device; `listen_port` 0 takes a free one. May wait for the resolver. Errors: kNotFound (host), kInvalidArgument,
  /// kIo.
  Status forward(const std::string& host, std::uint16_t port, const std::string& listen_address = "127.0.0.1",
                 std::uint16_t listen_port = 0);
  void start();
  /// Closes all connections.
  void stop() { thread_.stop(); }

  /// Where the driver has to connect to reach the device's `port`; 0 without forward().
  [[nodiscard]] std::uint16_t port_for(std::uint16_t device_port) const noexcept;

 private:
  struct Forward {
    transport::UniqueFd listener;
    sockaddr_in device{};
    std::uint16_t port{0};
  };
  class Link;

  void run();
  void accept(const Forward& forward);

  CaptureWriter& writer_;
  std::vector<Forward> forwards_;
  std::list<Link> links_;
  PollThread thread_;
};

}  // namespace embody::capture
