#include "core/robot/ur_kinematics.hpp"

#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace embody::robot {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;
constexpr double kCosineSlack = 1e-9;     // beyond +-1, still taken for the border of the workspace
constexpr double kSingularWrist = 1e-10;  // |sin(q5)| below which joint 6 cannot be observed

/// X_B0 .. X_B6 of the standard Denavit-Hartenberg convention: X = Rz(q) Tz(d) Tx(a) Rx(alpha).
std::array<Pose, 7> joint_frames(const Vector6& q_rad, const UrGeometry& g) noexcept {
  const std::array<double, 6> d{g.d1_m, 0.0, 0.0, g.d4_m, g.d5_m, g.d6_m};
  const std::array<double, 6> a{0.0, g.a2_m, g.a3_m, 0.0, 0.0, 0.0};
  const std::array<double, 6> sin_alpha{1.0, 0.0, 0.0, 1.0, -1.0, 0.0};
  std::array<Pose, 7> X_B;
  X_B[0] = Pose::Identity();
  for (std::size_t i = 0; i < 6; ++i) {
    const double s = std::sin(q_rad[static_cast<int>(i)]), c = std::cos(q_rad[static_cast<int>(i)]);
    const double sa = sin_alpha[i], ca = sa == 0.0 ? 1.0 : 0.0;
    Pose X = Pose::Identity();
    X.linear() << c, -s * ca, s * sa, s, c * ca, -c * sa, 0.0, sa, ca;
    X.translation() << a[i] * c, a[i] * s, d[i];
    X_B[i + 1] = X_B[i] * X;
  }
  return X_B;
}

/// Same angle in [-pi, pi].
double wrap(double angle_rad) noexcept {
  return std::remainder(angle_rad, kTurn);
}

/// Arc cosine that forgives rounding at the border; NaN beyond.
double border_acos(double cosine) noexcept {
  if (std::abs(cosine) > 1.0 + kCosineSlack) return std::numeric_limits<double>::quiet_NaN();
  return std::acos(std::fmin(1.0, std::fmax(-1.0, cosine)));
}

/// Both elbow solutions of the planar arm (joints 2 to 4) for the wrist point `P` and the sum q2+q3+q4 = `q234`.
void push_elbow_solutions(const Eigen::Vector2d& P, double q234, double q1, double q5, double q6, const UrGeometry& g,
                          UrSolutions& solutions) noexcept {
  const double cos_3 = (P.squaredNorm() - g.a2_m * g.a2_m - g.a3_m * g.a3_m) / (2.0 * g.a2_m * g.a3_m);
  const double elbow = border_acos(cos_3);
  if (std::isnan(elbow)) return;
  for (const double q3 : {elbow, -elbow}) {
    const double q2 = std::atan2(P.y(), P.x()) - std::atan2(g.a3_m * std::sin(q3), g.a2_m + g.a3_m * std::cos(q3));
    Vector6 q;
    q << wrap(q1), wrap(q2), q3, wrap(q234 - q2 - q3), q5, wrap(q6);
    solutions.push_back(q);
    if (elbow == 0.0) return;  // stretched: both are one
  }
}

