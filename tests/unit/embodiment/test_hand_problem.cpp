// The objective of the embodiment mapping against finite differences, and what it is made of: distances of segments and
// couplings of joints.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <iostream>

#include "core/embodiment/embodiment_mapping.hpp"
#include "core/embodiment/mirror_config.hpp"
#include "core/embodiment/segments.hpp"
#include "core/robot/mirror.hpp"
#include "tests/unit/math/random_values.hpp"
#include "tests/unit/robot/hand_files.hpp"

namespace embody {
namespace {

using Eigen::Index;
using Eigen::Vector3d;
using robot::Coupling;
using Variables = HandProblem::Variables;
using Square = HandProblem::Model::Square;

test::RandomValues seeded(std::uint64_t seed) {
  std::cout << "seed " << seed << "\n";
  return test::RandomValues(seed);
}

struct Hand {
  robot::RobotModel model;
  EmbodimentConfig config;
  EmbodimentMapping mapping;
  HandProblem::Chains chains;
  FingerSet fingers;
};

Hand make(const std::string& name, bool mirror) {
  robot::RobotModel model = test::hand_model(name);
  EmbodimentConfig config = test::hand_config(name);
  config.thumb_mode = ThumbMode::kAutomatic;  // the whole range of every motor
  if (mirror) {
    model = robot::mirrored(model);
    config = mirrored(config);
  }
  auto mapping = EmbodimentMapping::create(model, config);
  if (!mapping) throw std::runtime_error(name + ": " + mapping.error().detail.c_str());
  Hand hand{model, config, std::move(*mapping), {}, {}};
  for (std::size_t f = 0; f < kFingers; ++f) {
    if (config.fingers[f].link.empty()) continue;
    hand.fingers.set(f);
    hand.chains[f] = *RobotFinger::create(hand.mapping.kinematics(), config.fingers[f]);
  }
  return hand;
}

/// visit(hand) for the four hands and their mirror images.
template <class Visit>
void for_all_hands(const Visit& visit) {
  for (const bool mirror : {false, true}) {
    for (const char* name : test::kHandFiles) {
      SCOPED_TRACE(std::string(name) + (mirror ? ", mirrored" : ""));
      visit(make(name, mirror));
      if (testing::Test::HasFatalFailure()) return;
    }
  }
}

/// Motors within their ranges and 1e-3 rad away from the kinks.
std::vector<double> random_motors(const Hand& hand, test::RandomValues& random) {
  std::vector<double> r;
  for (std::size_t m = 0; m < hand.mapping.motor_count(); ++m) {
    for (bool kink = true; kink;) {
      r.resize(m);
      r.push_back(random(hand.mapping.lower_rad(m) + 1e-3, hand.mapping.upper_rad(m) - 1e-3));
      kink = false;
      for (const JointCoupling& coupling : hand.config.couplings) {
        if (coupling.motor != hand.config.motors[m]) continue;
        for (const double knot : coupling.motor_rad) kink = kink || std::abs(knot - r[m]) < 1e-3;
      }
    }
  }
  return r;
}

constexpr unsigned kOrientation = 1, kPinch = 2, kCollision = 4, kStay = 8, kEverything = 15;

HandWeights weights_of(unsigned options) {
  HandWeights weights;
  if ((options & kOrientation) != 0) weights.orientation_m = 0.02;
  if ((options & kCollision) != 0) weights.collision_m = 0.05;  // wide, so that many pairs count
  return weights;
}

/// Points up to 3 cm from the robot's own at some other motor angles.
HandGoal random_goal(const Hand& hand, unsigned options, test::RandomValues& random) {
  HandGoal goal;
  const auto own_P = hand.mapping.finger_points(random_motors(hand, random));
  for (std::size_t f = 0; f < kFingers; ++f) {
    if (!hand.fingers[f]) continue;
    for (std::size_t i = 0; i < 2; ++i) goal.points_P[f][i] = own_P[f][i] + random.vector<3>(-0.03, 0.03);
    goal.directions_P[f] = random.rotation(3.0).normalized();
    if ((options & kPinch) == 0 || f == 0 || random(0.0, 1.0) < 0.3) continue;
    goal.pinch_gap_m[f] = random(0.0, 0.02);
    goal.pinch_weight[f] = random(0.0, 30.0);
  }
  for (std::size_t m = 0; m < hand.mapping.motor_count(); ++m) {
    goal.last_rad[m] = random(hand.mapping.lower_rad(m), hand.mapping.upper_rad(m));
    if ((options & kStay) != 0) goal.stay_m_rad[m] = random(0.0, 0.05);
  }
  return goal;
}

FingerSet random_fingers(const Hand& hand, test::RandomValues& random) {
  FingerSet fingers = hand.fingers;
  for (std::size_t f = 0; f < kFingers; ++f) {
    if (random(0.0, 1.0) < 0.25) fingers.reset(f);
  }
  return fingers.any() ? fingers : hand.fingers;
}

/// Variables of the problem at motors `r`, in whose pieces it then works.
Variables enter(HandProblem& problem, const std::vector<double>& r) {
  Variables x(problem.size());
  for (Index i = 0; i < x.size(); ++i) {
    const std::size_t motor = problem.motors()[static_cast<std::size_t>(i)];
    x(i) = r[motor];
    problem.set_piece(motor, r[motor]);
  }
  return x;
}

template <class Function>
auto central_difference(const Function& f, Variables x, Index i, double h) {
  const double at = x(i);
  x(i) = at + h;
  const auto above = f(x);
  x(i) = at - h;
  return ((above - f(x)) / (2.0 * h));
}

/// Distance of the nearest two tip axes, m: the gap has no derivative where they meet.
double least_axis_distance_m(const Hand& hand, const std::vector<double>& r) {
  double least = 1.0;
  for (std::size_t a = 0; a < kFingers; ++a) {
    for (std::size_t b = a + 1; b < kFingers; ++b) {
      if (!hand.fingers[a] || !hand.fingers[b]) continue;
      const double gap_m = hand.mapping.pad_gap_m(static_cast<Finger>(a), static_cast<Finger>(b), r);
      least = std::min(least, gap_m + hand.chains[a]->pad_radius_m() + hand.chains[b]->pad_radius_m());
    }
  }
  return least;
}

TEST(HandProblem, HasTheGradientOfItsCostWithAndWithoutTheAdditions) {
  test::RandomValues random = seeded(11);
  for_all_hands([&](const Hand& hand) {
    int tested = 0;
    for (unsigned options = 0; options <= kEverything; ++options) {
      const HandWeights weights = weights_of(options);
      for (int n = 0; n < 12; ++n) {
        const HandGoal goal = random_goal(hand, options, random);
        const std::vector<double> r = random_motors(hand, random);
        if (least_axis_distance_m(hand, r) < 2e-3) continue;
        ++tested;
        HandProblem problem(hand.chains, goal, weights, random_fingers(hand, random));
        const Variables x = enter(problem, r);
        HandProblem::Model model;
        problem.evaluate(x, model);
        ASSERT_NEAR(model.cost, problem.cost(x), 1e-13 * model.cost) << "options " << options;
        const double scale = model.gradient.cwiseAbs().maxCoeff() + 1e-3 * model.cost + 1e-6;
        for (Index i = 0; i < x.size(); ++i) {
          const double expected =
              central_difference([&](const Variables& y) { return 0.5 * problem.cost(y); }, x, i, 1e-6);
          ASSERT_NEAR(model.gradient(i), expected, 1e-6 * scale) << "options " << options << ", variable " << i;
        }
      }
    }
    EXPECT_GE(tested, 150) << "of 192";
  });
}

TEST(HandProblem, HasTheSecondDerivativesOfEverythingButTheGaps) {
  test::RandomValues random = seeded(12);
  for_all_hands([&](const Hand& hand) {
    for (const unsigned options : {0U, kOrientation, kStay, kOrientation | kStay}) {
      const HandWeights weights = weights_of(options);
      for (int n = 0; n < 12; ++n) {
        const HandGoal goal = random_goal(hand, options, random);
        HandProblem problem(hand.chains, goal, weights, random_fingers(hand, random));
        const Variables x = enter(problem, random_motors(hand, random));
        HandProblem::Model model;
        problem.evaluate(x, model);
        const Square hessian = model.gauss_newton + model.curvature;
        const auto gradient = [&](const Variables& y) {
          HandProblem::Model other;
          problem.evaluate(y, other);
          return other.gradient;
        };
        for (Index i = 0; i < x.size(); ++i) {
          const Variables column = central_difference(gradient, x, i, 1e-6);
          ASSERT_LE((hessian.col(i) - column).cwiseAbs().maxCoeff(), 1e-6 * hessian.cwiseAbs().maxCoeff())
              << "options " << options << ", variable " << i;
        }
        ASSERT_EQ(hessian, Square(hessian.transpose()));
        const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(model.gauss_newton);
        ASSERT_GE(eigen.eigenvalues().minCoeff(), -1e-12 * eigen.eigenvalues().maxCoeff());
      }
    }
  });
}

TEST(HandProblem, AddsTheSquaredSlopesOfTheGapsAndNoCurvature) {
  test::RandomValues random = seeded(13);
  for_all_hands([&](const Hand& hand) {
    int gaps = 0;
    for (int n = 0; n < 30; ++n) {
      const HandWeights weights = weights_of(kCollision), none;
      const HandGoal goal = random_goal(hand, kPinch, random);
      HandGoal unpinched = goal;
      unpinched.pinch_weight.fill(0.0);
      std::vector<double> r = random_motors(hand, random);
      if (least_axis_distance_m(hand, r) < 2e-3) continue;
      HandProblem with(hand.chains, goal, weights, hand.fingers), without(hand.chains, unpinched, none, hand.fingers);
      const Variables x = enter(with, r);
      enter(without, r);
      HandProblem::Model more, less;
      with.evaluate(x, more);
      without.evaluate(x, less);
      ASSERT_EQ(more.curvature, less.curvature);
      Square expected = Square::Zero(x.size(), x.size());
      for (std::size_t a = 0; a < kFingers; ++a) {
        for (std::size_t b = a + 1; b < kFingers; ++b) {
          if (!hand.fingers[a] || !hand.fingers[b]) continue;
          const auto gap_m = [&](const Variables& y) {
            for (Index i = 0; i < y.size(); ++i) r[with.motors()[static_cast<std::size_t>(i)]] = y(i);
            return hand.mapping.pad_gap_m(static_cast<Finger>(a), static_cast<Finger>(b), r);
          };
          double weight = a == 0 ? goal.pinch_weight[b] : 0.0;
          if (!(weight > 0.0) && gap_m(x) < weights.collision_m) weight = weights.collision_weight;
          gaps += weight > 0.0 ? 1 : 0;
          Variables slope(x.size());
          for (Index i = 0; i < x.size(); ++i) slope(i) = weight * central_difference(gap_m, x, i, 1e-6);
          expected += slope * slope.transpose();
        }
      }
      const Square added = more.gauss_newton - less.gauss_newton;
      ASSERT_LE((added - expected).cwiseAbs().maxCoeff(), 1e-6 * (1.0 + expected.cwiseAbs().maxCoeff())) << n;
    }
    EXPECT_GE(gaps, 5) << "nothing was tested";
  });
}

TEST(HandProblem, TakesTheSlopesOfThePieceThatItIsTold) {
  test::RandomValues random = seeded(14);
  for_all_hands([&](const Hand& hand) {
    for (const JointCoupling& coupling : hand.config.couplings) {
      const auto at = std::find(hand.config.motors.begin(), hand.config.motors.end(), coupling.motor);
      const auto motor = static_cast<std::size_t>(at - hand.config.motors.begin());
      for (const double knot : coupling.motor_rad) {
        if (knot - 0.01 < hand.mapping.lower_rad(motor) || knot + 0.01 > hand.mapping.upper_rad(motor)) continue;
        const HandGoal goal = random_goal(hand, kEverything, random);
        const HandWeights weights = weights_of(kOrientation);
        HandProblem problem(hand.chains, goal, weights, hand.fingers);
        std::vector<double> r = random_motors(hand, random);
        r[motor] = knot;
        Variables x = enter(problem, r);
        const auto i = std::find(problem.motors().begin(), problem.motors().end(), motor) - problem.motors().begin();
        for (const double h : {-1e-5, 1e-5}) {  // both sides, to second order
          problem.set_piece(motor, knot + 100.0 * h);
          HandProblem::Model model;
          problem.evaluate(x, model);
          const auto half_cost = [&](double change) {
            Variables y = x;
            y(i) += change;
            return 0.5 * problem.cost(y);
          };
          const double expected = (-3.0 * half_cost(0.0) + 4.0 * half_cost(h) - half_cost(2.0 * h)) / (2.0 * h);
          ASSERT_NEAR(model.gradient(i), expected, 1e-6 * (1e-3 + std::abs(expected) + model.cost))
              << coupling.motor << " at " << knot << (h < 0.0 ? " from below" : " from above");
        }
      }
    }
  });
}

TEST(HandProblem, ServesTheMirrorImageOfAHandAtTheSameMotorAngles) {
  test::RandomValues random = seeded(15);
  for (const char* name : test::kHandFiles) {
    const Hand right = make(name, false), left = make(name, true);
    const HandWeights weights = weights_of(kEverything);
    for (int n = 0; n < 20; ++n) {
      const HandGoal goal = random_goal(right, kEverything, random);
      HandGoal image = goal;
      for (std::size_t f = 0; f < kFingers; ++f) {
        for (Vector3d& p_P : image.points_P[f]) p_P.x() *= -1.0;
        image.directions_P[f].x() *= -1.0;
      }
      HandProblem one(right.chains, goal, weights, right.fingers), other(left.chains, image, weights, left.fingers);
      const Variables x = enter(one, random_motors(right, random));
      ASSERT_NEAR(one.cost(x), other.cost(x), 1e-12 * one.cost(x)) << name;
    }
  }
}

TEST(RobotFinger, AgreesWithForwardKinematicsWrittenAnew) {
  test::RandomValues random = seeded(16);
  for_all_hands([&](const Hand& hand) {
    for (int n = 0; n < 20; ++n) {
      const std::vector<double> r = random_motors(hand, random);
      const std::vector<double> q = test::motor_angles(hand.model, hand.config, r);
      const auto p_P = hand.mapping.finger_points(r);
      std::array<std::array<Vector3d, 2>, kFingers> pads_P;
      for (std::size_t f = 0; f < kFingers; ++f) {
        if (!hand.fingers[f]) continue;
        const FingerPoints& points = hand.config.fingers[f];
        const std::string& middle = points.middle_link.empty() ? points.link : points.middle_link;
        ASSERT_LE((p_P[f][0] - test::point_P(hand.model, q, points.link, points.tip_m)).norm(), 1e-12);
        ASSERT_LE((p_P[f][1] - test::point_P(hand.model, q, middle, points.middle_m)).norm(), 1e-12);
        const ContactPad& pad = points.pads.front();
        pads_P[f] = {test::point_P(hand.model, q, pad.link, pad.from_m),
                     test::point_P(hand.model, q, pad.link, pad.to_m)};
        for (std::size_t g = 0; g < f; ++g) {
          if (!hand.fingers[g]) continue;
          const NearestPoints near = nearest_points(pads_P[f][0], pads_P[f][1], pads_P[g][0], pads_P[g][1]);
          const double gap_m =
              (near.on_a - near.on_b).norm() - pad.radius_m - hand.config.fingers[g].pads.front().radius_m;
          ASSERT_NEAR(hand.mapping.pad_gap_m(static_cast<Finger>(f), static_cast<Finger>(g), r), gap_m, 1e-12);
          ASSERT_NEAR(hand.mapping.pad_gap_m(static_cast<Finger>(g), static_cast<Finger>(f), r), gap_m, 1e-12);
        }
      }
    }
  });
}

struct Segments {
  Vector3d a0, a1, b0, b1;
};

/// The least distance on a grid of both parameters that zooms in on its best point: never below the true one.
double sampled_distance(const Segments& s) {
  double low_s = 0.0, low_t = 0.0, width = 1.0, least = INFINITY;
  for (int zoom = 0; zoom < 14; ++zoom) {
    double best_s = 0.0, best_t = 0.0;
    least = INFINITY;
    for (int i = 0; i <= 20; ++i) {
      for (int k = 0; k <= 20; ++k) {
        const double at_s = low_s + i / 20.0 * width, at_t = low_t + k / 20.0 * width;
        const double distance = (s.a0 + at_s * (s.a1 - s.a0) - s.b0 - at_t * (s.b1 - s.b0)).norm();
        if (!(distance < least)) continue;
        least = distance;
        best_s = at_s;
        best_t = at_t;
      }
    }
    width *= 0.3;
    low_s = std::clamp(best_s - 0.5 * width, 0.0, 1.0 - width);
    low_t = std::clamp(best_t - 0.5 * width, 0.0, 1.0 - width);
  }
  return least;
}

/// How far a point is from a segment.
double distance_to_segment(const Vector3d& p, const Vector3d& a0, const Vector3d& a1) {
  const Vector3d u = a1 - a0;
  const double s = u.squaredNorm() > 0.0 ? std::clamp(u.dot(p - a0) / u.squaredNorm(), 0.0, 1.0) : 0.0;
  return (a0 + s * u - p).norm();
}

void expect_nearest(const Segments& s, double tolerance, const char* kind) {
  const NearestPoints near = nearest_points(s.a0, s.a1, s.b0, s.b1);
  ASSERT_LE(distance_to_segment(near.on_a, s.a0, s.a1), 1e-15) << kind;
  ASSERT_LE(distance_to_segment(near.on_b, s.b0, s.b1), 1e-15) << kind;
  ASSERT_LE((near.on_a - near.on_b).norm(), sampled_distance(s) + tolerance) << kind;
  const NearestPoints swapped = nearest_points(s.b1, s.b0, s.a0, s.a1);
  ASSERT_NEAR((swapped.on_a - swapped.on_b).norm(), (near.on_a - near.on_b).norm(), 2.0 * tolerance) << kind;
}

TEST(NearestPoints, AreNoFartherApartThanAnyOtherPointsOfTheSegments) {
  test::RandomValues random = seeded(17);
  for (int n = 0; n < 300; ++n) {
    const auto point = [&] { return random.vector<3>(-0.05, 0.05); };
    const Segments s{point(), point(), point(), point()};
    expect_nearest(s, 1e-9, "any");
    expect_nearest({s.a0, s.a0, s.b0, s.b1}, 1e-9, "point and segment");
    expect_nearest({s.a0, s.a1, s.b0, s.b0}, 1e-9, "segment and point");
    expect_nearest({s.a0, s.a0, s.b0, s.b0}, 1e-15, "two points");
    expect_nearest({s.a0, s.a1, s.a0 + s.b0, s.a0 + s.b0 + random(-2.0, 2.0) * (s.a1 - s.a0)}, 1e-9, "parallel");
    const auto along = [&] { return Vector3d(s.a0 + random(-1.0, 2.0) * (s.a1 - s.a0)); };
    expect_nearest({s.a0, s.a1, along(), along()}, 1e-9, "on one line");
    const Vector3d crossing = s.a0 + random(0.0, 1.0) * (s.a1 - s.a0);
    expect_nearest({s.a0, s.a1, crossing - s.b0, crossing + s.b0}, 1e-9, "crossing");
    expect_nearest({s.a0, s.a1, s.a1, s.b1}, 1e-12, "with an end in common");
    expect_nearest({s.a0, s.a1, s.a0, s.a1}, 1e-15, "the same twice");
    // Below 3.2e-5 rad segments are taken for parallel: that costs the angle times the length at most.
    const double lost_m = 3.2e-5 * (s.a1 - s.a0).norm();
    for (const double angle : {1e-3, 1e-4, 1e-5, 1e-7, 1e-9}) {
      const Vector3d b0 = s.a0 + 0.1 * s.b0, b1 = b0 + s.a1 - s.a0 + angle * s.b1;
      expect_nearest({s.a0, s.a1, b0, b1}, 1e-9 + lost_m, "nearly parallel");
    }
  }
}

/// Knots of a random piecewise linear function.
Coupling random_coupling(test::RandomValues& random) {
  Coupling coupling;
  coupling.motor = 0;
  const auto count = static_cast<std::size_t>(random(2.0, robot::kMaxKnots + 1.0));
  double motor = random(-3.0, 0.0);
  for (std::size_t i = 0; i < count; ++i, motor += random(0.1, 1.0)) {
    coupling.knots.push_back({motor, random(-2.0, 2.0)});
  }
  return coupling;
}

TEST(Coupling, IsContinuousPassesThroughItsKnotsAndIsConstantBeyondThem) {
  test::RandomValues random = seeded(18);
  for (int n = 0; n < 200; ++n) {
    const Coupling coupling = random_coupling(random);
    const robot::Knot first = coupling.knots[0], last = coupling.knots[coupling.knots.size() - 1];
    for (const robot::Knot& knot : coupling.knots) {
      EXPECT_NEAR(coupling.value(knot.motor), knot.joint, 1e-15);
      for (const double h : {-1e-9, 1e-9}) EXPECT_NEAR(coupling.value(knot.motor + h), knot.joint, 1e-7);
    }
    for (const double beyond : {1e-9, 0.5, 1e9}) {
      EXPECT_EQ(coupling.value(first.motor - beyond), first.joint);
      EXPECT_EQ(coupling.value(last.motor + beyond), last.joint);
      EXPECT_EQ(coupling.slope(first.motor - beyond), 0.0);
      EXPECT_EQ(coupling.slope(last.motor + beyond), 0.0);
    }
  }
}

TEST(Coupling, HasTheSlopeOfItsValueInEveryPiece) {
  test::RandomValues random = seeded(19);
  for (int n = 0; n < 200; ++n) {
    const Coupling coupling = random_coupling(random);
    for (std::size_t i = 1; i < coupling.knots.size(); ++i) {
      const double low = coupling.knots[i - 1].motor, high = coupling.knots[i].motor;
      const double r = random(low + 1e-3, high - 1e-3);
      EXPECT_NEAR(coupling.slope(r), (coupling.value(r + 1e-4) - coupling.value(r - 1e-4)) / 2e-4, 1e-9);
      EXPECT_EQ(coupling.slope(r), coupling.slope(low)) << "a knot belongs to the piece above it";
    }
  }
}

TEST(Coupling, OfAMimicJointIsTheScaledOneOfTheJointThatItMimics) {
  test::RandomValues random = seeded(20);
  Coupling fixed, linear;
  fixed.offset = 0.3;
  linear.motor = 2;
  linear.multiplier = -0.7;
  linear.offset = 0.1;
  for (int n = 0; n < 100; ++n) {
    const double m = random(-2.0, 2.0), b = random(-1.0, 1.0);
    for (const Coupling& coupling : {fixed, linear, random_coupling(random)}) {
      const Coupling scaled = coupling.scaled(m, b);
      EXPECT_EQ(scaled.motor, coupling.motor);
      for (int k = 0; k < 20; ++k) {
        const double r = random(-4.0, 6.0);
        EXPECT_NEAR(scaled.value(r), m * coupling.value(r) + b, 1e-13);
        EXPECT_NEAR(scaled.slope(r), m * coupling.slope(r), 1e-12);
      }
    }
  }
}

}  // namespace
}  // namespace embody
