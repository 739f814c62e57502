#pragma once
// Finding out who is at the other end of a line: the part of a session's beginning that waits. Nothing here moves the
// hand.
#include "drivers/mia/hand_line.hpp"
#include "drivers/mia/mia_config.hpp"

namespace embody::mia {

struct Probed {
  Generation generation{Generation::kAcknowledging};
  std::array<double, kMotors> counts{};  ///< motor positions
  std::array<double, kMotors> q_rad{};   ///< and their angles
  FixedString<28> firmware{"firmware id unknown"};
};

/// Pings (1.8 s: the hand may still be starting), switches streams of an earlier host off, asks for the firmware id and
/// for the positions in the configured space, and if these do not come, switches the position stream on.
/// Errors: kTimeout (nobody there), kUnsupported (it lacks what `config` asks for), kDisconnected.
[[nodiscard]] Result<Probed> probe(HandLine& line, const MiaConfig& config);

/// Sends `command` and waits until `deadline` for its ACK and from there on for a line that `done(line)` accepts (it
/// may be the ACK itself).
[[nodiscard]] bool ask(HandLine& line, const Command& command, TimePoint deadline,
                       const std::function<bool(std::string_view)>& done);

/// Motor positions on request, as counts; nothing when they do not come by `deadline`.
[[nodiscard]] std::optional<std::array<double, kMotors>> ask_counts(HandLine& line, const MiaConfig& config,
                                                                    TimePoint deadline);

}  // namespace embody::mia
