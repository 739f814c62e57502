#pragma once
// How a joint of a hand follows a motor: not at all, linearly, or piecewise linearly. Tendons that close one joint
// after the other, cranks and mimic joints are all of this kind.
#include <algorithm>

#include "core/base/static_vector.hpp"
#include "core/robot/urdf_model.hpp"

namespace embody::robot {

inline constexpr std::size_t kMaxKnots = 8;

struct Knot {
  double motor{0.0};
  double joint{0.0};
};

/// q = f(r[motor]): constant without a motor, linear without knots, else linear between knots and constant beyond them.
struct Coupling {
  std::size_t motor{kNoIndex};
  double multiplier{0.0};
  double offset{0.0};
  StaticVector<Knot, kMaxKnots> knots;  ///< by increasing motor coordinate

  [[nodiscard]] double value(double r) const noexcept {
    if (knots.empty()) return motor == kNoIndex ? offset : multiplier * r + offset;
    if (r <= knots[0].motor) return knots[0].joint;
    for (std::size_t i = 1; i < knots.size(); ++i) {
      if (r > knots[i].motor) continue;
      const double share = (r - knots[i - 1].motor) / (knots[i].motor - knots[i - 1].motor);
      return knots[i - 1].joint + share * (knots[i].joint - knots[i - 1].joint);
    }
    return knots[knots.size() - 1].joint;
  }

  /// dq/dr of the piece that `r` lies in.
  [[nodiscard]] double slope(double r) const noexcept {
    if (knots.empty()) return motor == kNoIndex ? 0.0 : multiplier;
    for (std::size_t i = 1; i < knots.size(); ++i) {
      if (r < knots[i - 1].motor) break;
      if (r < knots[i].motor) {
        return (knots[i].joint - knots[i - 1].joint) / (knots[i].motor - knots[i - 1].motor);
      }
    }
    return 0.0;
  }

  /// Of a joint that mimics this one: m f(r) + b.
  [[nodiscard]] Coupling scaled(double m, double b) const noexcept {
    Coupling out = *this;
    out.multiplier *= m;
    out.offset = m * out.offset + b;
    for (Knot& knot : out.knots) knot.joint = m * knot.joint + b;
    return out;
  }
};

}  // namespace embody::robot
