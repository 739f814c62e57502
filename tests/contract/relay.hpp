#pragma once
// A line between a driver and a simulated device that can be cut, hushed, listened to and spoken into: TCP, a serial
// line, or the double of a CAN bus. Real descriptors on both sides, one thread.
#include <functional>
#include <future>
#include <list>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "core/base/result.hpp"
#include "drivers/transport/unique_fd.hpp"

namespace embody::test {

/// What the driver plugs into.
class Socket {
 public:
  Socket() = default;
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  virtual ~Socket() = default;

  /// It appears, or appears again under its name.
  virtual Status appear() = 0;
  virtual void vanish() = 0;
  /// Readable when somebody may have plugged in; -1: nobody can.
  [[nodiscard]] virtual int fd() const = 0;
  /// The next connection, or an empty descriptor.
  virtual transport::UniqueFd accept() = 0;
};

/// A TCP port on the loopback, a free one where `port` is 0; it stays the same.
std::unique_ptr<Socket> tcp_socket(std::uint16_t& port);
/// A Unix socket at "unix:/path".
std::unique_ptr<Socket> can_socket(std::string interface);
/// A pseudo-terminal behind the symlink `path`.
std::unique_ptr<Socket> serial_socket(std::string path);

/// All functions from one thread; they return when what they ask for is done.
class Relay {
 public:
  using Open = std::function<Result<transport::UniqueFd>()>;
  /// Bytes of the driver and the number of the connection that they came by. Called by the relay's thread.
  using Tap = std::function<void(int connection, std::span<const std::byte> bytes)>;

  /// `open` connects to the device.
  Relay(std::unique_ptr<Socket> socket, Open open, Tap tap = {});
  ~Relay();
  Relay(const Relay&) = delete;
  Relay& operator=(const Relay&) = delete;

  /// Both sides hang up, and nobody can plug in: a pulled cable that says so.
  void cut();
  /// One can plug in again, and what was hushed speaks.
  void restore();
  /// What the device says is lost; what the driver says still arrives.
  void hush();
  /// The driver of every connection hears `bytes`, as one message where the line has messages.
  void inject(std::span<const std::byte> bytes);

 private:
  struct Pair {
    int number{0};
    transport::UniqueFd driver, device;
    bool driver_done{false};
  };

  void run(const std::stop_token& stop);
  void wait();
  void accept();
  bool carry(Pair& pair);
  bool hear_driver(Pair& pair);
  bool hear_device(Pair& pair);
  void now(std::function<void()> work);

  std::unique_ptr<Socket> socket_;
  Open open_;
  Tap tap_;
  bool hushed_{false};
  int connections_{0};
  std::list<Pair> pairs_;
  std::vector<std::byte> buffer_;
  std::mutex mutex_;
  std::list<std::packaged_task<void()>> work_;
  transport::UniqueFd wake_;
  std::jthread thread_;
};

}  // namespace embody::test
