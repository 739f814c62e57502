#include "tests/unit/hand/marker_faults.hpp"

#include <algorithm>

#include "core/hand/hand_pose_estimator.hpp"
#include "core/hand/synthetic_motion.hpp"
#include "tests/unit/hand/real_recording.hpp"

namespace embody::test {
namespace {

constexpr std::size_t kFirstFingerSlot = 3, kFingerSlots = 10;

std::size_t end_of(const Frames& frames, std::size_t first, std::size_t count) {
  return first + std::min(count, frames.size() - std::min(first, frames.size()));
}

}  // namespace

Frames real_frames() {
  Frames frames = read_recording(EMBODY_SOURCE_DIR "/../shared/data/small_pillow.tsv", hand::paper_glove());
  for (std::size_t k = 0; k < frames.size(); ++k) {
    frames[k].t_capture = TimePoint{std::chrono::milliseconds(10) * (k + 1)};
  }
  return frames;
}

Frames synthetic_frames(double duration_s) {
  const hand::SyntheticMotion motion({100.0, duration_s, 1});
  Frames frames;
  for (std::size_t k = 0; k < motion.frame_count(); ++k) {
    frames.push_back(motion.frame(k).markers);
    for (Marker& marker : frames.back().markers) marker.visible = true;
  }
  return frames;
}

void swap_labels(Frames& frames, std::size_t a, std::size_t b, std::size_t first, std::size_t count) {
  for (std::size_t k = first; k < end_of(frames, first, count); ++k) {
    std::swap(frames[k].markers[a], frames[k].markers[b]);
  }
}

void hide(Frames& frames, std::size_t slot, std::size_t first, std::size_t count) {
  for (std::size_t k = first; k < end_of(frames, first, count); ++k) frames[k].markers[slot].visible = false;
}

void put_on_object(Frames& frames, std::size_t slot, const Eigen::Vector3d& offset_m, std::size_t first,
                   std::size_t count) {
  const Eigen::Vector3d p_W = frames[first].markers[slot].p_W + offset_m;
  for (std::size_t k = first; k < end_of(frames, first, count); ++k) {
    if (frames[k].markers[slot].visible) frames[k].markers[slot].p_W = p_W;
  }
}

void put_on_hand(Frames& frames, std::size_t slot, const Eigen::Vector3d& offset_m, std::size_t first,
                 std::size_t count) {
  hand::HandPoseEstimator pose(hand::paper_glove(), Pose::Identity());
  const Eigen::Vector3d p_H = pose.step(frames[first]).X_WH.inverse() * frames[first].markers[slot].p_W + offset_m;
  for (std::size_t k = first; k < end_of(frames, first, count); ++k) {
    const Pose X_WH = pose.step(frames[k]).X_WH;
    if (frames[k].markers[slot].visible) frames[k].markers[slot].p_W = X_WH * p_H;
  }
}

double make_faults(Frames& frames, FaultKind kind, double rate, std::size_t longest, std::uint64_t seed) {
  RandomValues random(seed);
  const auto below = [&](std::size_t n) {
    return std::min(n - 1, static_cast<std::size_t>(random(0.0, static_cast<double>(n))));
  };
  // [frame][marker]: one fault at a time.
  std::vector<std::array<bool, kFingerSlots>> faulty(frames.size());
  const auto total = static_cast<double>(frames.size() * kFingerSlots);
  const auto is_free = [&](std::size_t marker, std::size_t first, std::size_t count) {
    for (std::size_t k = first; k < first + count; ++k) {
      if (faulty[k][marker]) return false;
    }
    return true;
  };
  std::size_t done = 0;
  while (static_cast<double>(done) < rate * total) {
    const std::size_t count = 1 + below(longest), first = 20 + below(frames.size() - 20 - count);
    const std::size_t marker = below(kFingerSlots), other = below(kFingerSlots);
    const FaultKind now = kind == FaultKind::kAll ? static_cast<FaultKind>(below(3)) : kind;
    if (!is_free(marker, first, count)) continue;
    if (now == FaultKind::kSwap && (marker == other || !is_free(other, first, count))) continue;
    const std::size_t slot = kFirstFingerSlot + marker;
    const Eigen::Vector3d offset_m = random(.015, .3) * random.vector<3>(-1.0, 1.0).normalized();
    if (now == FaultKind::kDropOut) hide(frames, slot, first, count);
    if (now == FaultKind::kSwap) swap_labels(frames, slot, kFirstFingerSlot + other, first, count);
    if (now == FaultKind::kGhost) put_on_object(frames, slot, offset_m, first, count);
    for (std::size_t k = first; k < first + count; ++k) {
      faulty[k][marker] = true;
      if (now == FaultKind::kSwap) faulty[k][other] = true;
    }
    done += now == FaultKind::kSwap ? 2 * count : count;
  }
  return static_cast<double>(done) / total;
}

}  // namespace embody::test
