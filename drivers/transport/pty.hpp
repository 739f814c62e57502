#pragma once
// A pseudo-terminal that a program opens in place of a serial device.
#include <string>

#include "core/base/result.hpp"
#include "drivers/transport/unique_fd.hpp"

namespace embody::transport {

struct Pty {
  UniqueFd master;     ///< non-blocking
  std::string device;  ///< what the program opens
};

/// Raw, and nobody has it open: poll() of the master says POLLHUP until somebody does. Errors: kIo.
[[nodiscard]] Result<Pty> open_pty();

/// No echo, no translation. The kernel forgets that whenever the last program closes the device.
bool make_raw(int fd) noexcept;

}  // namespace embody::transport
