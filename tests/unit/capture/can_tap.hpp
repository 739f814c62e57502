#pragma once
// What a listener on a real bus would see, for the double, which has two ends and no listeners: stands between a driver
// and a simulated hand, passes frames on and records them.
#include <poll.h>

#include <optional>
#include <string>
#include <vector>

#include "drivers/capture/can_listener.hpp"
#include "drivers/capture/capture_writer.hpp"
#include "drivers/capture/poll_thread.hpp"
#include "drivers/transport/can.hpp"
#include "drivers/transport/can_double.hpp"

namespace embody::test {

/// For one connection of a driver. @pre a tunnel in segments or the compact profile: struct can_frame on both sides
class CanTap {
 public:
  /// Listens at `interface` for the driver; the hand is at `hand`. Frames of other identifiers than `host` and `device`
  /// are dropped.
  CanTap(std::string interface, std::string hand, std::vector<transport::CanId> host,
         std::vector<transport::CanId> device, capture::CaptureWriter& writer)
      : hand_(std::move(hand)), host_ids_(std::move(host)), hand_ids_(std::move(device)), writer_(writer) {
    listener_ = std::move(*transport::double_listen(*transport::double_path(interface)));
    thread_.start([this] { run(); });
  }

 private:
  void run() {
    while (true) {
      const auto fd_of = [](const auto& bus) { return bus ? bus->fd() : -1; };
      pollfd polled[4] = {{thread_.stop_fd(), POLLIN, 0},
                          {listener_.get(), POLLIN, 0},
                          {fd_of(to_driver_), POLLIN, 0},
                          {fd_of(to_hand_), POLLIN, 0}};
      if (::poll(polled, 4, -1) < 0) continue;  // a signal
      if (polled[0].revents != 0) return;
      if (polled[1].revents != 0) accept();
      if (!to_driver_ || !to_hand_) continue;
      pass(*to_driver_, *to_hand_, capture::Event::kOut);
      if (to_driver_ && to_hand_) pass(*to_hand_, *to_driver_, capture::Event::kIn);
    }
  }

  void accept() {
    to_driver_.emplace(transport::double_accept(listener_.get()), "driver", host_ids_);
    auto bus = transport::open_can({hand_, hand_ids_});
    if (bus) to_hand_.emplace(std::move(*bus));
    connection_ = writer_.connection(0);
  }

  void pass(transport::CanBus& from, transport::CanBus& to, capture::Event direction) {
    transport::CanFrame frame;
    IoStatus status = IoStatus::kEmpty;
    while ((status = from.receive(frame)) == IoStatus::kDone) {
      writer_.bytes(connection_, direction, capture::bytes_of(frame));
      static_cast<void>(to.send(frame));
    }
    if (status != IoStatus::kDisconnected) return;
    to_driver_.reset();
    to_hand_.reset();
  }

  const std::string hand_;
  const std::vector<transport::CanId> host_ids_, hand_ids_;
  capture::CaptureWriter& writer_;
  transport::UniqueFd listener_;
  std::optional<transport::CanBus> to_driver_, to_hand_;
  std::uint32_t connection_{0};
  capture::PollThread thread_;
};

}  // namespace embody::test
