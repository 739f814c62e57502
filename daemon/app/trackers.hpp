#pragma once
// The tracker driver that the configuration asks for.
#include <memory>

#include "core/hal/hand_tracker.hpp"
#include "daemon/app/config.hpp"

namespace embody {

/// Opens nothing yet: that is HandTracker::connect().
[[nodiscard]] std::unique_ptr<HandTracker> make_tracker(const config::EmbodyConfig& config);

}  // namespace embody
