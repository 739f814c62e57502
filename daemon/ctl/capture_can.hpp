#pragma once
// The frames between a hand on CAN and whoever drives it, captured by listening: nothing stands in the way, nothing is
// sent.
#include <memory>
#include <vector>

#include "daemon/ctl/capture_link.hpp"
#include "drivers/transport/can_frame.hpp"

namespace embody::ctl {

[[nodiscard]] bool is_on_can(const config::HandConfig& hand);

/// The identifiers of the configured hand, by who sends them.
struct CanHandIds {
  std::vector<transport::CanId> host;
  std::vector<transport::CanId> hand;
};
[[nodiscard]] CanHandIds can_hand_ids(const config::MiaHandConfig& mia);

/// For people: interface, profile and identifiers.
[[nodiscard]] std::string can_peer(const config::MiaHandConfig& mia);

/// Listens from now on; the kernel hands over the frames of can_hand_ids() only. Errors: those of open_can().
[[nodiscard]] Result<std::unique_ptr<CaptureLink>> listen_on_can(const config::MiaHandConfig& mia,
                                                                 capture::CaptureWriter& writer);

}  // namespace embody::ctl
