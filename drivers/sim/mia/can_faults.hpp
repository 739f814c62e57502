#pragma once
// Faults of a simulated hand on CAN by their names (can_simulator.hpp).
#include <optional>
#include <string>
#include <string_view>

#include "core/base/result.hpp"
#include "drivers/sim/mia/can_compact_hand.hpp"
#include "drivers/transport/can_errors.hpp"

namespace embody::sim {

/// "bus_off", "error_passive" or "no_ack" as what a controller reports, nothing for other texts.
[[nodiscard]] std::optional<transport::CanErrors> bus_fault(std::string_view text) noexcept;
/// Errors: kInvalidArgument, with the names that exist.
Status compact_fault(CompactHand& hand, std::string_view text);
/// For people: those of the bus, and with `compact` those of that hand. One line each: its words, blanks up to column
/// 32, what it does.
[[nodiscard]] std::string can_fault_help(bool compact);

}  // namespace embody::sim
