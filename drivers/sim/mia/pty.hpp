#pragma once
// A pseudo-terminal whose far end looks like a serial device.
#include <string>

#include "core/base/result.hpp"
#include "drivers/transport/unique_fd.hpp"

namespace embody::sim {

struct Pty {
  transport::UniqueFd master;  ///< non-blocking
  std::string device;          ///< what a host opens
};

/// Errors: kIo.
[[nodiscard]] Result<Pty> open_pty();

/// Makes the line raw (no echo, no translation). The kernel forgets that whenever the last host closes the device.
bool make_raw(int master) noexcept;

/// A symlink that lives as long as its owner.
class DeviceLink {
 public:
  DeviceLink() = default;
  DeviceLink(const DeviceLink&) = delete;
  DeviceLink& operator=(const DeviceLink&) = delete;
  ~DeviceLink() { remove(); }

  /// Points `path` at `device`, in place of an older symlink. Errors: kRefused (`path` is something else), kIo.
  Status create(const std::string& path, const std::string& device);
  /// Removes the symlink unless somebody has pointed it elsewhere meanwhile.
  void remove() noexcept;

 private:
  std::string path_;
  std::string device_;
};

}  // namespace embody::sim
