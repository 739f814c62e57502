// The simulated Mia hand at the far end of a virtual machine's serial line: bytes over a Unix socket.
// Usage: vm_serial_hand SOCKET. Ends with a signal.
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <array>
#include <cstdio>
#include <cstring>
#include <string>

#include "drivers/sim/mia/device.hpp"
#include "drivers/transport/clock.hpp"
#include "drivers/transport/tcp.hpp"

namespace {

using namespace embody;  // NOLINT(google-build-using-namespace): a program of one function

transport::UniqueFd listen_at(const char* path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (std::strlen(path) >= sizeof address.sun_path) return {};
  std::memcpy(address.sun_path, path, std::strlen(path));
  transport::UniqueFd fd(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
  const auto* generic = reinterpret_cast<const sockaddr*>(&address);
  if (::bind(fd.get(), generic, sizeof address) != 0 || ::listen(fd.get(), 1) != 0) return {};
  return fd;
}

/// Until the other side has gone.
void serve(int fd, sim::MiaDevice& hand) {
  while (true) {
    pollfd entry{fd, POLLIN, 0};
    ::poll(&entry, 1, 1);
    std::array<char, 512> buffer;
    const auto [status, size] = transport::receive(fd, std::as_writable_bytes(std::span(buffer)));
    if (status == IoStatus::kDisconnected) return;
    if (status == IoStatus::kDone) hand.receive({buffer.data(), size}, transport::now());
    const std::string said = hand.advance(transport::now());
    if (!transport::send_all(fd, std::as_bytes(std::span(said)), transport::now() + std::chrono::seconds(1))) return;
  }
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 2) {
    std::fprintf(stderr, "usage: vm_serial_hand SOCKET\n");
    return 2;
  }
  const transport::UniqueFd listener = listen_at(arguments[1]);
  if (!listener) {
    std::perror(arguments[1]);
    return 1;
  }
  sim::MiaSimulatorConfig config;
  config.log_capacity = 0;
  sim::MiaDevice hand(config, transport::now());
  while (true) {
    const transport::UniqueFd host(::accept4(listener.get(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
    if (host) serve(host.get(), hand);
    hand.forget_host();
  }
}
