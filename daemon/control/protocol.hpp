#pragma once
// The control protocol: one JSON object per line, requests from the client and one response to each. Pure functions
// over text; the messages are specified in docs/control.md.
#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "core/base/result.hpp"

namespace embody::control {

inline constexpr int kProtocol = 1;  ///< version of the messages
inline constexpr std::size_t kMaxLineBytes =
    std::size_t{64} * 1024;  ///< of a request; a longer line ends the connection

enum class Command : std::uint8_t { kStatus, kEngage, kDisengage, kStop, kReset, kShutdown, kSubscribe, kMarkers };

/// Name on the wire, e.g. "engage".
[[nodiscard]] const char* to_string(Command command) noexcept;

/// Process at the other end, as the kernel knows it. For the log: the mode of the socket file is the authority.
struct Peer {
  pid_t pid{-1};
  uid_t uid{static_cast<uid_t>(-1)};
};

struct Request {
  Command command{Command::kStatus};
  std::optional<std::int64_t> id;            ///< returned with the response
  std::chrono::milliseconds interval{1000};  ///< subscribe only: 20 ms to 60 s
  Peer peer{};                               ///< set by the server
};

/// Error codes on the wire.
namespace code {
inline constexpr const char* kMalformed = "malformed";         ///< not a request
inline constexpr const char* kProtocolVersion = "protocol";    ///< another version of the protocol
inline constexpr const char* kBusy = "busy";                   ///< too many clients
inline constexpr const char* kRefused = "refused";             ///< not in this mode
inline constexpr const char* kNotFollowing = "not_following";  ///< the robot did not follow
inline constexpr const char* kUnavailable = "unavailable";     ///< a device is not there
inline constexpr const char* kFailed = "failed";               ///< anything else
}  // namespace code

struct Response {
  bool ok{true};
  std::string result{"{}"};  ///< JSON text of the result; empty object where there is nothing to say
  std::string code;          ///< of the error, see namespace code
  std::string message;       ///< one sentence for a person
};

[[nodiscard]] inline Response refusal(std::string code, std::string message) {
  return {false, "{}", std::move(code), std::move(message)};
}

/// Reads one line (without its newline). Unknown members and commands are errors, so that a typing mistake is not
/// silently something else. Errors: kMalformed, kUnsupported (protocol version).
[[nodiscard]] Result<Request> parse_request(std::string_view line);
/// One line with its newline.
[[nodiscard]] std::string format_request(const Request& request);

/// Errors: kMalformed.
[[nodiscard]] Result<Response> parse_response(std::string_view line);
/// One line with its newline. A `result` that is no JSON object becomes an error response.
[[nodiscard]] std::string format_response(const Response& response, const std::optional<std::int64_t>& id);

}  // namespace embody::control
