#pragma once
// What a driver makes of a capture, in a chosen chunking: one line of text per frame or state, without the times of
// arrival, so that runs can be compared.
#include <string>
#include <vector>

#include "drivers/capture/can_replay.hpp"
#include "drivers/capture/replay.hpp"

namespace embody::test {

struct Replayed {
  std::vector<std::string> readings;
  std::string failure;  ///< why it did not come to the end of the capture; empty: it did
  capture::ReplayReport report;
};

/// QualisysTracker with these markers.
Replayed replay_tracker(const capture::Capture& capture, capture::ReplayOptions options,
                        const std::vector<std::string>& markers);
/// UrRtdeArm, which gets no command and loads no program, at `frequency_hz`.
Replayed replay_arm(const capture::Capture& capture, capture::ReplayOptions options, double frequency_hz);
/// MiaHand with kHold whenever the last position has come.
Replayed replay_hand(const capture::Capture& capture, capture::ReplayOptions options);
/// The same on CAN, from a capture in segments or of ISO-TP.
Replayed replay_can_tunnel(const capture::Capture& capture, capture::CanReplayAs as);
/// MiaCanHand, whose newest state wins, so that the number of readings says nothing: the readings are the last one and
/// a line with the frames that were damaged, lost or repeated.
Replayed replay_can_compact(const capture::Capture& capture);

/// Bytes of the longest chunk from the device: two_parts(1) to two_parts(this) are all two-part splits.
std::size_t longest_chunk(const capture::Capture& capture);

}  // namespace embody::test
