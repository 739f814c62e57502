#include "core/teleop/pose_resampler.hpp"

namespace embody::teleop {
namespace {

using math::Pose;
using math::Vector6;

/// Coordinates of `X` in the chart around `X_0`: rotation vector, then translation.
Vector6 chart(const Pose& X_0, const Pose& X) noexcept {
  Vector6 c;
  c.head<3>() = math::log_so3(X_0.linear().transpose() * X.linear());
  c.tail<3>() = X.translation() - X_0.translation();
  return c;
}

Pose from_chart(const Pose& X_0, const Vector6& c) noexcept {
  Pose X = Pose::Identity();
  X.linear() = X_0.linear() * math::exp_so3(c.head<3>());
  X.translation() = X_0.translation() + c.tail<3>();
  return X;
}

}  // namespace

void PoseResampler::add(TimePoint t, const Pose& X) noexcept {
  if (count_ > 0) {
    const TimePoint newest = knot(count_ - 1).t;
    if (t <= newest) return;
    if (t - newest > kMaxGap) clear();
  }
  if (count_ == kCapacity) {
    first_ = (first_ + 1) % kCapacity;
    --count_;
  }
  knots_[(first_ + count_) % kCapacity] = {t, X};
  ++count_;
}

std::optional<Pose> PoseResampler::at(TimePoint t) const noexcept {
  if (count_ == 0) return std::nullopt;
  if (t >= knot(count_ - 1).t) return knot(count_ - 1).X;
  if (t <= knot(0).t) return knot(0).X;
  std::size_t i = count_ - 2;
  while (knot(i).t > t) --i;

  const Knot& k1 = knot(i);
  const Knot& k2 = knot(i + 1);
  const Knot& k0 = i > 0 ? knot(i - 1) : k1;
  const Knot& k3 = i + 2 < count_ ? knot(i + 2) : k2;
  const double h = to_seconds(k2.t - k1.t);
  const Vector6 c2 = chart(k1.X, k2.X);
  // Velocities at both knots from their neighbours (finite differences; one-sided at the ends).
  const Vector6 v1 = (c2 - chart(k1.X, k0.X)) / to_seconds(k2.t - k0.t);
  const Vector6 v2 = chart(k1.X, k3.X) / to_seconds(k3.t - k1.t);
  const double s = to_seconds(t - k1.t) / h;
  const double s2 = s * s;
  const double s3 = s2 * s;
  return from_chart(k1.X, (3.0 * s2 - 2.0 * s3) * c2 + h * ((s3 - 2.0 * s2 + s) * v1 + (s3 - s2) * v2));
}

}  // namespace embody::teleop
