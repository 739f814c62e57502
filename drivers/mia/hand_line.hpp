#pragma once
// The wire between a Mia hand and its driver: commands out, lines back. One object is one open connection.
#include <functional>
#include <memory>
#include <string_view>

#include "core/base/result.hpp"
#include "core/hal/device.hpp"
#include "drivers/mia/codec.hpp"

namespace embody::mia {

class HandLine {
 public:
  HandLine() = default;
  HandLine(const HandLine&) = delete;
  HandLine& operator=(const HandLine&) = delete;
  virtual ~HandLine() = default;

  /// Readable when receive() may have something.
  [[nodiscard]] virtual int fd() const noexcept = 0;
  /// Hands `command` to the kernel without waiting. kEmpty: its buffer is full, nothing was sent.
  virtual IoStatus send(const Command& command) noexcept = 0;
  /// The next complete line with its LF, valid until the next call. Neither waits nor allocates.
  virtual IoStatus receive(std::string_view& line) noexcept = 0;
  /// Why the connection ended, where the wire knows more than that it is gone.
  [[nodiscard]] virtual std::string_view reason() const noexcept { return {}; }
};

/// Opens a new connection. May block and allocate. Errors are sentences for the operator.
using OpenLine = std::function<Result<std::unique_ptr<HandLine>>()>;

}  // namespace embody::mia
