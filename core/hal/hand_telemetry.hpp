#pragma once
// What a robot hand tells about itself besides its positions. Everything is optional: hands differ in what they
// measure.
#include <array>
#include <cstdint>

#include "core/base/fixed_string.hpp"
#include "core/base/time.hpp"

namespace embody {

inline constexpr std::size_t kMaxHandCurrents = 8;
inline constexpr std::size_t kMaxHandFingers = 5;  ///< in the order of Finger

/// Whether the hand may be moved, and what stands in the way.
enum class HandCondition : std::uint8_t {
  kUnknown,       ///< the hand does not tell
  kReady,         ///< would move
  kHoldsObject,   ///< would move; the last motion ended at an object
  kNoReadings,    ///< would move; its currents or forces no longer come
  kStopped,       ///< by us, until it is engaged again
  kNotActivated,  ///< or while its activation goes on
  kRestarted,     ///< its zero is in doubt until it was calibrated
  kFault,
};
inline constexpr std::array<const char*, 8> kHandConditionNames{
    "unknown", "ready", "holds an object", "no readings", "stopped", "not activated", "restarted", "fault"};

enum class HandSupply : std::uint8_t { kUnknown, kGood, kLow };
inline constexpr std::array<const char*, 3> kHandSupplyNames{"unknown", "good", "low"};

/// Raw numbers of the hand's own converter, less the zero that a tare found; nobody documents their unit.
struct RawForce {
  bool measured{false};
  std::int32_t normal{0};
  std::int32_t tangential{0};
};

struct HandTelemetry {
  HandCondition condition{HandCondition::kUnknown};
  HandSupply supply{HandSupply::kUnknown};
  FixedString<120> why_not;  ///< why a motion would be refused now, as a sentence; empty: it would not

  TimePoint t_current{};                                     ///< arrival; never: not measured
  std::size_t current_count{0};                              ///< motors, in the order of the joints
  std::array<double, kMaxHandCurrents> current_a{};          ///< A, where the unit is known; else zeros
  std::array<std::int32_t, kMaxHandCurrents> current_raw{};  ///< where the unit is not known
  bool current_in_ampere{false};                             ///< which of the two

  TimePoint t_force{};  ///< arrival; never: not measured
  std::array<RawForce, kMaxHandFingers> force{};
};

}  // namespace embody
