#pragma once
// Configuration of the human side: glove, person, record mapping. Part of config.hpp.
#include <array>
#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "core/hand/finger_problem.hpp"
#include "daemon/app/config_field.hpp"

namespace embody::config {

/// What a finger marker shows of the hand model.
enum class FingerPoint : std::uint8_t { kTip, kMiddle, kBone, kSurface };
inline constexpr std::array<const char*, 4> kFingerPointNames{"tip", "middle", "bone", "surface"};

/// Most markers on one finger.
inline constexpr std::size_t kMaxMarkersPerFinger = hand::kMaxFingerPoints - 2;

/// One marker on a finger: which point of the hand model it shows.
struct FingerMarkerConfig {
  std::string marker;
  Finger finger{Finger::kThumb};
  FingerPoint point{FingerPoint::kTip};
  int joint{1};
  std::array<int, 3> vertices{};
  std::array<double, 3> barycentric{1.0, 0.0, 0.0};
  std::array<double, 3> offset_m{};

  template <class V>
  void visit(V& v) {
    v.field("marker", marker, "Name of the marker, one of `names`.");
    v.choice("finger", finger, kFingerNames, "Finger that carries it.");
    v.choice("point", point, kFingerPointNames,
             "tip: the nail; middle: the back of the first phalanx (thumb: of its middle one); bone: `offset_m` from "
             "`joint`; surface: `offset_m` from a point of the model's surface.");
    v.field("joint", joint, Range{1, 3},
            "bone: the joint that moves the marker and `offset_m` is measured from: 1 is the finger's knuckle, 3 its "
            "last joint.");
    v.field("vertices", vertices, Range{0, 100000},
            "surface: corners of the triangle, numbers of the model's vertices; for a single vertex three times the "
            "same.");
    v.field("barycentric", barycentric, Range{0, 1}, "surface: weights of the corners; their sum is 1.");
    v.field("offset_m", offset_m, Range{-0.2, 0.2},
            "bone, surface: from there to the marker's centre, in the flat hand along the axes of M.");
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
    v.field("left", left, "Marker on the thumb's side: left on a right hand that is seen from behind, fingers up.");
    v.field("right", right, "Marker on the little finger's side: the origin of frame H.");
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
    v.list("finger_markers", finger_markers,
           "Markers on the fingers: any fingers, up to 6 on each; one at most is its tip, one its middle point.");
    v.section("back", back, "The three markers on the back of the hand.");
  }
  [[nodiscard]] std::string problem() const;
};

enum class Skeleton : std::uint8_t { kA, kB };
inline constexpr std::array<const char*, 2> kSkeletonNames{"A", "B"};

/// Where a calibration found one marker of the glove on this person.
struct MarkerPlaceConfig {
  std::string marker;
  int joint{1};
  std::array<double, 3> offset_m{};

  template <class V>
  void visit(V& v) {
    v.field("marker", marker, "Name of the marker, one of the glove's finger markers.");
    v.field("joint", joint, Range{1, 3}, "Joint that moves it: 1 is the finger's knuckle, 3 its last joint.");
    v.field("offset_m", offset_m, Range{-0.2, 0.2},
            "From that joint to the marker's centre, in this person's flat hand along the axes of M.");
  }
};

/// The person: which hand, its size, and where the markers sit on it.
struct SubjectConfig {
  Side side{Side::kRight};
  Skeleton skeleton{Skeleton::kA};
  std::string model;
  std::array<double, 10> shape{};
  std::array<double, 6> X_HM_exponential{0.1795496537,  1.6513870904,  -0.1843735310,
                                         -0.0658988406, -0.0238788252, 0.0873064542};
  std::array<double, 3> back_edges_m{};
  std::vector<MarkerPlaceConfig> markers;

  template <class V>
  void visit(V& v) {
    v.file_key("", "Subject file with the keys of this table (`subjects/*.toml`; `embodyctl calibrate` writes them).");
    v.choice("side", side, kSideNames, "Which hand; part of the topic names (rt/embody/right/...).");
    v.choice("skeleton", skeleton, kSkeletonNames,
             "Built-in hand skeleton: A from mean bone lengths, B from the WebXR generic hand.");
    v.path("model", model, "Hand model written by `embodyctl import-mano`, instead of the built-in hand.");
    v.field("shape", shape, Range{-20, 20},
            "Built-in hand: relative changes of its size (-0.5 to 2; 0.05 = 5 % more): scale, palm breadth, palm "
            "length, length of thumb, index, middle, ring and little finger, girth, length of the last phalanges. "
            "With `model`: its first ten shape parameters.");
    v.field("X_HM_exponential", X_HM_exponential, Range{-10, 10},
            "Pose of the hand model M in the hand-marker frame H as exponential coordinates: three of rotation (rad), "
            "three of translation (m).");
    v.field("back_edges_m", back_edges_m, Range{0, 0.5},
            "Distances top-left, top-right and left-right of the three back markers; zeros: learnt from the first good "
            "frames.");
    v.list("markers", markers,
           "Calibrated places of finger markers; a marker that is listed here is not where the "
           "glove file puts it.");
  }
  [[nodiscard]] std::string problem() const;
};

/// Smoothing of finger angles and prediction (docs/filtering.md).
struct FilterConfig {
  milliseconds lag_at_rest{400};
  milliseconds lag_in_motion{10};
  double motion_rad_s{0.6};
  milliseconds predict{0};
  double predict_limit_rad{0.1};
  milliseconds predict_pose{0};
  double predict_pose_limit_m{0.03};
  double predict_pose_limit_rad{0.15};

