#pragma once
// Configuration of the human side: glove, person, record mapping. Part of config.hpp.
#include <array>
#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "core/hal/types.hpp"
#include "daemon/app/config_field.hpp"

namespace embody::config {

enum class FingerPoint : std::uint8_t { kTip, kMiddle };
inline constexpr std::array<const char*, 2> kFingerPointNames{"tip", "middle"};

/// One marker on a finger: which point of the hand model it shows.
struct FingerMarkerConfig {
  std::string marker;
  Finger finger{Finger::kThumb};
  FingerPoint point{FingerPoint::kTip};

  template <class V>
  void visit(V& v) {
    v.field("marker", marker, "Name of the marker, one of `names`.");
    v.choice("finger", finger, kFingerNames, "Finger that carries it.");
    v.choice("point", point, kFingerPointNames, "Finger tip, or the marker near the middle joint.");
  }
};

/// The three markers on the back of the hand that span frame H (docs/notation.md).
struct BackMarkersConfig {
  std::string top{"hand_top"};
  std::string left{"hand_left"};
  std::string right{"hand_right"};

  template <class V>
  void visit(V& v) {
    v.field("top", top, "Marker towards the fingers.");
    v.field("left", left, "Left marker, seen from behind with the fingers up.");
    v.field("right", right, "Right marker: the origin of frame H.");
  }
};

/// Marker glove. The default is the 13-marker glove of the paper.
struct GloveConfig {
  std::vector<std::string> names{"hand_top",    "hand_left",    "hand_right",   "thumb_tip",     "thumb_middle",
                                 "index_tip",   "index_middle", "middle_tip",   "middle_middle", "ring_tip",
                                 "ring_middle", "little_tip",   "little_middle"};
  std::vector<FingerMarkerConfig> finger_markers{
      {"thumb_tip", Finger::kThumb, FingerPoint::kTip},   {"thumb_middle", Finger::kThumb, FingerPoint::kMiddle},
      {"index_tip", Finger::kIndex, FingerPoint::kTip},   {"index_middle", Finger::kIndex, FingerPoint::kMiddle},
      {"middle_tip", Finger::kMiddle, FingerPoint::kTip}, {"middle_middle", Finger::kMiddle, FingerPoint::kMiddle},
      {"ring_tip", Finger::kRing, FingerPoint::kTip},     {"ring_middle", Finger::kRing, FingerPoint::kMiddle},
      {"little_tip", Finger::kLittle, FingerPoint::kTip}, {"little_middle", Finger::kLittle, FingerPoint::kMiddle}};
  BackMarkersConfig back;

  template <class V>
  void visit(V& v) {
    v.file_key("", "Glove file with the keys of this table (`gloves/*.toml`).");
    v.field("names", names, "All markers as the tracker labels them; the order is that of the slots of a frame.");
    v.list("finger_markers", finger_markers, "Markers on the fingers: at most one per finger and point.");
    v.section("back", back, "The three markers on the back of the hand.");
  }
  [[nodiscard]] std::string problem() const;
};

enum class Skeleton : std::uint8_t { kA, kB };
inline constexpr std::array<const char*, 2> kSkeletonNames{"A", "B"};

/// The person: size of the hand, and where the back markers sit on it.
struct SubjectConfig {
  std::array<double, 6> X_HM_exponential{0.1795496537,  1.6513870904,  -0.1843735310,
                                         -0.0658988406, -0.0238788252, 0.0873064542};
  std::array<double, 10> shape{};
  Skeleton skeleton{Skeleton::kA};

  template <class V>
  void visit(V& v) {
    v.file_key("", "Subject file with the keys of this table (`subjects/*.toml`).");
    v.field("X_HM_exponential", X_HM_exponential, Range{-10, 10},
            "Pose of the hand model M in the hand-marker frame H as exponential coordinates: three of rotation (rad), "
            "three of translation (m).");
    v.field("shape", shape, Range{-0.5, 2},
            "Relative changes of the hand's size, 0.05 = 5 % more: scale, palm breadth, palm length, length of thumb, "
            "index, middle, ring and little finger, girth, length of the last phalanges.");
    v.choice("skeleton", skeleton, kSkeletonNames,
             "Built-in hand skeleton: A from mean bone lengths, B from the WebXR generic hand.");
  }
};

struct RecordMappingConfig {
  double lower_rad{-0.4 * kPi};
  double upper_rad{0.4 * kPi};
  int max_iterations{30};
  milliseconds slow_down{0};
  bool slow_down_spins{false};

  template <class V>
  void visit(V& v) {
    v.field("lower_rad", lower_rad, Range{-kPi, 0}, "Lower bound of each of the 45 finger angles of the hand model.");
    v.field("upper_rad", upper_rad, Range{0, kPi}, "Upper bound of each of the 45 finger angles of the hand model.");
    v.field("max_iterations", max_iterations, Range{1, 1000},
            "Iterations per finger and frame before the best "
            "point so far is taken.");
    v.field("slow_down_ms", slow_down, Range{0, 10000},
            "Diagnosis: extra time per frame in the finger thread, to show that the arm does not depend on it.");
    v.field("slow_down_spins", slow_down_spins, "Diagnosis: spend that time computing (true) or waiting (false).");
  }
};

}  // namespace embody::config
