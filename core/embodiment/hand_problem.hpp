#pragma once
// The paper's embodiment objective for some fingers of a robot hand, and what may be added to it: a function of the
// motors that move those fingers.
#include <bitset>

#include "core/embodiment/robot_finger.hpp"
#include "core/math/bounded_least_squares.hpp"

namespace embody {

/// What the robot's fingers are to do in this frame, in P.
struct HandGoal {
  std::array<std::array<Eigen::Vector3d, 2>, kFingers> points_P = zero_points();  ///< tip, middle, m
  std::array<Eigen::Vector3d, kFingers> directions_P = zero_points_of_one();      ///< of the last phalanges, unit
  std::array<double, kFingers> pinch_gap_m{};       ///< distance of the human finger's surface from the thumb's
  std::array<double, kFingers> pinch_weight{};      ///< of that distance; 0: no pinch. Of a metre against a metre
  std::array<double, kMaxHandJoints> last_rad{};    ///< motors in the last frame
  std::array<double, kMaxHandJoints> stay_m_rad{};  ///< weight of a motor's change; 0: free

  [[nodiscard]] static std::array<Eigen::Vector3d, kFingers> zero_points_of_one() noexcept {
    std::array<Eigen::Vector3d, kFingers> out;
    out.fill(Eigen::Vector3d::Zero());
    return out;
  }
};

using FingerSet = std::bitset<kFingers>;

/// Weights of the additions to the objective, constant over frames.
struct HandWeights {
  double orientation_m{0.0};
  double collision_m{0.0};         ///< margin, m; 0: off
  double collision_weight{100.0};  ///< of a metre of penetration against a metre of a point
};

/// min sum_f |tip_f - goal|^2 + |middle_f - goal|^2
///     + orientation^2 |direction_f - goal|^2                       (tips look where the human's do)
///     + sum_f pinch_weight^2 (gap(thumb, f) - pinch_gap)^2         (touching surfaces touch)
///     + collision_weight^2 sum_{f<g} max(margin - gap(f, g), 0)^2  (tips keep clear; pinched pairs left out)
///     + sum_m stay^2 (r_m - last_m)^2
/// over the motors of the fingers in `fingers`. gap(f, g) is the distance of the tips' pads: of their axes less radii.
class HandProblem {
 public:
  using Model = math::NewtonModel<Eigen::Dynamic, static_cast<int>(kMaxHandJoints)>;
  using Variables = Model::Variables;
  using Chains = std::array<std::optional<RobotFinger>, kFingers>;

  /// `chains`, `goal` and `weights` must outlive the problem.
  HandProblem(const Chains& chains, const HandGoal& goal, const HandWeights& weights, FingerSet fingers) noexcept;

  /// Motors of the problem: variable i is motor motors()[i].
  [[nodiscard]] std::span<const std::size_t> motors() const noexcept { return {motors_.begin(), motors_.size()}; }
  [[nodiscard]] Eigen::Index size() const noexcept { return static_cast<Eigen::Index>(motors_.size()); }
  /// Where the slopes of couplings are taken, by motor (RobotFinger::update).
  void set_piece(std::size_t motor, double piece) noexcept { piece_[motor] = piece; }

  /// Cost, m^2; with the gradient and the Gauss-Newton and second-order parts of half of it.
  [[nodiscard]] double cost(const Variables& x) const noexcept;
  void evaluate(const Variables& x, Model& model) const noexcept;

 private:
  using Postures = std::array<RobotFinger::Posture, kFingers>;
  struct Pair {
    std::size_t a, b;
    double gap_m;
    Eigen::Vector3d p_a, p_b, normal;  // nearest points of the axes, from a to b
  };

  void update(const Variables& x, Postures& postures) const noexcept;
  [[nodiscard]] Pair pair(std::size_t a, std::size_t b, const Postures& postures) const noexcept;
  template <class Visit>
  void visit_gaps(const Postures& postures, const Visit& visit) const noexcept;
  void add_vector(std::size_t finger, std::size_t joint, const Eigen::Vector3d& p_P, bool direction,
                  const Eigen::Vector3d& error, double weight, const RobotFinger::Posture& posture,
                  Model& model) const noexcept;
  void add_gap(const Pair& pair, double error, double weight, const Postures& postures, Model& model) const noexcept;

  const Chains& chains_;
  const HandGoal& goal_;
  const HandWeights& weights_;
  FingerSet fingers_;
  StaticVector<std::size_t, kMaxHandJoints> motors_;
  std::array<Eigen::Index, kMaxHandJoints> variable_{};  // by motor
  std::array<double, kMaxHandJoints> piece_{};
};

}  // namespace embody
