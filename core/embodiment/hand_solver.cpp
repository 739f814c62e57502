#include "core/embodiment/hand_solver.hpp"

#include <algorithm>
#include <cmath>

namespace embody {
namespace {

using Eigen::Index;
using Variables = HandProblem::Variables;

/// The smooth piece of a motor's range that a coordinate lies in: its ends, found by index.
struct Piece {
  std::size_t index{0};  // between kinks index-1 and index

  [[nodiscard]] double lower(const MotorRange& range) const noexcept {
    return index == 0 ? range.lower_rad : range.kinks_rad[index - 1];
  }
  [[nodiscard]] double upper(const MotorRange& range) const noexcept {
    return index == range.kinks_rad.size() ? range.upper_rad : range.kinks_rad[index];
  }
};

Piece piece_of(const MotorRange& range, double x) noexcept {
  const auto beyond = std::upper_bound(range.kinks_rad.begin(), range.kinks_rad.end(), x);
  return {static_cast<std::size_t>(beyond - range.kinks_rad.begin())};
}

class PieceWalk {
 public:
  PieceWalk(HandProblem& problem, std::span<const MotorRange> ranges, const Variables& x) noexcept
      : problem_(problem), ranges_(ranges) {
    lower.resize(x.size());
    upper.resize(x.size());
    for (Index i = 0; i < x.size(); ++i) enter(i, piece_of(ranges_[static_cast<std::size_t>(i)], x(i)));
  }

  /// Enters a neighbouring piece in which the cost falls from `x` on; false when there is none.
  bool cross(const Variables& x, double tolerance) noexcept {
    HandProblem::Model model;
    for (Index i = 0; i < x.size(); ++i) {
      const auto& range = ranges_[static_cast<std::size_t>(i)];
      const Piece here = pieces_[static_cast<std::size_t>(i)];
      const bool down = x(i) <= lower(i) && here.index > 0;
      const bool up = x(i) >= upper(i) && here.index < range.kinks_rad.size();
      if (down == up) continue;
      enter(i, {down ? here.index - 1 : here.index + 1});
      problem_.evaluate(x, model);
      if ((down ? model.gradient(i) : -model.gradient(i)) > tolerance) return true;
      enter(i, here);
    }
    return false;
  }

  Variables lower, upper;

 private:
  void enter(Index i, Piece piece) noexcept {
    const auto k = static_cast<std::size_t>(i);
    pieces_[k] = piece;
    lower(i) = piece.lower(ranges_[k]);
    upper(i) = piece.upper(ranges_[k]);
    problem_.set_piece(problem_.motors()[k], 0.5 * (lower(i) + upper(i)));
  }

  HandProblem& problem_;
  std::span<const MotorRange> ranges_;
  std::array<Piece, kMaxHandJoints> pieces_{};
};

/// The best point of a coarse scan, motor by motor.
Variables scan_start(const HandProblem& problem, std::span<const MotorRange> ranges) noexcept {
  constexpr double kSpacing = 0.5;  // rad
  constexpr int kMostPoints = 24;
  Variables best(problem.size());
  for (Index i = 0; i < best.size(); ++i) {
    const auto& range = ranges[static_cast<std::size_t>(i)];
    best(i) = 0.5 * (range.lower_rad + range.upper_rad);
  }
  double least = problem.cost(best);
  for (Index i = 0; i < best.size(); ++i) {
    const auto& range = ranges[static_cast<std::size_t>(i)];
    const double width = range.upper_rad - range.lower_rad;
    const int points = std::clamp(static_cast<int>(std::ceil(width / kSpacing)), 1, kMostPoints);
    Variables x = best;
    for (int k = 0; k < points; ++k) {
      x(i) = range.lower_rad + width * (k + 0.5) / points;
      const double cost = problem.cost(x);
      if (!(cost < least)) continue;
      least = cost;
      best(i) = x(i);
    }
  }
  return best;
}

}  // namespace

MotorRange MotorRange::within(double lower, double upper) const noexcept {
  MotorRange out;
  out.lower_rad = std::clamp(lower, lower_rad, upper_rad);
  out.upper_rad = std::clamp(upper, out.lower_rad, upper_rad);
  for (const double kink : kinks_rad) {
    if (kink > out.lower_rad && kink < out.upper_rad) out.kinks_rad.push_back(kink);
  }
  return out;
}

HandSolution solve_own(HandProblem& problem, std::span<const MotorRange> ranges, const Variables& start,
                       const HandSolverOptions& options) noexcept {
  HandSolution solution;
  solution.x = start;
  for (Index i = 0; i < start.size(); ++i) {
    const auto& range = ranges[static_cast<std::size_t>(i)];
    solution.x(i) = std::clamp(start(i), range.lower_rad, range.upper_rad);
  }
  PieceWalk walk(problem, ranges, solution.x);
  math::LeastSquaresOptions inner;
  inner.gradient_tolerance = options.tolerance;
  const auto evaluate = [&problem](const Variables& x, HandProblem::Model& model) noexcept {
    problem.evaluate(x, model);
  };
  for (;; ++solution.iterations) {  // a crossing counts as one
    inner.max_iterations = options.max_iterations - solution.iterations;
    const auto found = math::minimize_in_box<Eigen::Dynamic, static_cast<int>(kMaxHandJoints)>(
        evaluate, solution.x, walk.lower, walk.upper, inner);
    solution.iterations += found.iterations;
    solution.valid = found.status != math::LeastSquaresStatus::kInvalid;
    if (!solution.valid) return solution;
    solution.x = found.x;
    solution.cost_m2 = found.cost;
    solution.optimality = found.optimality;
    solution.converged = found.converged();
    if (solution.iterations >= options.max_iterations || !walk.cross(solution.x, options.tolerance)) break;
  }
  return solution;
}

HandSolution solve_everywhere(HandProblem& problem, std::span<const MotorRange> ranges, Variables& start,
                              const HandSolverOptions& options) noexcept {
  std::array<MotorRange, kMaxHandJoints> part;
  std::copy(ranges.begin(), ranges.end(), part.begin());
  const auto kinked = std::find_if(ranges.begin(), ranges.end(), [](const auto& r) { return !r.kinks_rad.empty(); });
  const std::size_t pieces = kinked == ranges.end() ? 1 : kinked->kinks_rad.size() + 1;
  HandSolution best;
  for (std::size_t k = 0; k < pieces; ++k) {  // of the first motor that has kinks: they are rare
    const Piece piece{k};
    if (kinked != ranges.end()) {
      part[static_cast<std::size_t>(kinked - ranges.begin())] =
          kinked->within(piece.lower(*kinked), piece.upper(*kinked));
    }
    const std::span<const MotorRange> here{part.data(), ranges.size()};
    const Variables from = scan_start(problem, here);
    const HandSolution found = solve_own(problem, here, from, options);
    if (k > 0 && !(found.valid && found.cost_m2 < best.cost_m2)) continue;
    best = found;
    start = from;
  }
  return best;
}

}  // namespace embody
