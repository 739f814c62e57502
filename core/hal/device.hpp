#pragma once
// What all device interfaces share: how a call that does not wait ends, and why a session did.
#include <string_view>

#include "core/base/fixed_string.hpp"
#include "core/hal/counter.hpp"

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
  /// What happened since the driver was made, sessions included that are over. From any thread, whoever owns the
  /// driver.
  [[nodiscard]] std::span<const NamedCounter> named_counters() const noexcept { return table_.view(); }

 protected:
  Device() = default;
  ~Device() = default;
  /// For the constructor. Names members of the driver itself: its address never changes, and a session is too
  /// short-lived.
  void show(std::initializer_list<NamedCounter> counters) noexcept { table_ = CounterTable(counters); }

  FixedString<240> reason_;

 private:
  CounterTable table_;
};

}  // namespace embody
