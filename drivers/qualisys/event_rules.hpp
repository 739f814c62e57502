#pragma once
// What QTM's events mean to a session that drives a robot. Pure functions.
#include "drivers/qualisys/codec.hpp"

namespace embody::qualisys {

enum class EventEffect {
  kNone,
  kDoubt,  ///< frames go on, but they may mean something else now: a new label epoch
  kEnd,    ///< what was validated at the start of the session holds no longer: the session is over
};

/// Unknown events have no effect. `allow_playback`: whether QTM may play back a recording.
[[nodiscard]] EventEffect effect_of(Event event, bool allow_playback) noexcept;

/// What happened, as the end of a sentence that begins with "QTM".
[[nodiscard]] const char* describe(Event event) noexcept;

/// Whether frames are expected in this state unless QTM says that it has none.
[[nodiscard]] bool is_measuring(Event state) noexcept;

}  // namespace embody::qualisys
