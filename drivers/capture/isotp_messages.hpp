#pragma once
// The messages of ISO-TP (ISO 15765-2, classic frames, normal addressing) in a capture of CAN frames: the kernel joins
// them for its sockets, so that a replay over the double of can_double.hpp, which carries whole messages, needs them
// joined too. Pure functions.
#include "core/base/result.hpp"
#include "drivers/capture/capture.hpp"

namespace embody::capture {

/// `frames` with one chunk per complete message, at the time of its last frame: the identifier's four bytes, then the
/// message. Flow control is left out, and so is a message that has no end. Errors: kInvalidArgument (no capture of
/// CAN), kMalformed (a frame that is none of ISO-TP, or out of order), with the number of the chunk.
[[nodiscard]] Result<Capture> join_isotp(const Capture& frames);

}  // namespace embody::capture
