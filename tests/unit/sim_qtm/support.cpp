#include "tests/unit/sim_qtm/support.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <thread>

#include "drivers/transport/clock.hpp"
#include "drivers/transport/tcp.hpp"
#include "drivers/transport/udp.hpp"

namespace embody::test {

std::uint64_t Reader::number(std::size_t offset, std::size_t size) const {
  std::uint64_t value = 0;
  if (offset + size > bytes_.size()) {
    ADD_FAILURE() << "the packet ends before byte " << offset + size;
    return 0;
  }
  for (std::size_t i = 0; i < size; ++i) {
    const std::size_t from = order_ == ByteOrder::kBig ? offset + i : offset + size - 1 - i;
    value = (value << 8) | std::to_integer<std::uint64_t>(bytes_[from]);
  }
  return value;
}

float Reader::f32(std::size_t at) const {
  return std::bit_cast<float>(u32(at));
}

std::string Received::text() const {
  if (bytes.size() < 9 || bytes.back() != std::byte{0}) {
    ADD_FAILURE() << "no string of " << bytes.size() << " bytes";
    return {};
  }
  return {reinterpret_cast<const char*>(bytes.data()) + 8, bytes.size() - 9};
}

std::array<float, 3> WireFrame::point(std::size_t i, std::size_t stride) const {
  const Reader in(components.at(0).bytes, order);
  const std::size_t at = 16 + stride * i;
  return {in.f32(at), in.f32(at + 4), in.f32(at + 8)};
}

bool WireFrame::missing(std::size_t i, std::size_t stride) const {
  const Reader in(components.at(0).bytes, order);
  const std::size_t at = 16 + stride * i;
  return in.u32(at) == 0xFFFFFFFF && in.u32(at + 4) == 0xFFFFFFFF && in.u32(at + 8) == 0xFFFFFFFF;
}

std::uint32_t WireFrame::count() const {
  return Reader(components.at(0).bytes, order).u32(8);
}

WireFrame take_apart(const Received& packet) {
  const Reader in(packet.bytes, packet.order);
  WireFrame frame;
  frame.order = packet.order;
  EXPECT_EQ(packet.type(), 3U);
  EXPECT_EQ(in.u32(0), packet.bytes.size());
  frame.timestamp_us = in.u64(8);
  frame.number = in.u32(16);
  std::size_t at = 24;
  for (std::uint32_t i = 0; i < in.u32(20); ++i) {
    const std::size_t size = in.u32(at);
    if (size < 8 || at + size > packet.bytes.size()) {
      ADD_FAILURE() << "component " << i << " has an impossible size";
      return frame;
    }
    const auto begin = packet.bytes.begin() + static_cast<std::ptrdiff_t>(at);
    frame.components.push_back({in.u32(at + 4), Bytes(begin, begin + static_cast<std::ptrdiff_t>(size))});
    at += size;
  }
  EXPECT_EQ(at, packet.bytes.size());
  return frame;
}

TimePoint soon() {
  return transport::now() + std::chrono::seconds(10);
}

bool eventually(const std::function<bool()>& condition) {
  const auto deadline = soon();
  while (!condition()) {
    if (transport::now() >= deadline) return false;
    std::this_thread::yield();
  }
  return true;
}

RawClient::RawClient(std::uint16_t port, ByteOrder order) : order_(order) {
  auto fd = transport::tcp_connect("127.0.0.1", port, soon());
  EXPECT_TRUE(fd.ok()) << fd.error().detail.c_str();
  if (fd) fd_ = std::move(*fd);
}

void RawClient::send(std::string_view command) {
  send_bytes(sim::string_packet(sim::Packet::kCommand, command, order_));
}

void RawClient::send_bytes(const Bytes& bytes) {
  const auto status = transport::send_all(fd_.get(), bytes, soon());
  EXPECT_TRUE(status.ok()) << status.error().detail.c_str();
}

Received RawClient::next() {
  while (true) {
    const std::size_t size = buffer_.size() < 8 ? 8 : Reader(buffer_, order_).u32(0);
    if (size < 8) ADD_FAILURE() << "a packet of " << size << " bytes";
    if (size >= 8 && buffer_.size() >= size) {
      Received packet{Bytes(buffer_.begin(), buffer_.begin() + static_cast<std::ptrdiff_t>(size)), order_};
      buffer_.erase(buffer_.begin(), buffer_.begin() + static_cast<std::ptrdiff_t>(size));
      return packet;
    }
    partial_ = partial_ || !buffer_.empty();
    if (!transport::wait_readable(fd_.get(), soon())) return {};
    Bytes chunk(1 << 20);
    const auto received = transport::receive(fd_.get(), chunk);
    if (received.status == IoStatus::kDisconnected) return {};
    buffer_.insert(buffer_.end(), chunk.begin(), chunk.begin() + static_cast<std::ptrdiff_t>(received.size));
  }
}

Received RawClient::ask(std::string_view command, bool event) {
  send(command);
  Received packet = next();
  while (!packet.empty() && packet.type() > 2 && !(event && packet.type() == 6)) packet = next();
  return packet;
}

WireFrame RawClient::next_frame() {
  Received packet = next();
  while (!packet.empty() && packet.type() != 3) packet = next();
  if (packet.empty()) {
    ADD_FAILURE() << "no frame came";
    return {0, 0, {{1, Bytes(1 << 12)}}};
  }
  return take_apart(packet);
}

RawClient& RawClient::ready(std::string_view version) {
  EXPECT_EQ(next().text(), "QTM RT Interface connected");
  EXPECT_EQ(reply("Version " + std::string(version)), "Version set to " + std::string(version));
  return *this;
}

bool RawClient::silent_for(Duration duration) {
  if (!buffer_.empty()) return false;
  return !transport::wait_readable(fd_.get(), transport::now() + duration);
}

UdpReceiver::UdpReceiver() {
  auto fd = transport::udp_bind("127.0.0.1", 0, 1 << 20);
  EXPECT_TRUE(fd.ok()) << fd.error().detail.c_str();
  if (fd) fd_ = std::move(*fd);
  port_ = transport::local_port(fd_.get());
}

Received UdpReceiver::next(Duration patience) {
  const auto deadline = transport::now() + patience;
  while (transport::wait_readable(fd_.get(), deadline)) {
    Bytes buffer(65536);
    const auto datagram = transport::receive_datagram(fd_.get(), buffer);
    if (datagram.status != IoStatus::kDone) continue;
    buffer.resize(datagram.size);
    return {buffer, ByteOrder::kLittle};
  }
  return {};
}

void UdpReceiver::send_to(std::uint16_t port, const Bytes& bytes) {
  const auto fd = transport::udp_connect("127.0.0.1", port);
  ASSERT_TRUE(fd.ok());
  EXPECT_EQ(transport::send_message(fd->get(), bytes), IoStatus::kDone);
}

sim::Motion counting_motion(std::vector<std::string> names, double rate_hz, std::optional<std::size_t> frames) {
  sim::Motion motion;
  motion.rate_hz = rate_hz;
  motion.marker_names = std::move(names);
  motion.frames = frames;
  motion.source = "counting";
  motion.generate = [](std::size_t frame, std::span<Marker> markers) {
    for (std::size_t i = 0; i < markers.size(); ++i) {
      markers[i] = {1e-3 * Eigen::Vector3d(static_cast<double>(i), static_cast<double>(frame) / 8.0, 1.0), true};
    }
  };
  return motion;
}

Lab::Lab(sim::Motion motion, sim::QtmServerConfig config) : server(std::move(config), std::move(motion)) {
  const auto status = server.start();
  EXPECT_TRUE(status.ok()) << status.error().detail.c_str();
}

}  // namespace embody::test
