#include "drivers/ur_rtde/primary_link.hpp"

#include <algorithm>

#include "drivers/transport/clock.hpp"
#include "drivers/transport/tcp.hpp"

namespace embody::ur {
namespace {

/// Errors and script exceptions are events; the rest of the log (versions, key messages, texts) is not.
std::optional<PrimaryEvent> event_of(const RobotMessage& message) {
  constexpr int kReadOnly = 210;  // reported as a mere warning
  const bool exception = message.is(MessageKind::kRuntimeException);
  const bool error =
      message.is(MessageKind::kErrorCode) && (message.level >= kViolationLevel || message.code == kReadOnly);
  if (!exception && !error) return std::nullopt;
  return PrimaryEvent{static_cast<MessageKind>(message.kind),
                      message.code,
                      message.argument,
                      message.level,
                      message.line,
                      message.text};
}

}  // namespace

PrimaryLink::PrimaryLink(std::string host, std::uint16_t port) : host_(std::move(host)), port_(port) {}

Status PrimaryLink::open(TimePoint deadline) {
  close();
  auto fd = transport::tcp_connect(host_, port_, deadline);
  if (!fd) return fd.error();
  fd_ = std::move(*fd);
  return {};
}

void PrimaryLink::close() noexcept {
  fd_.reset();
  pending_.clear();
}

Status PrimaryLink::send(std::string_view program, TimePoint deadline) {
  return transport::send_all(fd_.get(), std::as_bytes(std::span(program)), deadline);
}

std::optional<PrimaryEvent> PrimaryLink::next_event(TimePoint deadline) {
  std::array<std::byte, 8192> bytes;
  while (is_open()) {
    if (auto event = take_event()) return event;
    if (!is_open() || !transport::wait_readable(fd_.get(), deadline)) return std::nullopt;
    const auto received = transport::receive(fd_.get(), bytes);
    if (received.status == IoStatus::kDisconnected) close();
    if (!is_open()) return std::nullopt;
    pending_.insert(pending_.end(), bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(received.size));
    if (transport::now() >= deadline && received.size == bytes.size()) return std::nullopt;  // a flood must end, too
  }
  return std::nullopt;
}

std::optional<PrimaryEvent> PrimaryLink::take_event() {
  std::optional<PrimaryEvent> event;
  std::size_t used = 0;
  while (!event) {
    const PrimaryMessage message = parse_primary(Bytes(pending_).subspan(used));
    if (message.framing == PrimaryFraming::kBroken) return close(), std::nullopt;
    if (message.framing == PrimaryFraming::kIncomplete) break;
    used += message.size;
    if (message.type == kRobotState) {
      if (const auto kinematics = decode_kinematics(message.contents)) kinematics_ = kinematics;
    } else if (message.type == kRobotMessage) {
      if (const auto said = decode_robot_message(message.contents)) event = event_of(*said);
    }
  }
  pending_.erase(pending_.begin(), pending_.begin() + static_cast<std::ptrdiff_t>(used));
  return event;
}

}  // namespace embody::ur
