#include "drivers/transport/can_isotp.hpp"

#include <linux/can.h>
#include <linux/can/isotp.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>

#include "drivers/transport/can.hpp"
#include "drivers/transport/can_double.hpp"

namespace embody::transport {
namespace {

Status set_options(int fd, const IsoTpConfig& config) {
  can_isotp_options options{};
  options.flags = config.padding ? CAN_ISOTP_TX_PADDING | CAN_ISOTP_RX_PADDING : 0;
  options.frame_txtime = CAN_ISOTP_DEFAULT_FRAME_TXTIME;
  options.txpad_content = options.rxpad_content = config.padding_byte;
  can_isotp_fc_options flow{};
  flow.stmin = encode_st_min(config.st_min);
  if (::setsockopt(fd, SOL_CAN_ISOTP, CAN_ISOTP_OPTS, &options, sizeof options) == 0 &&
      ::setsockopt(fd, SOL_CAN_ISOTP, CAN_ISOTP_RECV_FC, &flow, sizeof flow) == 0) {
    return {};
  }
  return make_error(Errc::kIo, "cannot set up ISO-TP on %s: %s", config.interface.c_str(), std::strerror(errno));
}

canid_t raw_id(CanId id) noexcept {
  return id.value | (id.extended ? CAN_EFF_FLAG : 0u);
}

Result<UniqueFd> open_kernel(const IsoTpConfig& config) {
  UniqueFd fd(::socket(PF_CAN, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_ISOTP));
  if (!fd) {
    if (errno != EAFNOSUPPORT && errno != EPROTONOSUPPORT) {
      return make_error(Errc::kIo, "cannot create an ISO-TP socket: %s", std::strerror(errno));
    }
    return make_error(Errc::kUnsupported,
                      "this kernel has no ISO-TP on CAN: modprobe can-isotp, or choose the framing of three frames");
  }
  const auto index = find_can_interface(config.interface);
  if (!index) return index.error();
  if (const Status set = set_options(fd.get(), config); !set) return set.error();
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = *index;
  address.can_addr.tp = {raw_id(config.rx), raw_id(config.tx)};
  if (::bind(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    return make_error(Errc::kIo, "cannot use ISO-TP on %s: %s", config.interface.c_str(), std::strerror(errno));
  }
  return fd;
}

}  // namespace

std::uint8_t encode_st_min(Duration st_min) noexcept {
  const auto us = std::chrono::ceil<std::chrono::microseconds>(std::max(st_min, Duration::zero())).count();
  if (us > 0 && us <= 900) return static_cast<std::uint8_t>(0xF0 + (us + 99) / 100);
  return static_cast<std::uint8_t>(std::min<std::int64_t>((us + 999) / 1000, 127));
}

Result<IsoTpSocket> open_isotp(const IsoTpConfig& config) {
  if (!config.tx.valid() || !config.rx.valid() || config.tx == config.rx) {
    return make_error(Errc::kInvalidArgument,
                      "ISO-TP: tx 0x%x and rx 0x%x must be two different identifiers of 11 or 29 bits", config.tx.value,
                      config.rx.value);
  }
  const auto path = double_path(config.interface);
  auto fd = path ? double_connect(*path) : open_kernel(config);
  if (!fd) return fd.error();
  return IsoTpSocket(std::move(*fd), config.interface);
}

IoStatus IsoTpSocket::send(std::span<const char> message) noexcept {
  if (!reason_.empty()) return IoStatus::kDisconnected;
  const ssize_t size = ::send(fd_.get(), message.data(), message.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
  if (size == static_cast<ssize_t>(message.size())) {
    ++counters_.sent;
    return IoStatus::kDone;
  }
  if (size < 0 && gone(errno)) return IoStatus::kDisconnected;
  ++counters_.busy;
  return IoStatus::kEmpty;
}

Received IsoTpSocket::receive(std::span<char> buffer) noexcept {
  for (int i = 0; i < 16; ++i) {
    if (!reason_.empty()) return {IoStatus::kDisconnected, 0};
    const ssize_t size = ::recv(fd_.get(), buffer.data(), buffer.size(), MSG_DONTWAIT | MSG_TRUNC);
    if (size > 0 && static_cast<std::size_t>(size) <= buffer.size()) {
      ++counters_.received;
      return {IoStatus::kDone, static_cast<std::size_t>(size)};
    }
    if (size < 0 && (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR)) return {IoStatus::kEmpty, 0};
    if (size == 0 ? gone(EPIPE) : size < 0 && gone(errno)) return {IoStatus::kDisconnected, 0};
    ++counters_.lost;  // too long, or the kernel reports a message that did not make it
  }
  return {IoStatus::kEmpty, 0};
}

/// True when the session is over. Everything else (ECOMM, ETIMEDOUT, EILSEQ, EBADMSG...) is the loss of one message.
bool IsoTpSocket::gone(int code) noexcept {
  const char* format = nullptr;
  if (code == ENETDOWN) format = "CAN interface %s went down: set it up again (ip link set <interface> up)";
  if (code == ENODEV || code == ENXIO || code == EADDRNOTAVAIL) {
    format = "CAN interface %s is gone; is the adapter unplugged?";
  }
  if (code == EPIPE || code == ECONNRESET || code == ENOTCONN) {
    format = "the other end of the simulated CAN bus %s has gone";
  }
  if (format == nullptr) return false;
  std::array<char, 241> text;
  std::snprintf(text.data(), text.size(), format, name_.c_str());
  reason_ = text.data();
  return true;
}

}  // namespace embody::transport
