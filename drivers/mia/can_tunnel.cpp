#include "drivers/mia/can_tunnel.hpp"

#include <array>
#include <utility>

#include "drivers/transport/can.hpp"
#include "drivers/transport/can_isotp.hpp"

namespace embody::mia {
namespace {

class IsoTpTunnel final : public CanTunnel {
 public:
  explicit IsoTpTunnel(transport::IsoTpSocket socket) : socket_(std::move(socket)) {}

  [[nodiscard]] int fd() const noexcept override { return socket_.fd(); }
  [[nodiscard]] std::uint64_t lost() const noexcept override { return socket_.counters().lost; }
  [[nodiscard]] std::string_view reason() const noexcept override { return socket_.reason(); }

  IoStatus send(std::string_view message) noexcept override { return socket_.send(message); }

  IoStatus receive(std::string_view& message) noexcept override {
    const auto [status, size] = socket_.receive(buffer_);
    message = {buffer_.data(), size};
    return status;
  }

 private:
  transport::IsoTpSocket socket_;
  std::array<char, kMaxMessage> buffer_{};
};

class SegmentTunnel final : public CanTunnel {
 public:
  SegmentTunnel(transport::CanBus bus, const CanTunnelConfig& config)
      : bus_(std::move(bus)), tx_(config.tx), assembler_(config.message_timeout) {}

  [[nodiscard]] int fd() const noexcept override { return bus_.fd(); }
  [[nodiscard]] std::uint64_t lost() const noexcept override { return assembler_.dropped(); }
  [[nodiscard]] std::string_view reason() const noexcept override { return bus_.reason(); }

  IoStatus send(std::string_view message) noexcept override {
    const Segments segments = split_message(message, sequence_++);
    for (std::size_t i = 0; i < segments.count; ++i) {
      transport::CanFrame frame{tx_, segments.frames[i].size, segments.frames[i].data, {}};
      if (const IoStatus status = bus_.send(frame); status != IoStatus::kDone) return status;
    }
    return segments.count > 0 ? IoStatus::kDone : IoStatus::kRefused;
  }

  IoStatus receive(std::string_view& message) noexcept override {
    for (int i = 0; i < kFramesPerCall; ++i) {
      transport::CanFrame frame;
      if (const IoStatus status = bus_.receive(frame); status != IoStatus::kDone) return status;
      const auto complete = assembler_.push(frame.bytes(), frame.t_arrival);
      if (!complete) continue;
      message = *complete;
      return IoStatus::kDone;
    }
    return IoStatus::kEmpty;  // the descriptor stays readable
  }

 private:
  static constexpr int kFramesPerCall = 64;

  transport::CanBus bus_;
  transport::CanId tx_;
  unsigned sequence_{0};
  SegmentAssembler assembler_;
};

}  // namespace

Result<std::unique_ptr<CanTunnel>> open_tunnel(const CanTunnelConfig& config) {
  if (config.framing == CanFraming::kIsoTp) {
    auto socket = transport::open_isotp(
        {config.interface, config.tx, config.rx, config.padding, config.padding_byte, config.st_min});
    if (!socket) return socket.error();
    return std::unique_ptr<CanTunnel>(std::make_unique<IsoTpTunnel>(std::move(*socket)));
  }
  if (!config.tx.valid() || config.tx == config.rx || config.message_timeout <= Duration::zero()) {
    return make_error(Errc::kInvalidArgument,
                      "mia: CAN tx 0x%x and rx 0x%x must be two different identifiers, and message_timeout positive",
                      config.tx.value, config.rx.value);
  }
  auto bus = transport::open_can({config.interface, {config.rx}});
  if (!bus) return bus.error();
  return std::unique_ptr<CanTunnel>(std::make_unique<SegmentTunnel>(std::move(*bus), config));
}

std::unique_ptr<CanTunnel> adopt_tunnel(const CanTunnelConfig& config, transport::UniqueFd fd) {
  if (config.framing == CanFraming::kIsoTp) {
    return std::make_unique<IsoTpTunnel>(transport::IsoTpSocket(std::move(fd), config.interface));
  }
  return std::make_unique<SegmentTunnel>(transport::CanBus(std::move(fd), config.interface, {config.rx}), config);
}

CanTunnelConfig mirrored(CanTunnelConfig config) {
  std::swap(config.tx, config.rx);
  return config;
}

}  // namespace embody::mia
