#include "drivers/transport/pty.hpp"

#include <fcntl.h>
#include <termios.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>

namespace embody::transport {

Result<Pty> open_pty() {
  Pty pty;
  pty.master.reset(::posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  const int master = pty.master.get();
  std::array<char, 64> name{};
  if (!pty.master || ::grantpt(master) != 0 || ::unlockpt(master) != 0 ||
      ::ptsname_r(master, name.data(), name.size()) != 0) {
    return make_error(Errc::kIo, "cannot create a pseudo-terminal: %s", std::strerror(errno));
  }
  pty.device = name.data();
  // The kernel reports a hang-up only after a first opening.
  UniqueFd first(::open(pty.device.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC));
  if (!first) return make_error(Errc::kIo, "cannot open %s: %s", pty.device.c_str(), std::strerror(errno));
  first.reset();
  if (!make_raw(master))
    return make_error(Errc::kIo, "cannot make %s raw: %s", pty.device.c_str(), std::strerror(errno));
  return pty;
}

bool make_raw(int fd) noexcept {
  termios settings{};
  if (::tcgetattr(fd, &settings) != 0) return false;
  ::cfmakeraw(&settings);
  return ::tcsetattr(fd, TCSANOW, &settings) == 0;
}

}  // namespace embody::transport
