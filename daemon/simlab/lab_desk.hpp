#pragma once
// Answers for a lab what comes in over its socket.
#include <functional>
#include <memory>
#include <string>

#include "daemon/control/control_server.hpp"
#include "daemon/simlab/lab.hpp"
#include "daemon/simlab/lab_protocol.hpp"

namespace embody::sim {

/// One line of a client to one line of answer. `lab` has to outlive it; `on_fault` is told each fault that was made.
[[nodiscard]] control::ControlServer::LineHandler make_lab_desk(Lab& lab,
                                                                std::function<void(const std::string&)> on_fault);

/// Listens at `path`. Errors: those of ControlServer::open().
[[nodiscard]] Result<std::unique_ptr<control::ControlServer>> open_lab_socket(
    const std::string& path, control::ControlServer::LineHandler handler);

}  // namespace embody::sim
