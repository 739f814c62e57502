#include "drivers/transport/tty.hpp"

#include <fcntl.h>
#include <linux/serial.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <termios.h>

#include <cerrno>
#include <cstring>

namespace embody::transport {
namespace {

Error open_failure(const char* device, int code) {
  switch (code) {
    case ENOENT:
    case ENXIO:
    case ENODEV:
      return make_error(Errc::kNotFound, "no serial line at %s: check the cable and the device name", device);
    case EACCES:
    case EPERM:
      return make_error(Errc::kPermission, "no permission to open %s: add the user to the group 'dialout'", device);
    case EBUSY:
      return make_error(Errc::kRefused, "%s is busy: another program has it open", device);
    default:
      return make_error(Errc::kIo, "cannot open %s: %s", device, std::strerror(code));
  }
}

bool make_raw(int fd) noexcept {
  termios settings{};
  if (::tcgetattr(fd, &settings) != 0) return false;
  ::cfmakeraw(&settings);
  settings.c_cflag = CS8 | CREAD | CLOCAL;  // one stop bit, no parity, no flow control, no hang-up on close
  settings.c_iflag = IGNBRK;
  settings.c_cc[VMIN] = 1;  // an empty line reads as EAGAIN, so that 0 means hang-up
  settings.c_cc[VTIME] = 0;
  ::cfsetispeed(&settings, B115200);
  ::cfsetospeed(&settings, B115200);
  return ::tcsetattr(fd, TCSANOW, &settings) == 0;
}

bool request_low_latency(int fd) noexcept {
  serial_struct serial{};
  if (::ioctl(fd, TIOCGSERIAL, &serial) != 0) return false;
  serial.flags |= ASYNC_LOW_LATENCY;
  return ::ioctl(fd, TIOCSSERIAL, &serial) == 0;
}

bool is_transient(int code) noexcept {
  return code == EAGAIN || code == EWOULDBLOCK || code == EINTR;
}

}  // namespace

Result<Tty> open_tty(const std::string& device, bool low_latency) {
  Tty tty;
  tty.fd.reset(::open(device.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (!tty.fd) return open_failure(device.c_str(), errno);
  const int fd = tty.fd.get();
  if (::isatty(fd) == 0) {
    return make_error(Errc::kInvalidArgument, "%s is not a serial line: check the device name", device.c_str());
  }
  if (::flock(fd, LOCK_EX | LOCK_NB) != 0) return open_failure(device.c_str(), errno == EWOULDBLOCK ? EBUSY : errno);
  ::ioctl(fd, TIOCEXCL);  // best effort: the lock above is what counts between our own processes
  if (!make_raw(fd)) return make_error(Errc::kIo, "cannot configure %s: %s", device.c_str(), std::strerror(errno));
  if (low_latency) tty.low_latency = request_low_latency(fd);
  ::tcflush(fd, TCIOFLUSH);
  return tty;
}

Received read_tty(int fd, std::span<std::byte> buffer) noexcept {
  const ssize_t size = ::read(fd, buffer.data(), buffer.size());
  if (size > 0) return {IoStatus::kDone, static_cast<std::size_t>(size)};
  if (size < 0 && is_transient(errno)) return {IoStatus::kEmpty, 0};
  return {IoStatus::kDisconnected, 0};
}

IoStatus write_tty(int fd, std::span<const std::byte> message) noexcept {
  const ssize_t size = ::write(fd, message.data(), message.size());
  if (size > 0) return IoStatus::kDone;
  return size < 0 && is_transient(errno) ? IoStatus::kEmpty : IoStatus::kDisconnected;
}

}  // namespace embody::transport
