#include "drivers/sim/mia/can_ends.hpp"

#include "drivers/mia/can_line.hpp"

namespace embody::sim {
namespace {

constexpr std::size_t kMaxWaiting = 64;
constexpr Duration kFrameTime = std::chrono::microseconds(135);  ///< eight bytes at 1 Mbit/s with stuff bits

}  // namespace

bool TunnelEnd::exchange(TimePoint now) {
  IoStatus status = IoStatus::kDone;
  while (status == IoStatus::kDone) {
    std::string_view message;
    status = tunnel_->receive(message);
    if (status != IoStatus::kDone) break;
    if (const auto command = mia::command_of_message(message)) hand_.receive(*command, now);
  }
  if (status == IoStatus::kDisconnected) return false;
  said_ += hand_.advance(now);
  for (std::size_t end = said_.find('\n'); end != std::string::npos; end = said_.find('\n')) {
    if (waiting_.size() < kMaxWaiting)
      waiting_.emplace_back(mia::message_of_line(std::string_view(said_).substr(0, end + 1)));
    said_.erase(0, end + 1);
  }
  if (waiting_.empty() || now < next_message_) return true;
  const IoStatus sent = tunnel_->send(waiting_.front());
  if (sent == IoStatus::kDisconnected) return false;
  if (sent == IoStatus::kEmpty) return true;
  next_message_ = now + kFrameTime * (waiting_.front().size() / mia::kSegmentBytes + 1);
  waiting_.pop_front();
  return true;
}

bool CompactEnd::exchange(TimePoint now) {
  IoStatus status = IoStatus::kDone;
  while (status == IoStatus::kDone) {
    transport::CanFrame frame;
    status = bus_.receive(frame);
    if (status == IoStatus::kDone) hand_.receive(frame, now);
  }
  if (status == IoStatus::kDisconnected) return false;
  for (const transport::CanFrame& frame : hand_.advance(now)) {
    if (bus_.send(frame) == IoStatus::kDisconnected) return false;
  }
  return true;
}

std::vector<transport::CanId> heard_ids(const mia::compact::Ids& ids) {
  std::vector<transport::CanId> heard{ids.at(mia::compact::kHeartbeatId)};
  for (std::uint32_t i = 0; i <= mia::compact::kAllMotors; ++i) heard.push_back(ids.at(mia::compact::kCommandId + i));
  return heard;
}

}  // namespace embody::sim
