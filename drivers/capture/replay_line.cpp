#include "drivers/capture/replay_line.hpp"

#include <sys/socket.h>

#include <algorithm>
#include <array>

#include "drivers/capture/driver_descriptor.hpp"
#include "drivers/capture/pipe.hpp"

namespace embody::capture {
namespace {

constexpr Duration kForeignRead = std::chrono::milliseconds(1);  // a driver in another process
// Until the far end of a pseudo-terminal shows what was sent, usually; and for certain, before what cannot be undone.
constexpr Duration kTerminalLag = std::chrono::microseconds(300);
constexpr Duration kLongestTerminalLag = std::chrono::milliseconds(100);

}  // namespace

ReplayDevice::Line::Line(transport::UniqueFd fd, std::string device, std::vector<Chunk> script, ReplayOptions options)
    : fd_(std::move(fd)), device_(std::move(device)), script_(std::move(script)), options_(options) {
  for (const Chunk& chunk : script_) {
    if (chunk.event == Event::kOut) recorded_out_.insert(recorded_out_.end(), chunk.bytes.begin(), chunk.bytes.end());
  }
}

ReplayDevice::Line::Waits ReplayDevice::Line::serve(TimePoint now) {
  if (fd_ && !is_open()) return at_ == script_.size() && !piece_under_way_ ? Waits::kOver : Waits::kForOpening;
  if (t_begin_ == TimePoint{}) t_begin_ = now;
  take();
  return play(now);
}

void ReplayDevice::Line::take() {
  std::array<std::byte, 4096> buffer;
  while (readable()) {
    const ssize_t size = device_.empty() ? read_socket(fd_.get(), buffer) : read_terminal(fd_.get(), buffer);
    if (size == -EAGAIN || size == -EINTR) return;
    if (size <= 0) {
      host_ended_ = device_.empty();  // a serial line only waits for the next one who opens it
      return;
    }
    for (ssize_t i = 0; i < size; ++i, ++received_) {
      if (received_ < recorded_out_.size() && recorded_out_[received_] != buffer[static_cast<std::size_t>(i)]) {
        ++different_;
      }
    }
  }
}

ReplayDevice::Line::Waits ReplayDevice::Line::play(TimePoint now) {
  while (fd_) {
    const bool is_last = at_ == script_.size() || script_[at_].event == Event::kClose;
    if (piece_under_way_ && !was_read(now, is_last ? kLongestTerminalLag : kTerminalLag)) return Waits::kForReader;
    piece_under_way_ = false;
    if (at_ == script_.size()) return Waits::kOver;
    const Chunk& chunk = script_[at_];
    const TimePoint due = t_begin_ + std::chrono::nanoseconds(chunk.t_ns - script_.front().t_ns);
    if (options_.recorded_time && now < due) return Waits::kForTime;
    if (chunk.event == Event::kOut) {
      if (received_ < expected_out_ + chunk.bytes.size()) return Waits::kForDriver;
      expected_out_ += chunk.bytes.size();
    } else if (chunk.event == Event::kIn) {
      if (!send_piece(chunk.bytes, now)) return Waits::kForReader;
      if (offset_ < chunk.bytes.size()) continue;
      offset_ = 0;
    } else if (chunk.event == Event::kClose && chunk.by == End::kDevice) {
      close(chunk.reset);
    } else if (chunk.event == Event::kClose && device_.empty() && !host_ended_) {
      return Waits::kForDriver;
    }
    ++at_;
  }
  return Waits::kOver;
}

bool ReplayDevice::Line::is_open() const noexcept {
  if (device_.empty()) return true;
  pollfd entry{fd_.get(), 0, 0};
  return ::poll(&entry, 1, 0) >= 0 && (entry.revents & POLLHUP) == 0;
}

/// False: the driver's buffer is full.
bool ReplayDevice::Line::send_piece(const std::vector<std::byte>& bytes, TimePoint now) {
  const std::size_t wanted = offset_ == 0 ? options_.chunking.first : options_.chunking.rest;
  const std::size_t left = bytes.size() - offset_;
  const std::span<const std::byte> piece(bytes.data() + offset_, wanted == 0 ? left : std::min(wanted, left));
  const ssize_t size = device_.empty() ? write_socket(fd_.get(), piece) : write_terminal(fd_.get(), piece);
  if (size == -EAGAIN || size == -EINTR) return false;
  if (size <= 0) {  // the driver is gone: nobody waits for the rest
    offset_ = bytes.size();
    return true;
  }
  offset_ += static_cast<std::size_t>(size);
  sent_ += static_cast<std::size_t>(size);
  piece_under_way_ = true;
  seen_unread_ = false;
  t_sent_ = now;
  return true;
}

bool ReplayDevice::Line::was_read(TimePoint now, Duration terminal_lag) {
  if (!is_far_end(reader_, fd_.get(), device_)) reader_ = find_far_end(fd_.get(), device_);
  const int unread = reader_ < 0 ? -1 : unread_bytes(reader_);
  if (unread < 0) return now - t_sent_ >= kForeignRead;
  seen_unread_ = seen_unread_ || unread > 0;
  const bool has_arrived = seen_unread_ || device_.empty() || now - t_sent_ >= terminal_lag;
  return unread == 0 && has_arrived;
}

void ReplayDevice::Line::close(bool reset) {
  if (!device_.empty()) {
    fd_.reset();  // a hang-up
  } else if (!reset) {
    ::shutdown(fd_.get(), SHUT_WR);
  } else {
    const linger now{1, 0};
    ::setsockopt(fd_.get(), SOL_SOCKET, SO_LINGER, &now, sizeof now);
    fd_.reset();
  }
}

void ReplayDevice::Line::add_to(ReplayReport& report) const {
  ++report.connections;
  report.sent += sent_;
  report.received += received_;
  report.different += different_;
  report.unexpected += received_ - std::min(received_, recorded_out_.size());
}

}  // namespace embody::capture
