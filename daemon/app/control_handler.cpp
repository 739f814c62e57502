#include "daemon/app/control_handler.hpp"

#include <spdlog/spdlog.h>

namespace embody {
namespace {

using control::Command;
using control::Request;
using control::Response;

/// One sentence: why not, and what would help.
std::string explain(safety::RequestKind kind, const Decision& decision) {
  if (!decision.decided) return "the arm loop did not decide in time; nothing was done";
  const safety::ModeState& mode = decision.mode;
  std::string now = std::string("mode is ") + safety::to_string(mode.mode) + ": " + safety::to_string(mode.refusal);
  if (mode.refusal == safety::Cause::kWatchdog) return now + "; restart the daemon";
  if (mode.mode != safety::Mode::kStopped || kind == safety::RequestKind::kReset) return now;
  return now + "; remove the cause, then reset";
}

Response decide(Daemon& daemon, safety::RequestKind kind) {
  const Decision decision = daemon.request(kind);
  if (decision.accepted) {
    return {true, std::string(R"({"mode":")") + safety::to_string(decision.mode.mode) + "\"}", "", ""};
  }
  return control::refusal(control::code::kRefused, explain(kind, decision));
}

}  // namespace

control::ControlServer::Handler make_control_handler(Daemon& daemon, bool& shutdown) {
  return [&daemon, &shutdown](const Request& request) -> Response {
    if (request.command == Command::kStatus) return {true, daemon.status_json(), "", ""};
    if (request.command == Command::kMarkers) return {true, daemon.markers_json(), "", ""};
    spdlog::info("{} asked by uid {} pid {}", control::to_string(request.command), request.peer.uid, request.peer.pid);
    switch (request.command) {
      case Command::kEngage:
        return decide(daemon, safety::RequestKind::kEngage);
      case Command::kDisengage:
        return decide(daemon, safety::RequestKind::kDisengage);
      case Command::kStop:
        return decide(daemon, safety::RequestKind::kStop);
      case Command::kReset:
        return decide(daemon, safety::RequestKind::kReset);
      case Command::kShutdown:
        shutdown = true;
        return {};
      default:
        return control::refusal(control::code::kMalformed, "not a command of this daemon");
    }
  };
}

}  // namespace embody
