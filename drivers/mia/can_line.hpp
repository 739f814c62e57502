#pragma once
// A Mia hand behind CAN, profile "ascii-tunnel": the serial protocol's payloads as messages, without the framing bytes.
//   host to hand   the 15 payload bytes of a command
//   hand to host   the 15 payload bytes of an ACK, or a data line as it is on the serial line, with its LF (a whole ACK
//                  line is understood too: a gateway need not know what it forwards)
// This is a user-defined CAN profile, not a Prensilia specification, and unverified on hardware: it needs a gateway
// between CAN and the hand's serial line that speaks it.
#include <optional>
#include <string_view>

#include "drivers/mia/can_tunnel.hpp"
#include "drivers/mia/hand_line.hpp"

namespace embody::mia {

inline constexpr std::string_view kCanProfileNotice =
    "user-defined CAN profile, not a Prensilia specification, unverified on hardware";

/// Opens the tunnel each time it is called. Errors as open_tunnel().
[[nodiscard]] OpenLine can_line(CanTunnelConfig config);

/// The line that `message` stands for, in `buffer`, or nothing when it is neither an ACK nor a data line.
/// @pre buffer holds at least kMaxMessage bytes
[[nodiscard]] std::optional<std::string_view> line_of_message(std::string_view message,
                                                              std::span<char> buffer) noexcept;
/// The message that the hand's `line` (with its LF) becomes.
[[nodiscard]] std::string_view message_of_line(std::string_view line) noexcept;
/// The command whose payload `message` is, or nothing.
[[nodiscard]] std::optional<Command> command_of_message(std::string_view message) noexcept;

}  // namespace embody::mia
