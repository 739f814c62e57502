#pragma once
// Where the control socket is.
#include <string>

namespace embody::control {

/// Where the daemon listens: `configured` if not empty, else $RUNTIME_DIRECTORY/control.sock (systemd), else
/// $XDG_RUNTIME_DIR/embody/control.sock, else /tmp/embody-UID/control.sock.
[[nodiscard]] std::string server_socket_path(const std::string& configured);

/// Where a client looks: `given` (--socket) if not empty, else $EMBODY_SOCKET, else the first that is there of
/// $XDG_RUNTIME_DIR/embody/control.sock, /tmp/embody-UID/control.sock and the system's /run/embody/control.sock.
[[nodiscard]] std::string client_socket_path(const std::string& given);

/// Where a program that a user starts by hand listens: $XDG_RUNTIME_DIR/embody/FILE, else /tmp/embody-UID/FILE.
[[nodiscard]] std::string personal_socket_path(const std::string& file);

}  // namespace embody::control
