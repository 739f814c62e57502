#pragma once
// What is known about one finger marker from the frames before: where it was, where it should be now, and the stranger
// that carries its label meanwhile. All positions in the hand's own frame M, m.
#include <cstdint>

#include "core/hand/glove_layout.hpp"

namespace embody::hand {

struct MarkerGuardConfig {
  /// A marker is believed while it is within step + acceleration * dt^2 of its prediction; real gloves step by 8 to
  /// 10 mm on the skin, finger tips in free motion accelerate by up to 40 m/s^2. At 100 Hz: 10 mm.
  double step_m{0.006};
  double acceleration_m_s2{40.0};
  double largest_gate_m{0.03};  ///< the gate at low or irregular rates
  double speed_m_s{2.0};        ///< of a finger in the palm frame: how far a marker may return from where it was lost
  double relabel_m{0.008};      ///< a label that jumped this near to another marker's prediction is that marker
  /// A place that lasts is believed when a posture leaves no marker of the finger farther off than this, and a believed
  /// marker that stays farther from the model than that is a ghost; both beyond what is usual for the finger.
  double explained_m{0.010};
  double dropped_m{0.015};
  double reach_margin_m{0.025};  ///< beyond the straight finger's reach, for people and gloves of other sizes
  /// How long another place than the expected one must last before it is looked at: one to which a believed marker
  /// jumped; one to which it jumped on from there; one where it was seen again after a gap or after being a ghost.
  Duration lasting{std::chrono::milliseconds(500)};
  Duration back_again{std::chrono::milliseconds(50)};
  Duration returned{std::chrono::milliseconds(20)};
  Duration ask_again{std::chrono::milliseconds(100)};  ///< at the least, after no posture explained the place
  std::uint32_t ghost_frames{10};                      ///< out of reach or unexplained for so many frames: a ghost
  Duration forget{std::chrono::seconds(1)};  ///< after so long out of sight any reachable position is believed
  double label_advantage_m{0.003};           ///< exchanged labels are taken back when they fit better by so much, mean
};

class MarkerTrack {
 public:
  MarkerTrack() noexcept = default;
  /// @param knuckle_M  centre of the finger's first joint
  /// @param reach_m    distance from it that the marker can have
  MarkerTrack(const Eigen::Vector3d& knuckle_M, double reach_m) noexcept : knuckle_M_(knuckle_M), reach_m_(reach_m) {}

  /// One frame later. `seen`: a measurement carries this marker's own label.
  void advance(Duration dt, bool seen, const MarkerGuardConfig& config) noexcept;
  /// Moves what is known by the motion of the frame of reference.
  void shift(const Eigen::Vector3d& d_M) noexcept;

  /// Distance of `p_M` to the nearest place at which the marker is expected: anywhere between where it was and where
  /// constant speed carried it, or where the model has carried it since. Infinite when nothing is known.
  [[nodiscard]] double distance_m(const Eigen::Vector3d& p_M) const noexcept;
  [[nodiscard]] Eigen::Vector3d predicted_M() const noexcept;
  /// `p_M` goes on where the label was doubted before: only a place close to the expected one ends the doubt.
  [[nodiscard]] bool goes_on(const Eigen::Vector3d& p_M, double gate_m, Duration dt) const noexcept;
  [[nodiscard]] bool reachable(const Eigen::Vector3d& p_M) const noexcept;

  void believe(const Eigen::Vector3d& p_M, const MarkerGuardConfig& config) noexcept;
  /// The marker's label is at `p_M`, where it is not believed.
  void doubt(const Eigen::Vector3d& p_M, double gate_m, Duration dt, const MarkerGuardConfig& config) noexcept;
  /// The doubted place has lasted and the finger could get there: whether a posture explains it is worth asking.
  [[nodiscard]] bool asks() const noexcept;
  /// The answer: believed from the next frame on, or a ghost for now.
  /// `usual_m`: residual that is usual for this finger.
  void answer(double residual_m, double usual_m, const MarkerGuardConfig& config) noexcept;

  /// Where the model has the marker in this frame.
  void explain(const Eigen::Vector3d& model_M, Duration dt, const MarkerGuardConfig& config) noexcept;
  /// Declares the believed marker a ghost; the model's point is where it is expected now.
  void drop(const MarkerGuardConfig& config) noexcept;

  [[nodiscard]] bool known() const noexcept { return known_; }
  [[nodiscard]] bool believed() const noexcept { return known_ && unseen_ == Duration{0}; }
  [[nodiscard]] bool ghost() const noexcept { return ghost_; }
  [[nodiscard]] std::uint32_t unexplained() const noexcept { return unexplained_; }
  void excuse() noexcept { unexplained_ = 0; }
  /// Distance to the model in the last frame in which it was believed.
  [[nodiscard]] double residual_m() const noexcept { return residual_m_; }
  /// Mean distance while it was believed: over all of the first seconds, then over the last ones.
  [[nodiscard]] double usual_m() const noexcept { return usual_m_; }
  void restart() noexcept;  ///< nothing is known

 private:
  struct Candidate {
    Eigen::Vector3d p_M{0.0, 0.0, 0.0};
    Eigen::Vector3d v_M{0.0, 0.0, 0.0};
    std::uint32_t frames{0};
    Duration age{0};
    Duration needed{0};  // age at which it is worth a question
  };

  Eigen::Vector3d knuckle_M_{0.0, 0.0, 0.0};
  double reach_m_{0.0};
  bool known_{false};
  bool ghost_{false};
  bool modelled_{false};
  Eigen::Vector3d p_M_{0.0, 0.0, 0.0};       // last believed
  Eigen::Vector3d v_M_{0.0, 0.0, 0.0};       // m/s
  Eigen::Vector3d model_M_{0.0, 0.0, 0.0};   // in the last frame
  Eigen::Vector3d offset_m_{0.0, 0.0, 0.0};  // believed place minus model, then
  Duration unseen_{0};                       // since it was believed
  Duration absent_{0};                       // since its label was seen
  Duration gap_{0};                          // how long the label was away before it returned
  double residual_m_{0.0};
  double usual_m_{0.0};
  Duration explained_{0};  // time behind that mean
  std::uint32_t unexplained_{0};
  Candidate candidate_;
};

}  // namespace embody::hand
