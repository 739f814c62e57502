#pragma once
// A listening Unix socket that owns its file.
#include <sys/types.h>

#include <string>

#include "core/base/result.hpp"
#include "drivers/transport/unique_fd.hpp"

namespace embody::control {

/// Removes the file at the end of its life, unless somebody replaced it.
class SocketFile {
 public:
  SocketFile() = default;
  SocketFile(std::string path, dev_t device, ino_t inode) noexcept
      : path_(std::move(path)), device_(device), inode_(inode) {}
  SocketFile(SocketFile&& other) noexcept { *this = std::move(other); }
  SocketFile& operator=(SocketFile&& other) noexcept;
  ~SocketFile();

 private:
  std::string path_;
  dev_t device_{0};
  ino_t inode_{0};
};

struct Listener {
  transport::UniqueFd fd;
  SocketFile file;  // declared last: the file goes before the descriptor
};

/// Whose socket it is, for the sentences that say what is wrong.
struct SocketOwner {
  const char* program{"embodyd"};
  const char* how_to_end{"embodyctl shutdown"};
  const char* setting{"[control] socket"};  ///< that moves the socket elsewhere
};

/// See ControlServer::open. The probe for another daemon, the removal of a stale socket and the bind happen under a
/// lock of the folder, so that of two daemons that start together one is refused.
[[nodiscard]] Result<Listener> listen_unix(const std::string& path, bool group_access, const SocketOwner& owner = {});

}  // namespace embody::control
