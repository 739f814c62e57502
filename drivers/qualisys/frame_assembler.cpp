#include "drivers/qualisys/frame_assembler.hpp"

namespace embody::qualisys {
namespace {

constexpr std::uint64_t kReorderedUs = 500'000;  // no network keeps a datagram back for longer
constexpr int kRestartAfter = 8;                 // packets that are behind, in order: nothing is reordered so often
constexpr std::uint64_t kAheadUs = 1'000'000;    // a clock that gains so much on ours has been set

}  // namespace

Assembly FrameAssembler::step(const DataPacket& part, TimePoint t_arrival) noexcept {
  const bool same = started_ && part.timestamp_us == newest_us_;
  if (same && !building_) {  // a duplicate, or a component that is not needed
    if (part.has_markers || part.has_bodies) ++useless_;
    return Assembly::kUseless;
  }
  if (!same) {
    if (is_old(part)) {
      ++useless_;
      return Assembly::kUseless;
    }
    if (restarted(part.timestamp_us, t_arrival)) ++restarts_;
    if (building_) ++incomplete_, ++incomplete_run_;
    building_ = false;
    behind_ = 0;
  }
  started_ = true;
  newest_us_ = part.timestamp_us;
  t_newest_ = t_arrival;
  const bool alone = !building_ && part.has_markers && (part.has_bodies || !bodies_);
  if (!alone) merge(part);
  frame_ = alone ? &part : &part_;
  building_ = !(frame_->has_markers && (frame_->has_bodies || !bodies_));
  if (building_) return Assembly::kPart;
  incomplete_run_ = 0;
  return Assembly::kWhole;
}

bool FrameAssembler::is_old(const DataPacket& part) noexcept {
  if (!started_ || in_order_ || part.timestamp_us > newest_us_) return false;
  if (newest_us_ - part.timestamp_us > kReorderedUs) return false;
  behind_ = behind_ > 0 && part.timestamp_us > behind_us_ ? behind_ + 1 : 1;
  behind_us_ = part.timestamp_us;
  return behind_ < kRestartAfter;
}

bool FrameAssembler::restarted(std::uint64_t timestamp_us, TimePoint t_arrival) const noexcept {
  if (!started_) return false;
  if (timestamp_us < newest_us_) return true;
  const auto ours_us = std::chrono::duration_cast<std::chrono::microseconds>(t_arrival - t_newest_).count();
  return timestamp_us - newest_us_ > kAheadUs + static_cast<std::uint64_t>(ours_us > 0 ? ours_us : 0);
}

void FrameAssembler::merge(const DataPacket& part) noexcept {
  if (!building_) {
    part_ = part;
    return;
  }
  if (part.has_markers) part_.markers = part.markers;
  if (part.has_bodies) part_.bodies = part.bodies;
  part_.has_markers = part_.has_markers || part.has_markers;
  part_.has_bodies = part_.has_bodies || part.has_bodies;
}

}  // namespace embody::qualisys
