#pragma once
// `embodyctl demo`: the simulated lab, the daemon and an operator, on loopback.
#include <string>

namespace embody::ctl {

struct DemoOptions {
  std::string recording;   ///< TSV; empty: the shipped one
  double duration_s{0.0};  ///< 0: all of it
  std::string json_file;   ///< summary for programs; empty: none
};

/// Runs the demo; returns an exit code: 0 the robot followed, 4 it did not, 130 interrupted, others as documented.
int run_demo(const DemoOptions& options);

}  // namespace embody::ctl
