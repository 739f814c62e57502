#pragma once
// Serves the control socket from an existing event loop: nothing here waits, and there is no thread.
#include <functional>
#include <memory>
#include <string>

#include "core/base/result.hpp"
#include "daemon/control/listen.hpp"
#include "daemon/control/protocol.hpp"

namespace embody::control {

struct ServerConfig {
  std::string path;          ///< of the socket, see server_socket_path()
  bool group_access{false};  ///< 0660 and a folder of 0750 instead of 0600 and 0700
  SocketOwner owner{};
};

/// What happened since the start.
struct ServerCounters {
  std::uint64_t connections{0};
  std::uint64_t requests{0};
  std::uint64_t malformed{0};  ///< lines that were no request
  std::uint64_t dropped{0};    ///< clients that were disconnected: overlong line, too slow, too many
};

/// At most 16 clients. Every complete line gets one response, in order. A client that sends a line of more than
/// kMaxLineBytes, or leaves more than 256 KiB of responses unread, is disconnected; the others do not notice.
class ControlServer {
 public:
  /// Answers a request, on the thread that calls serve(). subscribe is not passed on: its lines are the answers to
  /// status. An exception becomes an error response.
  using Handler = std::function<Response(const Request&)>;

  /// Creates the folder of the socket if it is missing (one level), removes a stale socket and listens.
  /// Errors: kRefused (another daemon answers there), kPermission, kInvalidArgument (path too long, not a socket,
  /// folder of another user), kIo.
  [[nodiscard]] static Result<std::unique_ptr<ControlServer>> open(const ServerConfig& config, Handler handler);

  /// Answers a line of another protocol with lines of it, each with its newline. What the server says itself (busy,
  /// overlong) are error responses of the control protocol.
  using LineHandler = std::function<std::string(std::string_view line)>;
  /// The same server with requests of another kind. Errors as open().
  [[nodiscard]] static Result<std::unique_ptr<ControlServer>> open_lines(const ServerConfig& config,
                                                                         LineHandler handler);

  ControlServer(const ControlServer&) = delete;
  ControlServer& operator=(const ControlServer&) = delete;
  /// Sends what can be sent at once, disconnects everybody and removes the socket file.
  ~ControlServer();

  /// Readable when serve() has something to do (an epoll descriptor, fit for poll()).
  [[nodiscard]] int fd() const noexcept;
  /// Handles what is due and returns. Bounded work per call; call again while fd() is readable.
  void serve();
  [[nodiscard]] const ServerCounters& counters() const noexcept;
  [[nodiscard]] std::size_t client_count() const noexcept;

 private:
  class Impl;
  explicit ControlServer(std::unique_ptr<Impl> impl) noexcept;
  static Result<std::unique_ptr<ControlServer>> open(const ServerConfig& config, Handler handler, LineHandler lines);
  std::unique_ptr<Impl> impl_;
};

}  // namespace embody::control
