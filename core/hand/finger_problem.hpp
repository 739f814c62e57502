#pragma once
// The optimisation problem of one finger in one frame, and the two solvers behind one interface.
// With the usable markers j at p^_j and model points f_j(q):
//   min_q sum_j c_j ||p^_j - f_j(q)||^2 + R(q) + prior(q),   lower <= q <= upper
// Paper (Fabisch et al. 2022, III-B):            R = ||max(w+ o q, 0)||^2 + ||min(w- o q, 0)||^2
// Published implementation (hand_embodiment):    R = (w+ . max(q, 0))^2 + (w- . max(-q, 0))^2
// prior = a^2 (q_DIP - r q_PIP)^2 + ||t o (q - q_previous)||^2, flexion angles (z) of the last two joints.
#include "core/hand/hand_model.hpp"

namespace embody::hand {

enum class FingerObjective : std::uint8_t { kPaper, kPublished };
enum class FingerSolver : std::uint8_t {
  kOwn,    ///< bounded damped Newton: fixed size, analytic derivatives, hard iteration cap, no heap
  kSlsqp,  ///< NLopt's SLSQP, the reference: allocates, not for real-time threads
};

struct FingerMeasurement {
  std::size_t point{0};                ///< of the model's points of this finger
  Eigen::Vector3d p_M{0.0, 0.0, 0.0};  ///< where it was seen, m
  double weight{1.0};                  ///< of its squared distance
};

struct FingerProblem {
  const HandModel* model{nullptr};
  Finger finger{Finger::kThumb};
  StaticVector<FingerMeasurement, kMaxFingerPoints> markers;
  FingerObjective objective{FingerObjective::kPaper};
  Vector9 lower_rad{Vector9::Zero()};
  Vector9 upper_rad{Vector9::Zero()};
  Vector9 weight_plus{Vector9::Zero()};     ///< m/rad
  Vector9 weight_minus{Vector9::Zero()};    ///< m/rad
  double coupling_m_rad{0.0};               ///< a: weight of the coupled flexion of the last two joints, m/rad
  double coupling_ratio{2.0 / 3.0};         ///< r: DIP flexion per PIP flexion
  Vector9 temporal_m_rad{Vector9::Zero()};  ///< t: weight of a change since the previous frame, m/rad
  Vector9 q_previous_rad{Vector9::Zero()};
  Vector9 start_rad{Vector9::Zero()};  ///< first iterate

  /// The objective, m^2.
  [[nodiscard]] double cost(const Vector9& q_rad) const noexcept;
  /// The objective and its gradient, m^2/rad.
  [[nodiscard]] double cost(const Vector9& q_rad, Vector9& gradient) const noexcept;
};

enum class SolveStatus : std::uint8_t {
  kOptimal,
  kAtLimit,  ///< optimal, with at least one angle pressed against a bound
  kCapped,   ///< iteration cap reached; best point so far
  kInvalid,  ///< not finite: `q_rad` is the start
};

struct FingerSolution {
  Vector9 q_rad{Vector9::Zero()};
  SolveStatus status{SolveStatus::kInvalid};
  double cost_m2{0.0};
  double optimality{0.0};  ///< first-order optimality of half the cost in the box, m^2/rad
  int iterations{0};
};

/// True when an angle that may move at all touches one of its bounds.
[[nodiscard]] bool pressed_against_bound(const FingerProblem& problem, const Vector9& q_rad) noexcept;

/// The default solver. No heap; work bounded by `max_iterations`.
[[nodiscard]] FingerSolution solve_own(const FingerProblem& problem, int max_iterations, double tolerance) noexcept;

/// NLopt's SLSQP (Kraft 1988) on the same problem, relative tolerance `ftol` on the cost and on the angles. Allocates.
[[nodiscard]] FingerSolution solve_slsqp(const FingerProblem& problem, int max_evaluations, double ftol);

}  // namespace embody::hand
