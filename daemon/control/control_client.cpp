#include "daemon/control/control_client.hpp"

#include <sys/socket.h>
#include <sys/un.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <span>
#include <utility>

#include "drivers/transport/clock.hpp"
#include "drivers/transport/tcp.hpp"

namespace embody::control {
namespace {

constexpr std::size_t kMaxResponseBytes = std::size_t{1024} * 1024;

Error connect_error(const std::string& path, const char* program, int number) {
  if (number == EACCES || number == EPERM) {
    return make_error(Errc::kPermission,
                      "you may not use the control socket %.100s: run as the user of %s, or join the group of "
                      "the socket and log in again",
                      path.c_str(), program);
  }
  if (number == ENOENT || number == ECONNREFUSED || number == ENOTDIR) {
    const bool daemon = std::strcmp(program, "embodyd") == 0;
    return make_error(Errc::kDisconnected,
                      "%s is not running: nobody answers on %.100s; start it (%s) or name its socket with --socket",
                      program, path.c_str(), daemon ? "systemctl start embodyd, or embodyd" : "embody-sim run");
  }
  if (number == EAGAIN) {
    return make_error(Errc::kTimeout, "%s does not accept connections on %.100s at the moment", program, path.c_str());
  }
  return make_error(Errc::kIo, "control socket %.100s: %s", path.c_str(), std::strerror(number));
}

}  // namespace

Result<ControlClient> ControlClient::connect(const std::string& path, const char* program) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.empty() || path.size() >= sizeof address.sun_path) {
    return make_error(Errc::kInvalidArgument, "the path of the control socket must be shorter than %zu bytes",
                      sizeof address.sun_path);
  }
  std::memcpy(address.sun_path, path.c_str(), path.size());
  transport::UniqueFd fd(::socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (!fd || ::connect(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    return connect_error(path, program, errno);
  }
  return ControlClient(std::move(fd), path, program);
}

Result<Response> ControlClient::request(const Request& request, std::chrono::milliseconds timeout) {
  return request_line(format_request(request), timeout);
}

Result<Response> ControlClient::request_line(std::string_view line, std::chrono::milliseconds timeout) {
  const TimePoint deadline = transport::now() + timeout;
  // A daemon that refuses the connection may have said why and closed: its answer is worth more than the failed send.
  const auto sent = transport::send_all(fd_.get(), std::as_bytes(std::span(line)), deadline);
  if (!sent && sent.error().code == Errc::kTimeout) {
    return make_error(Errc::kTimeout, "%s does not take requests on %.100s", program_, path_.c_str());
  }
  auto answer = read_line(deadline);
  if (!answer) return answer.error();
  return parse_response(*answer);
}

Result<Response> ControlClient::next(std::chrono::milliseconds timeout) {
  auto line = read_line(transport::now() + timeout);
  if (!line) return line.error();
  return parse_response(*line);
}

Result<std::string> ControlClient::read_line(TimePoint deadline) {
  while (true) {
    if (const auto end = in_.find('\n'); end != std::string::npos) {
      std::string line = in_.substr(0, end);
      in_.erase(0, end + 1);
      return line;
    }
    if (in_.size() > kMaxResponseBytes) {
      return make_error(Errc::kMalformed, "%.100s answers without an end: it is not %s", path_.c_str(), program_);
    }
    std::array<std::byte, std::size_t{16} * 1024> buffer;
    const auto received = transport::receive(fd_.get(), buffer);
    if (received.status == IoStatus::kDisconnected) return lost();
    if (received.status == IoStatus::kDone) {
      in_.append(reinterpret_cast<const char*>(buffer.data()), received.size);
    } else if (transport::now() >= deadline) {
      return make_error(Errc::kTimeout, "%s did not answer in time on %.100s", program_, path_.c_str());
    } else {
      (void)transport::wait_readable(fd_.get(), deadline);
    }
  }
}

Error ControlClient::lost() const noexcept {
  return make_error(Errc::kDisconnected, "%s closed the connection on %.100s: it has ended", program_, path_.c_str());
}

}  // namespace embody::control
