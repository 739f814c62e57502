#include "daemon/control/socket_path.hpp"

#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <vector>

namespace embody::control {
namespace {

constexpr const char* kSystemSocket = "/run/embody/control.sock";

std::string environment(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? "" : value;
}

/// Where a daemon of this user listens when it is started by hand, the preferred place first.
std::vector<std::string> personal_paths() {
  std::vector<std::string> paths;
  if (const auto runtime = environment("XDG_RUNTIME_DIR"); !runtime.empty()) {
    paths.push_back(runtime + "/embody/control.sock");
  }
  paths.push_back("/tmp/embody-" + std::to_string(::geteuid()) + "/control.sock");
  return paths;
}

}  // namespace

std::string personal_socket_path(const std::string& file) {
  const auto runtime = environment("XDG_RUNTIME_DIR");
  return (runtime.empty() ? "/tmp/embody-" + std::to_string(::geteuid()) : runtime + "/embody") + "/" + file;
}

std::string server_socket_path(const std::string& configured) {
  if (!configured.empty()) return configured;
  const auto unit = environment("RUNTIME_DIRECTORY");  // systemd: one folder, or several with colons
  if (!unit.empty()) return unit.substr(0, unit.find(':')) + "/control.sock";
  return personal_paths().front();
}

std::string client_socket_path(const std::string& given) {
  if (!given.empty()) return given;
  if (auto named = environment("EMBODY_SOCKET"); !named.empty()) return named;
  auto paths = personal_paths();
  paths.emplace_back(kSystemSocket);
  for (auto& path : paths) {
    // A folder that may not be entered counts as "there": connecting then says what is wrong.
    if (::access(path.c_str(), F_OK) == 0 || errno == EACCES) return path;
  }
  return kSystemSocket;
}

}  // namespace embody::control
