#pragma once
// From tracker frames (100 Hz, jittering) to a smooth pose at any time of the robot's clock (125 or 500 Hz).
#include <array>
#include <optional>

#include "core/base/time.hpp"
#include "core/math/pose.hpp"

namespace embody::teleop {

/// Interpolates the newest poses with a Catmull-Rom spline on non-uniform knots, in the exponential chart around the
/// knot before the asked time. The asked time should lie two frame periods behind the newest pose: then the spline has
/// a continuous velocity. Later times than the newest pose give the newest pose: nothing is extrapolated.
class PoseResampler {
 public:
  /// Adds a pose. Times must increase: a pose that is not newer is ignored, one that is more than `kMaxGap` newer
  /// starts afresh. Cost: O(1).
  void add(TimePoint t, const math::Pose& X) noexcept;
  void clear() noexcept { count_ = 0; }

  /// Pose at time `t`; the oldest kept pose for earlier times; nothing when empty. Cost: about 1 us.
  [[nodiscard]] std::optional<math::Pose> at(TimePoint t) const noexcept;
  [[nodiscard]] std::size_t size() const noexcept { return count_; }

  static constexpr Duration kMaxGap = std::chrono::milliseconds(200);
  static constexpr std::size_t kCapacity = 256;  ///< the longest delay (200 ms) at 1000 frames per second

 private:
  struct Knot {
    TimePoint t{};
    math::Pose X{math::Pose::Identity()};
  };
  /// i-th oldest kept knot.
  [[nodiscard]] const Knot& knot(std::size_t i) const noexcept { return knots_[(first_ + i) % kCapacity]; }

  std::array<Knot, kCapacity> knots_{};
  std::size_t first_{0};
  std::size_t count_{0};
};

}  // namespace embody::teleop
