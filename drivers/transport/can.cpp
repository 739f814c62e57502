#include "drivers/transport/can.hpp"

#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <sys/socket.h>
#include <time.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>

#include "drivers/transport/clock.hpp"

namespace embody::transport {
namespace {

constexpr int kFramesPerCall = 64;  ///< unwanted ones that one receive() steps over
constexpr Duration kOldestStamp = std::chrono::seconds(1);

/// One message of the socket with its time of arrival. Size as recvmsg(): negative is -errno.
struct Incoming {
  can_frame frame{};
  ssize_t size{0};
  TimePoint t_arrival{};
};

/// The kernel stamps in wall time: what counts is how long ago that was, and never more than a second (the wall clock
/// may have been set meanwhile).
TimePoint arrival(const msghdr& message) noexcept {
  const TimePoint t = now();
  for (const cmsghdr* part = CMSG_FIRSTHDR(&message); part != nullptr;
       part = CMSG_NXTHDR(const_cast<msghdr*>(&message), const_cast<cmsghdr*>(part))) {
    if (part->cmsg_level != SOL_SOCKET || part->cmsg_type != SCM_TIMESTAMPNS) continue;
    timespec stamp{}, wall{};
    std::memcpy(&stamp, CMSG_DATA(part), sizeof stamp);
    ::clock_gettime(CLOCK_REALTIME, &wall);
    const Duration age =
        std::chrono::seconds(wall.tv_sec - stamp.tv_sec) + std::chrono::nanoseconds(wall.tv_nsec - stamp.tv_nsec);
    return t - std::clamp(age, Duration::zero(), kOldestStamp);
  }
  return t;
}

Incoming take(int fd) noexcept {
  Incoming in;
  iovec buffer{&in.frame, sizeof in.frame};
  alignas(cmsghdr) std::array<char, 128> control;
  msghdr message{};
  message.msg_iov = &buffer;
  message.msg_iovlen = 1;
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  in.size = ::recvmsg(fd, &message, MSG_DONTWAIT | MSG_TRUNC);
  if (in.size < 0) in.size = -errno;
  if (in.size > 0) in.t_arrival = arrival(message);
  return in;
}

bool is_transient(int code) noexcept {
  return code == EAGAIN || code == EWOULDBLOCK || code == EINTR || code == ENOBUFS;
}

}  // namespace

CanBus::CanBus(UniqueFd fd, std::string_view name, const std::vector<CanId>& receive) noexcept
    : fd_(std::move(fd)), name_(name), filter_count_(std::min(receive.size(), kMaxCanFilters)) {
  std::copy_n(receive.begin(), filter_count_, filters_.begin());
}

IoStatus CanBus::send(const CanFrame& frame) noexcept {
  if (!reason_.empty()) return IoStatus::kDisconnected;
  can_frame raw{};
  raw.can_id = frame.id.value | (frame.id.extended ? CAN_EFF_FLAG : 0u);
  raw.can_dlc = std::min<std::uint8_t>(frame.size, CAN_MAX_DLEN);
  std::copy_n(frame.data.begin(), raw.can_dlc, raw.data);
  if (::send(fd_.get(), &raw, sizeof raw, MSG_DONTWAIT | MSG_NOSIGNAL) == sizeof raw) {
    ++counters_.sent;
    return IoStatus::kDone;
  }
  if (!is_transient(errno)) return fail(errno);
  ++counters_.queue_full;
  return IoStatus::kEmpty;
}

IoStatus CanBus::receive(CanFrame& frame) noexcept {
  for (int i = 0; i < kFramesPerCall; ++i) {
    if (!reason_.empty()) return IoStatus::kDisconnected;
    const Incoming in = take(fd_.get());
    if (in.size == 0) return fail(EPIPE);
    if (in.size < 0 && is_transient(static_cast<int>(-in.size))) return IoStatus::kEmpty;
    if (in.size < 0) return fail(static_cast<int>(-in.size));
    const can_frame& raw = in.frame;
    if (in.size != sizeof raw || raw.can_dlc > CAN_MAX_DLEN) {
      ++counters_.ignored;
      continue;
    }
    if ((raw.can_id & CAN_ERR_FLAG) != 0) {
      CanErrorFrame error{raw.can_id & CAN_ERR_MASK, {}};
      std::copy_n(raw.data, error.data.size(), error.data.begin());
      count(decode_can_errors(error));
      continue;
    }
    const bool extended = (raw.can_id & CAN_EFF_FLAG) != 0;
    frame.id = {raw.can_id & (extended ? CAN_EFF_MASK : CAN_SFF_MASK), extended};
    if ((raw.can_id & CAN_RTR_FLAG) != 0 || !wanted(frame.id)) {
      ++counters_.ignored;
      continue;
    }
    frame.size = raw.can_dlc;
    std::copy_n(raw.data, frame.data.size(), frame.data.begin());
    frame.t_arrival = in.t_arrival;
    ++counters_.received;
    return IoStatus::kDone;
  }
  return IoStatus::kEmpty;  // the descriptor stays readable: the next call goes on
}

bool CanBus::wanted(CanId id) const noexcept {
  const auto end = filters_.begin() + static_cast<std::ptrdiff_t>(filter_count_);
  return std::find(filters_.begin(), end, id) != end;
}

void CanBus::count(const CanErrors& errors) noexcept {
  ++counters_.error_frames;
  counters_.error_warnings += errors.error_warning;
  counters_.error_passives += errors.error_passive;
  counters_.no_acks += errors.no_ack;
  counters_.arbitrations_lost += errors.arbitration_lost;
  counters_.protocol_errors += errors.protocol;
  counters_.overflows += errors.overflow;
  counters_.restarts += errors.restarted;
  counters_.bus_offs += errors.bus_off;
  if (errors.bus_off) {
    end("CAN bus %s: the controller is bus-off: check wiring, termination (120 ohm at both ends) and bit rate");
  }
}

IoStatus CanBus::fail(int code) noexcept {
  switch (code) {
    case ENETDOWN:
      return end("CAN interface %s went down: set it up again (ip link set <interface> up)");
    case ENODEV:
    case ENXIO:
      return end("CAN interface %s is gone; is the adapter unplugged?");
    case EPIPE:
    case ECONNRESET:
    case ENOTCONN:
      return end("the other end of the simulated CAN bus %s has gone");
    default:
      return end("CAN bus %s: the kernel reports an error on its socket");
  }
}

IoStatus CanBus::end(const char* format) noexcept {
  std::array<char, 241> text;
  std::snprintf(text.data(), text.size(), format, name_.c_str());
  reason_ = text.data();
  return IoStatus::kDisconnected;
}

IoStatus send_can_errors(int fd, const CanErrors& errors) noexcept {
  const CanErrorFrame error = encode_can_errors(errors);
  can_frame raw{};
  raw.can_id = error.classes | CAN_ERR_FLAG;
  raw.can_dlc = CAN_ERR_DLC;
  std::copy(error.data.begin(), error.data.end(), raw.data);
  if (::send(fd, &raw, sizeof raw, MSG_DONTWAIT | MSG_NOSIGNAL) == sizeof raw) return IoStatus::kDone;
  return is_transient(errno) ? IoStatus::kEmpty : IoStatus::kDisconnected;
}

}  // namespace embody::transport
