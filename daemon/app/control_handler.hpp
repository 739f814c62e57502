#pragma once
// Operator's requests from the control socket to the daemon.
#include "daemon/app/daemon.hpp"
#include "daemon/control/control_server.hpp"

namespace embody {

/// Handler for a control server; sets `shutdown` when asked to end. Both arguments must outlive it.
[[nodiscard]] control::ControlServer::Handler make_control_handler(Daemon& daemon, bool& shutdown);

}  // namespace embody
