#pragma once
// Exit codes of every embody program; documented in docs/control.md and stable.

namespace embody {

enum ExitCode : int {
  kExitOk = 0,
  kExitFailed = 1,
  kExitUsage = 2,
  kExitRefused = 3,         ///< not in this mode
  kExitNotFollowing = 4,    ///< the robot did not follow
  kExitUnavailable = 69,    ///< a device or the daemon is not there
  kExitPermission = 77,     ///< not allowed
  kExitConfiguration = 78,  ///< the configuration is wrong
  kExitInterrupted = 130,   ///< Ctrl-C
};

}  // namespace embody
