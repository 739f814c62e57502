#pragma once
// CPU time that each stage of the data path took, frame by frame.
#include <vector>

#include "daemon/evaluate/samples.hpp"

namespace embody::convert {

/// Microseconds of each frame.
struct StageTimes {
  std::vector<float> pose_us;        ///< markers of the back of the hand -> pose, and the object's
  std::vector<float> fingers_us;     ///< markers of the fingers -> hand state (and its filter)
  std::vector<float> embodiment_us;  ///< hand state -> motors of the robot hand

  void reserve(std::size_t frames) {
    for (auto* stage : {&pose_us, &fingers_us, &embodiment_us}) stage->reserve(frames);
  }
  void add(const StageTimes& other) {
    evaluate::append(pose_us, other.pose_us);
    evaluate::append(fingers_us, other.fingers_us);
    evaluate::append(embodiment_us, other.embodiment_us);
  }
};

[[nodiscard]] inline float in_us(Duration d) noexcept {
  return std::chrono::duration<float, std::micro>(d).count();
}

}  // namespace embody::convert
