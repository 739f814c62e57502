#pragma once
// The hand's end of one connection on CAN: moves frames between a bus and a simulated hand. No thread.
#include <deque>
#include <memory>
#include <optional>
#include <string>

#include "drivers/mia/can_tunnel.hpp"
#include "drivers/sim/mia/can_compact_hand.hpp"
#include "drivers/sim/mia/device.hpp"
#include "drivers/transport/can.hpp"

namespace embody::sim {

class CanEnd {
 public:
  CanEnd() = default;
  CanEnd(const CanEnd&) = delete;
  CanEnd& operator=(const CanEnd&) = delete;
  virtual ~CanEnd() = default;

  [[nodiscard]] virtual int fd() const noexcept = 0;
  /// Takes what came and says what is due at `now`; false: the connection is over.
  virtual bool exchange(TimePoint now) = 0;
};

/// Profile "ascii-tunnel". One message after the other, at the pace of a bus of 1 Mbit/s: a controller has room for a
/// few frames only, and an emulated bus has no bit times of its own.
class TunnelEnd final : public CanEnd {
 public:
  TunnelEnd(std::unique_ptr<mia::CanTunnel> tunnel, MiaDevice& hand) : tunnel_(std::move(tunnel)), hand_(hand) {}
  [[nodiscard]] int fd() const noexcept override { return tunnel_->fd(); }
  bool exchange(TimePoint now) override;
  [[nodiscard]] bool backlog() const noexcept { return !waiting_.empty(); }

 private:
  std::unique_ptr<mia::CanTunnel> tunnel_;
  MiaDevice& hand_;
  std::string said_;  ///< the beginning of a line
  std::deque<std::string> waiting_;
  TimePoint next_message_{};
};

/// Profile "compact". What the bus has no room for is lost.
class CompactEnd final : public CanEnd {
 public:
  CompactEnd(transport::CanBus bus, CompactHand& hand) : bus_(std::move(bus)), hand_(hand) {}
  [[nodiscard]] int fd() const noexcept override { return bus_.fd(); }
  bool exchange(TimePoint now) override;

 private:
  transport::CanBus bus_;
  CompactHand& hand_;
};

/// The identifiers that a hand with the profile "compact" listens to.
[[nodiscard]] std::vector<transport::CanId> heard_ids(const mia::compact::Ids& ids);

}  // namespace embody::sim
