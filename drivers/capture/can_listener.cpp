#include "drivers/capture/can_listener.hpp"

#include <poll.h>

#include <algorithm>

namespace embody::capture {
namespace {

constexpr std::uint32_t kExtendedBit = 0x8000'0000u;

}  // namespace

std::vector<std::byte> bytes_of(const transport::CanFrame& frame) {
  std::vector<std::byte> bytes;
  const std::uint32_t id = frame.id.value | (frame.id.extended ? kExtendedBit : 0u);
  for (int shift = 24; shift >= 0; shift -= 8) bytes.push_back(static_cast<std::byte>(id >> shift));
  for (const std::uint8_t byte : frame.bytes()) bytes.push_back(std::byte{byte});
  return bytes;
}

Result<transport::CanFrame> frame_of(std::span<const std::byte> bytes) {
  if (bytes.size() < 4 || bytes.size() > 12) {
    return make_error(Errc::kMalformed, "a CAN frame has 4 bytes of identifier and up to 8 of data, not %zu in all",
                      bytes.size());
  }
  std::uint32_t id = 0;
  for (std::size_t i = 0; i < 4; ++i) id = id << 8 | std::to_integer<std::uint32_t>(bytes[i]);
  transport::CanFrame frame;
  frame.id = {id & ~kExtendedBit, (id & kExtendedBit) != 0};
  if (!frame.id.valid()) return make_error(Errc::kMalformed, "%#x is no CAN identifier", id);
  frame.size = static_cast<std::uint8_t>(bytes.size() - 4);
  for (std::size_t i = 4; i < bytes.size(); ++i) frame.data[i - 4] = std::to_integer<std::uint8_t>(bytes[i]);
  return frame;
}

void CanListener::start(transport::CanBus bus, std::vector<transport::CanId> host_sends) {
  bus_.emplace(std::move(bus));
  thread_.start([this, host_sends = std::move(host_sends)] { run(host_sends); });
}

void CanListener::run(const std::vector<transport::CanId>& host_sends) {
  const std::uint32_t connection = writer_.connection(0);
  while (!over_) {
    pollfd polled[2] = {{thread_.stop_fd(), POLLIN, 0}, {bus_->fd(), POLLIN, 0}};
    if (::poll(polled, 2, -1) < 0) continue;  // a signal
    if (polled[0].revents != 0) return;
    for (int i = 0; i < 256 && !over_; ++i) {
      transport::CanFrame frame;
      const IoStatus status = bus_->receive(frame);
      if (status == IoStatus::kEmpty) break;
      if (status == IoStatus::kDone) {
        const bool from_host = std::find(host_sends.begin(), host_sends.end(), frame.id) != host_sends.end();
        writer_.bytes(connection, from_host ? Event::kOut : Event::kIn, bytes_of(frame));
      } else {
        writer_.closed(connection, End::kDevice, true);
        over_ = true;
      }
    }
  }
}

}  // namespace embody::capture
