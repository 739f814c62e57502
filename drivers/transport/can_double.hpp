#pragma once
// A stand-in for a CAN socket where the kernel has none: a Unix socket that keeps message boundaries. Its name is
// "unix:/path". One end is a simulator that listens at the path, the other a driver.
#include <array>
#include <optional>
#include <string>
#include <string_view>

#include "core/base/result.hpp"
#include "drivers/transport/unique_fd.hpp"

namespace embody::transport {

/// The path in "unix:/path", or nothing when `interface` is not such a name.
[[nodiscard]] std::optional<std::string> double_path(std::string_view interface);

/// Listens at `path`, in place of a socket that a program left behind when it died.
/// Errors: kInvalidArgument (too long), kRefused (in use, or not a socket), kIo.
[[nodiscard]] Result<UniqueFd> double_listen(const std::string& path);
/// Errors: kInvalidArgument, kDisconnected (nobody listens), kPermission, kIo.
[[nodiscard]] Result<UniqueFd> double_connect(const std::string& path);
/// Takes one waiting connection, or an empty descriptor when nobody waits.
[[nodiscard]] UniqueFd double_accept(int listener) noexcept;
/// Two connected ends without a path, for tests. Errors: kIo.
[[nodiscard]] Result<std::array<UniqueFd, 2>> double_pair();

}  // namespace embody::transport