  template <class V>
  void visit(V& v) {
    v.field("lag_at_rest_ms", lag_at_rest, Range{0, 2000},
            "Delay of the finger angles while a finger is still: what it takes to calm noisy markers. 0: no filter.");
    v.field("lag_in_motion_ms", lag_in_motion, Range{0, 500},
            "Delay of the finger angles while a finger moves; never more than at rest.");
    v.field("motion_rad_s", motion_rad_s, Range{0.05, 20},
            "A finger moves when one of its joints turns at this speed or faster; a third of it still counts as rest.");
    v.field("predict_ms", predict, Range{0, 300},
            "Known delay of the robot hand that moving fingers are predicted ahead by. 0: off.");
    v.field("predict_limit_rad", predict_limit_rad, Range{0, 0.5}, "Most that a prediction turns a joint by.");
    v.field("predict_pose_ms", predict_pose, Range{0, 200},
            "Known delay of the arm that the hand pose is predicted ahead by. 0: off.");
    v.field("predict_pose_limit_m", predict_pose_limit_m, Range{0, 0.2}, "Most that a prediction moves the hand by.");
    v.field("predict_pose_limit_rad", predict_pose_limit_rad, Range{0, 1}, "Most that a prediction turns the hand by.");
  }
};

inline constexpr std::array<const char*, 2> kObjectiveNames{"paper", "published"};
inline constexpr std::array<const char*, 2> kSolverNames{"own", "slsqp"};

/// What is known about the angles of one finger before it is seen: three joints from the knuckle, of each the rotation
/// about x, y, z of a right hand (the program mirrors them for a left one).
struct FingerPriorConfig {
  std::array<double, 9> lower_rad{};
  std::array<double, 9> upper_rad{};
  std::array<double, 9> weight_plus{};
  std::array<double, 9> weight_minus{};
  std::array<double, 9> temporal_m_rad{};

  template <class V>
  void visit(V& v) {
    v.field("lower_rad", lower_rad, Range{-kPi, 0}, "Lower bounds of the angles.");
    v.field("upper_rad", upper_rad, Range{0, kPi}, "Upper bounds of the angles.");
    v.field("weight_plus", weight_plus, Range{0, 10}, "Cost of a positive angle, m/rad: adds (weight x angle)^2.");
    v.field("weight_minus", weight_minus, Range{0, 10}, "Cost of a negative angle, m/rad.");
    v.field("temporal_m_rad", temporal_m_rad, Range{0, 10}, "Cost of a change of the angle within 10 ms.");
  }
};

struct RecordMappingConfig {
  hand::FingerObjective objective{hand::FingerObjective::kPaper};
  hand::FingerSolver solver{hand::FingerSolver::kOwn};
  int max_iterations{30};
  double coupling_m_rad{0.0};
  double coupling_ratio{0.0};
  double catch_up_rad_s{0.0};
  milliseconds hold{0};
  milliseconds decay{0};
  milliseconds slow_down{0};
  bool slow_down_spins{false};
  std::array<FingerPriorConfig, kFingers> fingers;  ///< by Finger
  FilterConfig filter;

  /// The defaults of the finger estimator.
  RecordMappingConfig();

  template <class V>
  void visit(V& v) {
    v.file_key("", "File with the keys of this table (`record_mapping/*.toml`).");
    v.choice("objective", objective, kObjectiveNames,
             "Penalty of angles. paper: the sum of the squares of weighted angles; published: the square of their sum, "
             "as in the published implementation of the paper.");
    v.choice("solver", solver, kSolverNames,
             "own: bounded least squares in constant memory; slsqp: NLopt's SLSQP, for comparison. With slsqp the "
             "finger thread runs with normal scheduling, since that solver allocates memory.");
    v.field("max_iterations", max_iterations, Range{1, 1000},
            "own: iterations per finger and frame before the best point so far is taken.");
    v.field("coupling_m_rad", coupling_m_rad, Range{0, 1},
            "Cost of a last joint (not the thumb's) that does not flex `coupling_ratio` as much as the joint before. "
            "0: off.");
    v.field("coupling_ratio", coupling_ratio, Range{0, 2}, "Flexion of the last joint per flexion of the one before.");
    v.field("catch_up_rad_s", catch_up_rad_s, Range{0.1, 1000},
            "After a marker disappeared or returned a joint turns no faster than this until the fit has caught up.");
    v.field("hold_ms", hold, Range{0, 60000}, "A finger without markers keeps its angles for this long.");
    v.field("decay_ms", decay, Range{10, 60000}, "Then it returns to the flat hand with this time constant.");
    v.field("slow_down_ms", slow_down, Range{0, 10000},
            "Diagnosis: extra time per frame in the finger thread, to show that the arm does not depend on it.");
    v.field("slow_down_spins", slow_down_spins, "Diagnosis: spend that time computing (true) or waiting (false).");
    for (std::size_t i = 0; i < kFingers; ++i) {
      v.section(kFingerNames[i], fingers[i],
                "Nine numbers each: x, y, z of the knuckle, of the middle and of the last joint of this finger. On a "
                "right hand, flexion of the four fingers is positive z.");
    }
    v.section("filter", filter, "Smoothing of finger angles and prediction: what they gain and what they cost.");
  }
};

}  // namespace embody::config
