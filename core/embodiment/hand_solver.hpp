#pragma once
// Minimises a HandProblem within the ranges of its motors, across the kinks of couplings.
#include "core/embodiment/hand_problem.hpp"

namespace embody {

inline constexpr std::size_t kMaxKinks = 12;

/// Range of one motor and where couplings change their slope inside it.
struct MotorRange {
  double lower_rad{0.0};
  double upper_rad{0.0};
  StaticVector<double, kMaxKinks> kinks_rad;  ///< increasing, strictly inside

  /// The same within other ends.
  [[nodiscard]] MotorRange within(double lower, double upper) const noexcept;
};

struct HandSolverOptions {
  int max_iterations{30};   ///< of all pieces together; each evaluates the problem once
  double tolerance{1e-12};  ///< first-order optimality of half the cost in the box, m^2/rad
};

struct HandSolution {
  HandProblem::Variables x;
  double cost_m2{0.0};
  double optimality{0.0};
  int iterations{0};
  bool converged{false};  ///< false: the iteration cap was reached, or nothing finite
  bool valid{false};      ///< false: the goal is not finite; `x` is the start
};

/// A local minimum from `start` on: minimises within one smooth piece (minimize_in_box), crosses a kink when the cost
/// falls beyond it, and goes on. `ranges` by variable of the problem. No heap; work bounded by `max_iterations`.
[[nodiscard]] HandSolution solve_own(HandProblem& problem, std::span<const MotorRange> ranges,
                                     const HandProblem::Variables& start, const HandSolverOptions& options) noexcept;

/// The best of the minima from a coarse scan (motor by motor) of every smooth piece: independent of history. For
/// problems of few motors; some ten evaluations of the cost and a solve per piece. `start` becomes the best start.
[[nodiscard]] HandSolution solve_everywhere(HandProblem& problem, std::span<const MotorRange> ranges,
                                            HandProblem::Variables& start, const HandSolverOptions& options) noexcept;

/// NLopt's SLSQP (Kraft 1988) on the same problem from the same start, relative tolerance `ftol`. Allocates.
[[nodiscard]] HandSolution solve_slsqp(HandProblem& problem, std::span<const MotorRange> ranges,
                                       const HandProblem::Variables& start, int max_evaluations, double ftol);

}  // namespace embody
