#pragma once
// A client that sends any bytes and waits for packages, for tests of the simulated controller.
#include <gtest/gtest.h>

#include <optional>

#include "drivers/transport/clock.hpp"
#include "drivers/transport/tcp.hpp"
#include "drivers/ur_rtde/frame_buffer.hpp"
#include "tests/unit/ur_rtde/hex.hpp"

namespace embody::test {

class RawClient {
 public:
  explicit RawClient(std::uint16_t port) {
    auto fd = transport::tcp_connect("127.0.0.1", port, transport::now() + kPatience);
    EXPECT_TRUE(fd.ok());
    if (fd) fd_ = std::move(*fd);
  }

  void send(const std::vector<std::byte>& bytes) {
    EXPECT_TRUE(transport::send_all(fd_.get(), bytes, transport::now() + kPatience).ok());
  }
  /// The next package as bytes; nullopt when the controller closed the connection or stays silent.
  std::optional<std::vector<std::byte>> receive() {
    const TimePoint deadline = transport::now() + kPatience;
    while (true) {
      const rtde::ParsedFrame parsed = buffer_.next();
      if (parsed.framing == rtde::Framing::kComplete) return whole(parsed.frame);
      if (!transport::wait_readable(fd_.get(), deadline)) return std::nullopt;
      const auto received = transport::receive(fd_.get(), buffer_.space());
      if (received.status == IoStatus::kDisconnected) return std::nullopt;
      buffer_.commit(received.size);
    }
  }
  /// The next package of a type, skipping others.
  std::optional<std::vector<std::byte>> receive(char type) {
    while (true) {
      const auto package = receive();
      if (!package || static_cast<char>((*package)[2]) == type) return package;
    }
  }
  std::optional<std::vector<std::byte>> ask(const std::vector<std::byte>& bytes) {
    send(bytes);
    return receive(static_cast<char>(bytes[2]));
  }
  [[nodiscard]] int fd() const { return fd_.get(); }
  void close() { fd_.reset(); }

 private:
  static constexpr Duration kPatience = std::chrono::seconds(5);
  static std::vector<std::byte> whole(const rtde::Frame& frame) {
    std::vector<std::byte> bytes(rtde::kHeaderSize + frame.payload.size());
    rtde::store(bytes, 0, static_cast<std::uint16_t>(bytes.size()));
    bytes[2] = static_cast<std::byte>(frame.type);
    std::copy(frame.payload.begin(), frame.payload.end(), bytes.begin() + rtde::kHeaderSize);
    return bytes;
  }
  transport::UniqueFd fd_;
  rtde::FrameBuffer buffer_;
};

}  // namespace embody::test
