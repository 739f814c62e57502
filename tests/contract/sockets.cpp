// What a driver can plug into, real but without the device behind it.
#include <sys/socket.h>
#include <unistd.h>

#include <utility>

#include "drivers/sim/serial/device_link.hpp"
#include "drivers/transport/can_double.hpp"
#include "drivers/transport/pty.hpp"
#include "drivers/transport/tcp.hpp"
#include "tests/contract/relay.hpp"

namespace embody::test {
namespace {

using transport::UniqueFd;

/// The port stays bound while nobody listens, so that no other program takes it: connections are refused meanwhile.
class TcpSocket final : public Socket {
 public:
  explicit TcpSocket(std::uint16_t& port) {
    for (int i = 0; i < 2; ++i) {  // the kernel keeps a port only for who has asked for it by number
      listener_.reset();
      auto listener = transport::tcp_listen("127.0.0.1", port);
      if (listener) listener_ = std::move(*listener);
      port = transport::local_port(listener_.get());
    }
  }
  Status appear() override {
    if (listening_ || ::listen(listener_.get(), 16) == 0) return listening_ = true, Status{};
    return make_error(Errc::kIo, "cannot listen again");
  }
  void vanish() override {
    ::shutdown(listener_.get(), SHUT_RD);
    listening_ = false;
  }
  [[nodiscard]] int fd() const override { return listening_ ? listener_.get() : -1; }
  UniqueFd accept() override { return listening_ ? transport::tcp_accept(listener_.get()) : UniqueFd(); }

 private:
  UniqueFd listener_;
  bool listening_{true};
};

class CanSocket final : public Socket {
 public:
  explicit CanSocket(const std::string& interface) : path_(*transport::double_path(interface)) {}
  ~CanSocket() override { vanish(); }
  Status appear() override {
    if (listener_) return {};
    auto listener = transport::double_listen(path_);
    if (!listener) return listener.error();
    listener_ = std::move(*listener);
    return {};
  }
  void vanish() override {
    if (listener_) ::unlink(path_.c_str());
    listener_.reset();
  }
  [[nodiscard]] int fd() const override { return listener_.get(); }
  UniqueFd accept() override { return listener_ ? transport::double_accept(listener_.get()) : UniqueFd(); }

 private:
  std::string path_;
  UniqueFd listener_;
};

/// A serial line has no connections: it is plugged in as long as it is there.
class SerialSocket final : public Socket {
 public:
  explicit SerialSocket(std::string path) : path_(std::move(path)) {}
  Status appear() override {
    if (there_) return {};
    auto pty = transport::open_pty();
    if (!pty) return pty.error();
    fresh_ = std::move(pty->master);
    there_ = true;
    return link_.create(path_, pty->device);
  }
  void vanish() override {
    link_.remove();
    fresh_.reset();
    there_ = false;
  }
  [[nodiscard]] int fd() const override { return -1; }
  UniqueFd accept() override { return std::exchange(fresh_, UniqueFd()); }

 private:
  std::string path_;
  sim::DeviceLink link_;
  UniqueFd fresh_;
  bool there_{false};
};

}  // namespace

std::unique_ptr<Socket> tcp_socket(std::uint16_t& port) {
  return std::make_unique<TcpSocket>(port);
}

std::unique_ptr<Socket> can_socket(std::string interface) {
  return std::make_unique<CanSocket>(interface);
}

std::unique_ptr<Socket> serial_socket(std::string path) {
  return std::make_unique<SerialSocket>(std::move(path));
}

}  // namespace embody::test
