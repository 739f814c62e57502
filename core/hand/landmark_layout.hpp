#pragma once
// The 21 landmarks of optical hand trackers in the order of MediaPipe Hands (Zhang et al. 2020) - WebXR's joints
// without the metacarpals of the four fingers - and what each is on the hand model.
#include "core/hand/finger_estimator.hpp"
#include "core/hand/glove_layout.hpp"
#include "core/hand/hand_model.hpp"

namespace embody::hand {

inline constexpr std::size_t kLandmarks = 21;

/// Slots of a landmark frame: wrist; thumb cmc, mcp, ip, tip; then mcp, pip, dip, tip of index, middle, ring, little.
inline constexpr std::array<const char*, kLandmarks> kLandmarkNames{
    "wrist",     "thumb_cmc", "thumb_mcp",  "thumb_ip",   "thumb_tip",  "index_mcp",  "index_pip",
    "index_dip", "index_tip", "middle_mcp", "middle_pip", "middle_dip", "middle_tip", "ring_mcp",
    "ring_pip",  "ring_dip",  "ring_tip",   "little_mcp", "little_pip", "little_dip", "little_tip"};

/// A landmark that is rigid with the palm, and the joint of the model that it shows.
struct PalmLandmark {
  std::size_t slot{0};
  std::size_t joint{0};  ///< MANO's order
};
/// Wrist, base of the thumb, knuckles of index, middle, ring and little finger.
inline constexpr std::array<PalmLandmark, 6> kPalmLandmarks{{{0, 0},
                                                             {1, first_joint(Finger::kThumb)},
                                                             {5, first_joint(Finger::kIndex)},
                                                             {9, first_joint(Finger::kMiddle)},
                                                             {13, first_joint(Finger::kRing)},
                                                             {17, first_joint(Finger::kLittle)}}};

/// Slots and, as finger markers, the 15 landmarks that move with the fingers: their points are those of
/// landmark_points(). There are no back markers; back_slots span the palm.
[[nodiscard]] GloveLayout landmark_layout() noexcept;

/// The model's points for landmark_layout(): per finger the default tip and middle point, which the embodiment mapping
/// follows, then its second and third joint and the fleshy tip. Allocates nothing.
[[nodiscard]] HandPoints landmark_points(const HandData& data);

/// `config` as a landmark tracker needs it: labels are what they say (a landmark is never another one), a landmark that
/// the tracker is hardly sure of moves nothing, and errors of some millimetres are usual.
[[nodiscard]] FingerEstimatorConfig for_landmarks(FingerEstimatorConfig config) noexcept;

using FingerAngles = Eigen::Matrix<double, static_cast<int>(kHandAngles), 1>;

/// Where the model has its landmarks in frame M (m), by slot, for the 45 finger angles in MANO's order. No heap.
[[nodiscard]] std::array<Eigen::Vector3d, kLandmarks> landmark_positions(const HandModel& model,
                                                                         const FingerAngles& q_rad) noexcept;

}  // namespace embody::hand
