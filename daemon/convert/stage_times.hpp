#pragma once
// CPU time that each stage of the data path took, frame by frame.
#include <ctime>
#include <vector>

#include "core/base/time.hpp"

namespace embody::convert {

/// CPU time of the calling thread. About 0.3 us.
[[nodiscard]] inline Duration thread_time() noexcept {
  timespec t{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return std::chrono::seconds(t.tv_sec) + std::chrono::nanoseconds(t.tv_nsec);
}

/// Microseconds of each frame.
struct StageTimes {
  std::vector<float> pose_us;        ///< markers of the back of the hand -> pose, and the object's
  std::vector<float> fingers_us;     ///< markers of the fingers -> hand state (and its filter)
  std::vector<float> embodiment_us;  ///< hand state -> motors of the robot hand

  void reserve(std::size_t frames) {
    for (auto* stage : {&pose_us, &fingers_us, &embodiment_us}) stage->reserve(frames);
  }
  void add(const StageTimes& other) {
    pose_us.insert(pose_us.end(), other.pose_us.begin(), other.pose_us.end());
    fingers_us.insert(fingers_us.end(), other.fingers_us.begin(), other.fingers_us.end());
    embodiment_us.insert(embodiment_us.end(), other.embodiment_us.begin(), other.embodiment_us.end());
  }
};

[[nodiscard]] inline float in_us(Duration d) noexcept {
  return std::chrono::duration<float, std::micro>(d).count();
}

}  // namespace embody::convert
