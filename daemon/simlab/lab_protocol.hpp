#pragma once
// What people and programs ask of a running lab: one JSON object per line. Answers are those of the control protocol
// (daemon/control/protocol.hpp). Pure functions over text; the messages are specified in docs/simulated_lab.md.
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "core/base/result.hpp"

namespace embody::sim {

inline constexpr int kLabProtocol = 1;
inline constexpr std::size_t kMostFaultBytes = 400;  ///< of the words of one fault

enum class LabCommand : std::uint8_t { kStatus, kReport, kFaults, kFault, kPlay };

/// Name on the wire, e.g. "faults".
[[nodiscard]] const char* to_string(LabCommand command) noexcept;

struct LabRequest {
  LabCommand command{LabCommand::kStatus};
  std::string fault;               ///< kFault only: device and words
  std::optional<std::int64_t> id;  ///< returned with the answer
};

/// Reads one line (without its newline). Errors: kMalformed, kUnsupported (protocol version).
[[nodiscard]] Result<LabRequest> parse_lab_request(std::string_view line);
/// One line with its newline.
[[nodiscard]] std::string format_lab_request(const LabRequest& request);

/// Where the lab listens, and a client looks, unless told otherwise: $XDG_RUNTIME_DIR/embody/sim.sock, else
/// /tmp/embody-UID/sim.sock.
[[nodiscard]] std::string default_lab_socket();

}  // namespace embody::sim
