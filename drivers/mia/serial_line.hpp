#pragma once
// A Mia hand on a serial line: 115200 baud, 8N1 (drivers/transport/tty.hpp).
#include <string>

#include "drivers/mia/hand_line.hpp"

namespace embody::mia {

/// Opens `device` ("/dev/ttyUSB0") each time it is called. Errors as open_tty().
[[nodiscard]] OpenLine serial_line(std::string device);

}  // namespace embody::mia
