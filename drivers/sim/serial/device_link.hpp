#pragma once
// A stable name for a pseudo-terminal.
#include <string>

#include "core/base/result.hpp"

namespace embody::sim {

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
