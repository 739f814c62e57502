#include "drivers/sim/ur/link_faults.hpp"

#include <algorithm>

#include "drivers/transport/tcp.hpp"

namespace embody::sim {
namespace {

constexpr std::size_t kMostWaiting = 1000;
constexpr Duration kCoalesceAtMost = std::chrono::milliseconds(20);

}  // namespace

bool Outbox::send(int fd, rtde::Bytes message, const LinkFaults& faults, TimePoint now) {
  if (waiting_.empty() && faults.jitter == Duration(0) && faults.coalesce <= 1) {
    return send_now(fd, message, faults.single_bytes);
  }
  if (waiting_.size() >= kMostWaiting) return false;
  std::uniform_int_distribution<std::int64_t> delay_ns(0, faults.jitter.count());
  const TimePoint due = now + Duration(delay_ns(random_));
  waiting_.push_back({waiting_.empty() ? due : std::max(due, waiting_.back().due), {message.begin(), message.end()}});
  return true;
}

bool Outbox::pump(int fd, const LinkFaults& faults, TimePoint now) {
  if (waiting_.empty()) return true;
  const bool enough = waiting_.size() >= faults.coalesce || now - waiting_.front().due > kCoalesceAtMost;
  std::vector<std::byte> bytes;
  while (enough && !waiting_.empty() && waiting_.front().due <= now) {
    bytes.insert(bytes.end(), waiting_.front().bytes.begin(), waiting_.front().bytes.end());
    waiting_.pop_front();
  }
  return bytes.empty() || send_now(fd, bytes, faults.single_bytes);
}

bool Outbox::send_now(int fd, rtde::Bytes bytes, bool single_bytes) const noexcept {
  if (!single_bytes) return transport::send_message(fd, bytes) == IoStatus::kDone;
  for (; !bytes.empty(); bytes = bytes.subspan(1)) {
    if (transport::send_message(fd, bytes.first(1)) != IoStatus::kDone) return false;
  }
  return true;
}

}  // namespace embody::sim
