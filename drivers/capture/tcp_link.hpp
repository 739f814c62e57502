#pragma once
// One connection through the TCP proxy. Internal to it.
#include <netinet/in.h>
#include <poll.h>

#include <array>

#include "drivers/capture/capture_writer.hpp"
#include "drivers/capture/pipe.hpp"
#include "drivers/capture/tcp_proxy.hpp"

namespace embody::capture {

class TcpProxy::Link {
 public:
  /// Begins to connect to the device.
  Link(transport::UniqueFd host, const sockaddr_in& device, std::uint16_t port, CaptureWriter& writer);

  /// What to wait for: the host's end, then the device's.
  [[nodiscard]] std::array<pollfd, 2> interest() const;
  void serve(const pollfd& host, const pollfd& device);
  [[nodiscard]] bool over() const noexcept { return !host_ && !device_; }

 private:
  void finish_connecting(short revents);
  void move(Pipe& pipe, End sender);
  void check_errors(const pollfd& entry, End end);
  void reset(End by);
  [[nodiscard]] int fd(End end) const noexcept { return end == End::kHost ? host_.get() : device_.get(); }

  CaptureWriter& writer_;
  transport::UniqueFd host_;
  transport::UniqueFd device_;
  std::uint32_t number_;
  bool connecting_{true};
  std::array<bool, 2> ended_{};  // by End: it will send nothing more, and the other end knows
  Pipe out_{&read_socket, &write_socket};
  Pipe in_{&read_socket, &write_socket};
};

}  // namespace embody::capture
