#include "core/math/bounded_least_squares.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <nlopt.hpp>
#include <vector>

#include "tests/unit/math/random_values.hpp"

namespace embody::math {
namespace {

constexpr int kN = 6, kM = 9;
using Model = LeastSquaresModel<kN, kM>;
using Vector = Model::Variables;

// With costs and curvatures of order 10, a gradient below sqrt(4 eps 10 10) = 3e-7 no longer changes the cost's digits.
constexpr double kRounding = 1e-6;

// r_k(x) = a_k . x + sin(c_k . x) * s - b_k: curved, but for s << 1 with a single minimum in the box.
struct Problem {
  Eigen::Matrix<double, kM, kN> a, c;
  Eigen::Matrix<double, kM, 1> b;
  Vector lower, upper, start;
  double bend{0.0};
  bool with_curvature{false};

  Problem(test::RandomValues& random, double bend_in, bool curvature) : bend(bend_in), with_curvature(curvature) {
    for (int k = 0; k < kM; ++k) {
      a.row(k) = random.vector<kN>(-1.0, 1.0);
      c.row(k) = random.vector<kN>(-1.0, 1.0);
    }
    b = random.vector<kM>(-2.0, 2.0);
    lower = random.vector<kN>(-1.0, -0.1);
    upper = random.vector<kN>(0.1, 1.0);
    start = random.vector<kN>(-1.5, 1.5);
  }

  void operator()(const Vector& x, Model& at) const noexcept {
    const Eigen::Matrix<double, kM, 1> phase = c * x;
    for (int k = 0; k < kM; ++k) {
      at.r(k) = a.row(k).dot(x) + bend * std::sin(phase(k)) - b(k);
      at.J.row(k) = a.row(k) + bend * std::cos(phase(k)) * c.row(k);
      if (with_curvature) at.curvature -= at.r(k) * bend * std::sin(phase(k)) * c.row(k).transpose() * c.row(k);
    }
  }

  [[nodiscard]] double cost(const Vector& x) const {
    Model at;
    at.curvature.setZero();
    (*this)(x, at);
    return at.r.squaredNorm();
  }

