#pragma once
// The controller's own functions that scripts may call here: names, parameters and defaults (URScript manual).
#include <array>
#include <cstdint>
#include <span>
#include <string_view>

#include "drivers/sim/ur/urscript/value.hpp"

namespace embody::sim::urscript {

enum class Builtin : std::uint8_t {
  kAcos,
  kAsin,
  kAtan,
  kAtan2,
  kCeil,
  kCos,
  kDegreesToRadians,
  kFloor,
  kGetActualJointPositions,
  kGetActualJointSpeeds,
  kGetSteptime,
  kGetTargetJointPositions,
  kGetTargetJointSpeeds,
  kIsWithinSafetyLimits,
  kLength,
  kLog,
  kNorm,
  kPopup,
  kPow,
  kRadiansToDegrees,
  kReadInputBoolean,
  kReadInputFloat,
  kReadInputInteger,
  kSetWatchdog,
  kServoj,
  kSin,
  kSleep,
  kSqrt,
  kStopj,
  kSync,
  kTan,
  kTextmsg,
  kWriteOutputBoolean,
  kWriteOutputFloat,
  kWriteOutputInteger,
};

struct Parameter {
  std::string_view name;
  Scalar fallback;          ///< type kNone: the argument is required
  std::string_view text{};  ///< of a fallback of type kString
};

struct BuiltinInfo {
  Builtin id{};
  std::string_view name;
  std::array<Parameter, 6> parameters{};

  [[nodiscard]] constexpr std::size_t count() const noexcept {
    std::size_t n = 0;
    while (n < parameters.size() && !parameters[n].name.empty()) ++n;
    return n;
  }
};

/// Null when there is no such function.
[[nodiscard]] const BuiltinInfo* find_builtin(std::string_view name) noexcept;
[[nodiscard]] const BuiltinInfo& builtin_info(Builtin id) noexcept;

}  // namespace embody::sim::urscript
