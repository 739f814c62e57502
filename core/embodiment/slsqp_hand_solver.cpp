// The reference solver of the embodiment mapping. The only file of it that knows NLopt.
#include <nlopt.h>

#include <algorithm>
#include <vector>

#include "core/embodiment/hand_solver.hpp"

namespace embody {
namespace {

using Eigen::Index;
using Variables = HandProblem::Variables;

/// NLopt's view of a problem: value, and the gradient if wanted. Slopes of couplings are those at x.
double value(unsigned n, const double* x, double* gradient, void* data) {
  auto& problem = *static_cast<HandProblem*>(data);
  const Variables at = Eigen::Map<const Eigen::VectorXd>(x, static_cast<Index>(n));
  for (unsigned i = 0; i < n; ++i) problem.set_piece(problem.motors()[i], x[i]);
  if (gradient == nullptr) return problem.cost(at);
  HandProblem::Model model;
  problem.evaluate(at, model);
  for (unsigned i = 0; i < n; ++i) gradient[i] = 2.0 * model.gradient(static_cast<Index>(i));
  return model.cost;
}

}  // namespace

HandSolution solve_slsqp(HandProblem& problem, std::span<const MotorRange> ranges, const Variables& start,
                         int max_evaluations, double ftol) {
  const auto n = static_cast<unsigned>(problem.size());
  std::vector<double> lower(n), upper(n), x(n);
  for (unsigned i = 0; i < n; ++i) {
    lower[i] = ranges[i].lower_rad;
    upper[i] = ranges[i].upper_rad;
    x[i] = std::clamp(start(static_cast<Index>(i)), lower[i], upper[i]);
  }
  nlopt_opt optimizer = nlopt_create(NLOPT_LD_SLSQP, n);
  nlopt_set_lower_bounds(optimizer, lower.data());
  nlopt_set_upper_bounds(optimizer, upper.data());
  nlopt_set_min_objective(optimizer, value, &problem);
  nlopt_set_ftol_rel(optimizer, ftol);
  nlopt_set_xtol_rel(optimizer, ftol);
  nlopt_set_maxeval(optimizer, max_evaluations);
  double cost = 0.0;
  const nlopt_result status = nlopt_optimize(optimizer, x.data(), &cost);
  HandSolution solution;
  solution.iterations = nlopt_get_numevals(optimizer);
  nlopt_destroy(optimizer);
  solution.x = Eigen::Map<const Eigen::VectorXd>(x.data(), static_cast<Index>(n));
  solution.cost_m2 = problem.cost(solution.x);
  solution.converged = status > 0 && status != NLOPT_MAXEVAL_REACHED;
  solution.valid = std::isfinite(solution.cost_m2);
  return solution;
}

}  // namespace embody
