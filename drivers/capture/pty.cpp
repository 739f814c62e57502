#include "drivers/capture/pty.hpp"

#include <fcntl.h>
#include <termios.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>

namespace embody::capture {

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
  transport::UniqueFd first(::open(pty.device.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC));
  if (!first) return make_error(Errc::kIo, "cannot open %s: %s", pty.device.c_str(), std::strerror(errno));
  first.reset();
  make_raw(master);
  return pty;
}

void make_raw(int fd) noexcept {
  termios settings{};
  if (::tcgetattr(fd, &settings) != 0) return;
  ::cfmakeraw(&settings);
  ::tcsetattr(fd, TCSANOW, &settings);
}

}  // namespace embody::capture
