#include "drivers/mia/mia_config.hpp"

#include <cmath>

namespace embody::mia {

Status check(const MiaConfig& config) noexcept {
  if (const Status transmission = check(config.transmission); !transmission) return transmission;
  if (const Status telemetry = check(config.telemetry); !telemetry) return telemetry;
  for (std::size_t i = 0; i < kMotors; ++i) {
    if (std::isfinite(config.min_rad[i]) && std::isfinite(config.max_rad[i]) && config.min_rad[i] <= config.max_rad[i])
      continue;
    return make_error(Errc::kInvalidArgument, "mia: the limits of %s are not a range", kJointNames[i]);
  }
  if (config.speed_percent < 1 || config.speed_percent > 99) {
    return make_error(Errc::kInvalidArgument, "mia: speed_percent is %d, must be 1..99", config.speed_percent);
  }
  if (config.ack_timeout <= Duration::zero() || config.lost_after_timeouts < 1) {
    return make_error(Errc::kInvalidArgument, "mia: ack_timeout and lost_after_timeouts must be positive");
  }
  if (config.silence_limit < std::chrono::milliseconds(500)) {
    return make_error(Errc::kInvalidArgument, "mia: silence_limit must be at least 0.5 s");
  }
  if (config.space == Space::kJoint && config.generation == Generation::kStreaming) {
    return make_error(Errc::kInvalidArgument, "mia: joint space needs the acknowledging protocol; set space to motor");
  }
  return {};
}

}  // namespace embody::mia
