#include "drivers/mia/can_line.hpp"

#include <algorithm>
#include <utility>

namespace embody::mia {
namespace {

constexpr int kMessagesPerCall = 16;

class CanLine final : public HandLine {
 public:
  explicit CanLine(std::unique_ptr<CanTunnel> tunnel) : tunnel_(std::move(tunnel)) {}

  [[nodiscard]] int fd() const noexcept override { return tunnel_->fd(); }
  [[nodiscard]] std::string_view reason() const noexcept override { return tunnel_->reason(); }

  IoStatus send(const Command& command) noexcept override {
    return tunnel_->send(std::string_view(command.data() + 1, kPayloadSize));
  }

  IoStatus receive(std::string_view& line) noexcept override {
    for (int i = 0; i < kMessagesPerCall; ++i) {
      std::string_view message;
      if (const IoStatus status = tunnel_->receive(message); status != IoStatus::kDone) return status;
      const auto found = line_of_message(message, buffer_);
      if (!found) continue;
      line = *found;
      return IoStatus::kDone;
    }
    return IoStatus::kEmpty;
  }

 private:
  std::unique_ptr<CanTunnel> tunnel_;
  std::array<char, kMaxMessage> buffer_{};
};

}  // namespace

OpenLine can_line(CanTunnelConfig config) {
  return [config = std::move(config)]() -> Result<std::unique_ptr<HandLine>> {
    auto tunnel = open_tunnel(config);
    if (!tunnel) return tunnel.error();
    return std::unique_ptr<HandLine>(std::make_unique<CanLine>(std::move(*tunnel)));
  };
}

std::optional<std::string_view> line_of_message(std::string_view message, std::span<char> buffer) noexcept {
  if (message.empty() || message.size() > kMaxLine || message.size() + 2 > buffer.size()) return std::nullopt;
  if (message.back() == '\n') {
    std::copy(message.begin(), message.end(), buffer.begin());
    return std::string_view(buffer.data(), message.size());
  }
  if (message.size() != kPayloadSize) return std::nullopt;
  buffer[0] = '<';
  std::copy(message.begin(), message.end(), buffer.begin() + 1);
  buffer[kPayloadSize + 1] = '\n';
  return std::string_view(buffer.data(), kAckSize);
}

std::string_view message_of_line(std::string_view line) noexcept {
  const bool is_ack = line.size() == kAckSize && line.front() == '<' && line.back() == '\n';
  return is_ack ? line.substr(1, kPayloadSize) : line;
}

std::optional<Command> command_of_message(std::string_view message) noexcept {
  if (message.size() != kPayloadSize) return std::nullopt;
  return encode_plain(message);
}

}  // namespace embody::mia
