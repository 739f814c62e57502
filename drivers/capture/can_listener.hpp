#pragma once
// Listens on a CAN bus beside a driver and records its frames. Sends nothing.
#include <atomic>
#include <optional>
#include <string_view>
#include <vector>

#include "drivers/capture/capture_writer.hpp"
#include "drivers/capture/poll_thread.hpp"
#include "drivers/transport/can.hpp"

namespace embody::capture {

/// A frame as the bytes of a chunk: identifier, four bytes, big endian, bit 31 set when it has 29 bits; then the data.
[[nodiscard]] std::vector<std::byte> bytes_of(const transport::CanFrame& frame);
/// The frame of such bytes. Errors: kMalformed.
[[nodiscard]] Result<transport::CanFrame> frame_of(std::span<const std::byte> bytes);

/// Own thread. On SocketCAN the kernel hands every frame of the bus, those of other programs on this computer too, to
/// each socket, so that the driver goes on undisturbed. (The double of can_double.hpp has two ends and no listeners.)
class CanListener {
 public:
  explicit CanListener(CaptureWriter& writer) : writer_(writer) {}
  CanListener(const CanListener&) = delete;
  CanListener& operator=(const CanListener&) = delete;
  ~CanListener() { stop(); }

  /// Records the frames that `bus` receives; those with an identifier of `host_sends` as outgoing.
  void start(transport::CanBus bus, std::vector<transport::CanId> host_sends);
  void stop() { thread_.stop(); }

  /// The bus is off, down or gone: reason() says which.
  [[nodiscard]] bool over() const noexcept { return over_; }
  /// @pre over()
  [[nodiscard]] std::string_view reason() const noexcept { return bus_->reason(); }

 private:
  void run(const std::vector<transport::CanId>& host_sends);

  CaptureWriter& writer_;
  std::optional<transport::CanBus> bus_;
  std::atomic<bool> over_{false};
  PollThread thread_;
};

}  // namespace embody::capture
