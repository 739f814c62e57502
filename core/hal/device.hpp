#pragma once
// What all device interfaces share: how a call that does not wait ends, and why a session did.
#include <string_view>

#include "core/base/fixed_string.hpp"

namespace embody {

enum class IoStatus {
  kDone,          ///< one item was read, or the command was handed to the kernel
  kEmpty,         ///< nothing complete to read, or the kernel's buffer is full (the command is dropped: newest wins)
  kRefused,       ///< the command has expired or is not finite; nothing was sent
  kDisconnected,  ///< the session is over: only connect() helps
};

class Device {
 public:
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;
  /// Why the last session ended, for people; empty while it lasts. Call it from the owner of the driver.
  [[nodiscard]] std::string_view reason() const noexcept { return reason_.view(); }

 protected:
  Device() = default;
  ~Device() = default;

  FixedString<240> reason_;
};

}  // namespace embody
