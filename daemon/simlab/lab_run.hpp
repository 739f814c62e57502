#pragma once
// A lab that runs as a program: events go to standard output and commands come from standard input, one per line, so
// that a demo, a test or a person can drive it; other programs talk to its socket.
#include <string>

#include "daemon/app/signals.hpp"
#include "daemon/simlab/lab.hpp"

namespace embody::sim {

struct LabRunOptions {
  bool wait_for_play{false};  ///< play only when told to
  std::string socket;         ///< path; empty: the default one, and without it where another lab has it
  bool no_socket{false};
  std::string fault_script;  ///< file; empty: none
};

/// Runs `lab`, which has been started, until a signal or "quit", and says the last report. Errors: of the script
/// (fault_script.hpp) and the socket (kRefused, ...), before anything is said.
[[nodiscard]] Status run_lab(Lab& lab, StopSignals& signals, const LabRunOptions& options);

}  // namespace embody::sim