  [[nodiscard]] LeastSquaresResult<Vector> solve(const LeastSquaresOptions& options = {}) const {
    return solve_bounded_least_squares<kN, kM>(*this, start, lower, upper, options);
  }
};

bool inside(const Problem& problem, const Vector& x) {
  return (x.array() >= problem.lower.array()).all() && (x.array() <= problem.upper.array()).all();
}

TEST(BoundedLeastSquares, NeverLeavesTheBoxAndNeverGoesUphillWhereverItIsCutOff) {
  test::RandomValues random(21);
  for (int i = 0; i < 300; ++i) {
    const Problem problem(random, /*bend=*/2.0, i % 2 == 0);
    double last = problem.cost(problem.start.cwiseMax(problem.lower).cwiseMin(problem.upper));
    for (int cap = 0; cap < 25; ++cap) {
      int evaluations = 0;
      const auto checked = [&](const Vector& x, Model& at) noexcept {
        ++evaluations;
        EXPECT_TRUE(inside(problem, x)) << "problem " << i;
        problem(x, at);
      };
      const auto result =
          solve_bounded_least_squares<kN, kM>(checked, problem.start, problem.lower, problem.upper, {cap, 1e-9});
      ASSERT_TRUE(inside(problem, result.x)) << "problem " << i;
      ASSERT_LE(result.iterations, cap);
      ASSERT_LE(evaluations, cap + 1);
      ASSERT_LE(result.cost, last) << "problem " << i << " cap " << cap;
      ASSERT_DOUBLE_EQ(result.cost, problem.cost(result.x));
      last = result.cost;
    }
  }
}

TEST(BoundedLeastSquares, MeetsTheFirstOrderConditionsWhenItSaysConverged) {
  test::RandomValues random(22);
  int at_bounds = 0;
  for (int i = 0; i < 2'000; ++i) {
    const Problem problem(random, /*bend=*/0.3 + 1.7 * (i % 2), i % 3 != 0);
    const auto result = problem.solve({200, 1e-9});
    ASSERT_TRUE(result.converged()) << "problem " << i;
    Model at;
    at.curvature.setZero();
    problem(result.x, at);
    const Vector g = at.J.transpose() * at.r;
    for (int k = 0; k < kN; ++k) {
      const bool low = result.x(k) == problem.lower(k), high = result.x(k) == problem.upper(k);
      at_bounds += low || high;
      if (low) {
        ASSERT_GE(g(k), -kRounding);
      } else if (high) {
        ASSERT_LE(g(k), kRounding);
      } else {
        ASSERT_NEAR(g(k), 0.0, kRounding) << "problem " << i;
      }
    }
  }
  EXPECT_GT(at_bounds, 1'000) << "the problems must exercise the bounds";
}

TEST(BoundedLeastSquares, AgreesWithNloptSlsqp) {
  test::RandomValues random(23);
  for (int i = 0; i < 300; ++i) {
    const Problem problem(random, /*bend=*/0.2, i % 2 == 0);
    const auto ours = problem.solve();
    ASSERT_TRUE(ours.converged());

    nlopt::opt reference(nlopt::LD_SLSQP, kN);
    const auto as_std = [](const Vector& v) { return std::vector<double>(v.data(), v.data() + kN); };
    reference.set_lower_bounds(as_std(problem.lower));
    reference.set_upper_bounds(as_std(problem.upper));
    reference.set_min_objective(
        [](unsigned, const double* x, double* gradient, void* data) {
          const auto& p = *static_cast<const Problem*>(data);
          Model at;
          at.curvature.setZero();
          p(Eigen::Map<const Vector>(x), at);
          if (gradient != nullptr) Eigen::Map<Vector>(gradient, kN) = 2.0 * at.J.transpose() * at.r;
          return at.r.squaredNorm();
        },
        const_cast<Problem*>(&problem));
    reference.set_xtol_rel(1e-12);
    reference.set_maxeval(500);
    std::vector<double> x = as_std(problem.start.cwiseMax(problem.lower).cwiseMin(problem.upper));
    double cost = 0.0;
    try {
      (void)reference.optimize(x, cost);
    } catch (const nlopt::roundoff_limited&) {  // it went as far as it could
    }
    cost = problem.cost(Eigen::Map<const Vector>(x.data()));
    ASSERT_LE(ours.cost, cost * (1.0 + 1e-9) + 1e-12) << "problem " << i;
    ASSERT_NEAR(ours.cost, cost, 1e-5 * (1.0 + cost)) << "problem " << i;
    ASSERT_LT((ours.x - Eigen::Map<const Vector>(x.data())).cwiseAbs().maxCoeff(), 1e-3) << "problem " << i;
  }
}

TEST(BoundedLeastSquares, StaysAtItsAnswerWhenStartedThere) {
  test::RandomValues random(24);
  for (int i = 0; i < 200; ++i) {
    Problem problem(random, 1.0, true);
    problem.start = problem.solve({200, 1e-9}).x;
    const auto again = problem.solve();
    ASSERT_LE(again.iterations, 1);
    ASSERT_LT((again.x - problem.start).cwiseAbs().maxCoeff(), 10.0 * kRounding) << "problem " << i;
  }
}

TEST(BoundedLeastSquares, FollowsASlowlyChangingProblemInFewIterationsWhenItKnowsTheCurvature) {
  test::RandomValues random(25);
  int newton = 0, gauss_newton = 0, most = 0;
  for (int i = 0; i < 300; ++i) {
    Problem problem(random, 1.0, true);
    problem.start = problem.solve({200, 1e-7}).x;
    problem.b += random.vector<kM>(-0.02, 0.02);
    const auto result = problem.solve({200, 1e-7});
    newton += result.iterations;
    most = std::max(most, result.iterations);
    problem.with_curvature = false;
    gauss_newton += problem.solve({200, 1e-7}).iterations;
  }
  EXPECT_LT(newton, 300 * 3) << "at most three on average";
  EXPECT_LT(most, 20);
  EXPECT_LT(2 * newton, gauss_newton);
}

TEST(BoundedLeastSquares, SolvesProblemsOfBoundedSizeToo) {
  test::RandomValues random(26);
  using Bounded = LeastSquaresModel<Eigen::Dynamic, Eigen::Dynamic, 8, 12>;
  for (int i = 0; i < 100; ++i) {
    const Problem problem(random, 0.5, true);
    const auto evaluate = [&](const Bounded::Variables& x, Bounded& at) noexcept {
      Model fixed;
      fixed.curvature.setZero();
      problem(x, fixed);
      at.r = fixed.r;
      at.J = fixed.J;
      at.curvature = fixed.curvature;
    };
    const auto bounded = solve_bounded_least_squares<Eigen::Dynamic, Eigen::Dynamic, 8, 12>(
        evaluate, problem.start, problem.lower, problem.upper);
    ASSERT_LT((bounded.x - problem.solve().x).cwiseAbs().maxCoeff(), kRounding) << "problem " << i;
  }
}

TEST(BoundedLeastSquares, KeepsVariablesWhoseBoundsCoincide) {
  test::RandomValues random(27);
  for (int i = 0; i < 200; ++i) {
    Problem problem(random, 1.0, true);
    problem.lower(2) = problem.upper(2) = 0.05;
    const auto result = problem.solve({200, 1e-9});
    ASSERT_TRUE(result.converged());
    ASSERT_EQ(result.x(2), 0.05);
  }
}

TEST(BoundedLeastSquares, IgnoresVariablesWithoutEffect) {
  test::RandomValues random(28);
  for (int i = 0; i < 200; ++i) {
    Problem problem(random, 1.0, true);
    problem.a.col(4).setZero();
    problem.c.col(4).setZero();
    problem.start(4) = 0.05;
    const auto result = problem.solve({200, 1e-9});
    ASSERT_TRUE(result.converged()) << "problem " << i;
    ASSERT_NEAR(result.x(4), 0.05, 1e-12);
  }
}

TEST(BoundedLeastSquares, ReportsAStartWithoutFiniteCost) {
  const auto broken = [](const Vector& x, Model& at) noexcept {
    at.r.setConstant(std::numeric_limits<double>::quiet_NaN());
    at.J.setConstant(x(0));
  };
  const Vector one = Vector::Ones();
  const auto result = solve_bounded_least_squares<kN, kM>(broken, Vector(3.0 * one), Vector(-one), one);
  EXPECT_EQ(result.status, LeastSquaresStatus::kInvalid);
  EXPECT_EQ(result.x, one);
}

TEST(BoundedLeastSquares, StepsOverRegionsWithoutFiniteCost) {
  // min (log x)^2 from x = 0.2: the full Newton step lands where the logarithm is undefined.
  const auto log_problem = [](const Eigen::Matrix<double, 1, 1>& x, LeastSquaresModel<1, 1>& at) noexcept {
    at.r(0) = std::log(x(0) - 0.1) - 1.0;
    at.J(0, 0) = 1.0 / (x(0) - 0.1);
  };
  Eigen::Matrix<double, 1, 1> start(9.0), lower(-10.0), upper(10.0);
  const auto result = solve_bounded_least_squares<1, 1>(log_problem, start, lower, upper, {100, 1e-12});
  EXPECT_TRUE(result.converged());
  EXPECT_NEAR(result.x(0), 0.1 + std::exp(1.0), 1e-9);
}

}  // namespace
}  // namespace embody::math