/// Nearest copy of `angle_rad` to `near_rad` inside [lower, upper]; NaN when no copy is inside.
double nearest_copy(double angle_rad, double near_rad, double lower_rad, double upper_rad) noexcept {
  double q = near_rad + std::remainder(angle_rad - near_rad, kTurn);
  if (q > upper_rad) q -= kTurn * std::ceil((q - upper_rad) / kTurn);
  if (q < lower_rad) q += kTurn * std::ceil((lower_rad - q) / kTurn);
  return q <= upper_rad ? q : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace

Pose forward_kinematics(const Vector6& q_rad, const UrGeometry& geometry) noexcept {
  return joint_frames(q_rad, geometry)[6];
}

UrSolutions inverse_kinematics(const Pose& X_BE, double q6_near_rad, const UrGeometry& g) noexcept {
  UrSolutions solutions;
  if (!math::is_valid(X_BE) || !std::isfinite(q6_near_rad)) return solutions;
  const Eigen::Matrix3d R_BE = X_BE.linear();
  const Eigen::Vector3d p_B5 = X_BE.translation() - g.d6_m * R_BE.col(2);
  // The wrist centre lies d4 beside the plane of the arm: two shoulders, none inside the shoulder cylinder.
  const double shoulder = border_acos(g.d4_m / std::hypot(p_B5.x(), p_B5.y()));
  if (std::isnan(shoulder)) return solutions;
  for (const double side : {shoulder, -shoulder}) {
    const double q1 = std::atan2(p_B5.y(), p_B5.x()) + side + std::numbers::pi / 2.0;
    const double s1 = std::sin(q1), c1 = std::cos(q1);
    Eigen::Matrix3d R_B1;
    R_B1 << c1, 0.0, s1, s1, 0.0, -c1, 0.0, 1.0, 0.0;
    const Eigen::Matrix3d R_1E = R_B1.transpose() * R_BE;
    const Eigen::Vector3d p_15 = R_B1.transpose() * (p_B5 - Eigen::Vector3d(0.0, 0.0, g.d1_m));
    // Last row of R_1E is (s5 c6, -s5 s6, c5); atan2 instead of acos keeps q5 exact near 0 and pi.
    const double abs_s5 = std::hypot(R_1E(2, 0), R_1E(2, 1));
    const bool singular = abs_s5 < kSingularWrist;
    for (const double sign : {1.0, -1.0}) {
      const double q5 = singular ? (R_1E(2, 2) > 0.0 ? 0.0 : std::numbers::pi) : std::atan2(sign * abs_s5, R_1E(2, 2));
      const double q6 = singular ? q6_near_rad : std::atan2(-sign * R_1E(2, 1), sign * R_1E(2, 0));
      const double s5 = std::sin(q5), c5 = std::cos(q5), s6 = std::sin(q6), c6 = std::cos(q6);
      const Eigen::Vector3d x_14 = R_1E * Eigen::Vector3d(c5 * c6, -c5 * s6, -s5);  // (c234, s234, 0)
      const double q234 = std::atan2(x_14.y(), x_14.x());
      const Eigen::Vector2d P = p_15.head<2>() - g.d5_m * Eigen::Vector2d(std::sin(q234), -std::cos(q234));
      push_elbow_solutions(P, q234, q1, q5, q6, g, solutions);
      if (singular) break;  // both signs are one
    }
    if (shoulder == 0.0) break;
  }
  return solutions;
}

Result<Vector6> solve_nearest(const Pose& X_BE, const Vector6& q_near_rad, const UrJointRange& range,
                              const UrGeometry& geometry) noexcept {
  if (!math::is_valid(X_BE) || !q_near_rad.allFinite()) {
    return Error{Errc::kInvalidArgument, "inverse kinematics: the flange pose or the joint angles are not finite"};
  }
  const UrSolutions solutions = inverse_kinematics(X_BE, q_near_rad[5], geometry);
  if (solutions.empty()) {
    return Error{Errc::kNotFound, "inverse kinematics: the flange pose is out of the arm's reach"};
  }
  double best_cost = std::numeric_limits<double>::infinity();
  Vector6 best = q_near_rad;
  for (const Vector6& solution : solutions) {
    Vector6 q;
    for (int i = 0; i < 6; ++i) {
      q[i] = nearest_copy(solution[i], q_near_rad[i], range.lower_rad[i], range.upper_rad[i]);
    }
    const double cost = (range.weights.array() * (q - q_near_rad).array().square()).sum();
    if (cost < best_cost) {  // false for NaN: a joint without a copy inside its limits
      best_cost = cost;
      best = q;
    }
  }
  if (!std::isfinite(best_cost)) {
    return Error{Errc::kNotFound, "inverse kinematics: every solution for the flange pose breaks a joint limit"};
  }
  return best;
}

Matrix6 jacobian(const Vector6& q_rad, const UrGeometry& geometry) noexcept {
  const std::array<Pose, 7> X_B = joint_frames(q_rad, geometry);
  Matrix6 J;
  for (int i = 0; i < 6; ++i) {
    const Pose& X_Bi = X_B[static_cast<std::size_t>(i)];
    const Eigen::Vector3d axis = X_Bi.linear().col(2);
    J.col(i).head<3>() = axis.cross(X_B[6].translation() - X_Bi.translation());
    J.col(i).tail<3>() = axis;
  }
  return J;
}

double manipulability(const Vector6& q_rad, const UrGeometry& g) noexcept {
  const double q23 = q_rad[1] + q_rad[2], q234 = q23 + q_rad[3];
  return std::abs(std::sin(q_rad[2]) * std::sin(q_rad[4]) * g.a2_m * g.a3_m *
                  (g.a2_m * std::cos(q_rad[1]) + g.a3_m * std::cos(q23) + g.d5_m * std::sin(q234)));
}

}  // namespace embody::robot
