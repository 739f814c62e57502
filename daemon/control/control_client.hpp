#pragma once
// Talks to the daemon's control socket. Waits in poll(), never longer than the time-out.
#include <chrono>
#include <string>
#include <string_view>

#include "core/base/result.hpp"
#include "core/base/time.hpp"
#include "daemon/control/protocol.hpp"
#include "drivers/transport/unique_fd.hpp"

namespace embody::control {

class ControlClient {
 public:
  /// `program` is who should be there, for the sentences. Errors: kDisconnected (nobody there), kPermission,
  /// kInvalidArgument (path too long), kIo.
  [[nodiscard]] static Result<ControlClient> connect(const std::string& path, const char* program = "embodyd");

  /// Sends one request and waits for its response. An answer with ok = false is a value, not an error.
  /// Errors: kTimeout, kDisconnected (the daemon ended), kMalformed (it speaks something else).
  [[nodiscard]] Result<Response> request(const Request& request, std::chrono::milliseconds timeout);
  /// The same for a request of another kind, one line with its newline.
  [[nodiscard]] Result<Response> request_line(std::string_view line, std::chrono::milliseconds timeout);
  /// Waits for the next line of a subscription. Errors as request().
  [[nodiscard]] Result<Response> next(std::chrono::milliseconds timeout);

  [[nodiscard]] int fd() const noexcept { return fd_.get(); }

 private:
  ControlClient(transport::UniqueFd fd, std::string path, const char* program) noexcept
      : fd_(std::move(fd)), path_(std::move(path)), program_(program) {}

  [[nodiscard]] Result<std::string> read_line(TimePoint deadline);
  [[nodiscard]] Error lost() const noexcept;

  transport::UniqueFd fd_;
  std::string path_;
  const char* program_;
  std::string in_;
};

}  // namespace embody::control
