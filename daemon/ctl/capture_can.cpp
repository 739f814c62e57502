#include "daemon/ctl/capture_can.hpp"

#include <cstdio>

#include "daemon/app/devices.hpp"
#include "drivers/capture/can_listener.hpp"
#include "drivers/mia/compact/codec.hpp"

namespace embody::ctl {
namespace {

using transport::CanId;

class CanLink final : public CaptureLink {
 public:
  CanLink(transport::CanBus bus, std::vector<CanId> host_sends, std::string peer, capture::CaptureWriter& writer)
      : peer_(std::move(peer)), listener_(writer) {
    listener_.start(std::move(bus), std::move(host_sends));
  }
  [[nodiscard]] bool listens_only() const override { return true; }
  [[nodiscard]] std::string advice() const override {
    return "Listens on " + peer_ + " and sends nothing; start embodyd, or whatever drives the hand.\n";
  }
  [[nodiscard]] Status status() const override {
    if (!listener_.over()) return {};
    return make_error(Errc::kDisconnected, "%.*s", static_cast<int>(listener_.reason().size()),
                      listener_.reason().data());
  }

 private:
  const std::string peer_;
  capture::CanListener listener_;
};

std::string hex(std::uint32_t value) {
  char text[16];
  std::snprintf(text, sizeof text, "0x%x", value);
  return text;
}

/// The compact profile's: a command to each motor and to all of them, and the heartbeat.
bool host_sends(std::uint32_t offset) {
  return offset == mia::compact::kHeartbeatId || offset <= mia::compact::kCommandId + mia::compact::kAllMotors;
}

}  // namespace

bool is_on_can(const config::HandConfig& hand) {
  return hand.driver == config::HandDriverKind::kMia && hand.mia.wire != config::MiaWire::kSerial;
}

CanHandIds can_hand_ids(const config::MiaHandConfig& mia) {
  if (mia.wire != config::MiaWire::kCanCompact) {
    const auto tunnel = can_tunnel_config(mia);
    return {{tunnel.tx}, {tunnel.rx}};
  }
  CanHandIds ids;
  const mia::compact::Ids hand{{static_cast<std::uint32_t>(mia.can_base_id), mia.can_extended_ids}};
  for (std::uint32_t offset = 0; offset <= mia::compact::kLastId; ++offset) {
    (host_sends(offset) ? ids.host : ids.hand).push_back(hand.at(offset));
  }
  return ids;
}

std::string can_peer(const config::MiaHandConfig& mia) {
  const std::string name = mia.can_interface + " (" + config::kMiaWireNames[static_cast<std::size_t>(mia.wire)] + ", ";
  if (mia.wire == config::MiaWire::kCanCompact) {
    const auto base = static_cast<std::uint32_t>(mia.can_base_id);
    return name + hex(base) + " to " + hex(base + mia::compact::kLastId) + ")";
  }
  return name + hex(static_cast<std::uint32_t>(mia.can_tx_id)) + " to the hand, " +
         hex(static_cast<std::uint32_t>(mia.can_rx_id)) + " from it)";
}

Result<std::unique_ptr<CaptureLink>> listen_on_can(const config::MiaHandConfig& mia, capture::CaptureWriter& writer) {
  CanHandIds ids = can_hand_ids(mia);
  transport::CanConfig can;
  can.interface = mia.can_interface;
  can.receive = ids.host;
  can.receive.insert(can.receive.end(), ids.hand.begin(), ids.hand.end());
  auto bus = transport::open_can(can);
  if (!bus) return bus.error();
  return std::unique_ptr<CaptureLink>(
      std::make_unique<CanLink>(std::move(*bus), std::move(ids.host), can_peer(mia), writer));
}

}  // namespace embody::ctl
