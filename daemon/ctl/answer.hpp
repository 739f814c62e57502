#pragma once
// How a command of embodyctl reports: exit codes, and one line for people or programs.
#include <string>
#include <string_view>

#include "core/base/result.hpp"
#include "daemon/control/exit_code.hpp"

namespace embody::ctl {

/// Exit code of an error response of the daemon (codes: protocol.hpp).
[[nodiscard]] ExitCode exit_code_of(std::string_view code) noexcept;
/// Exit code of an error on the way to the daemon.
[[nodiscard]] ExitCode exit_code_of(Errc code) noexcept;
/// The same error as a code of the protocol, for --json.
[[nodiscard]] const char* code_of(Errc code) noexcept;

/// JSON: {"ok":true,"result":...} on standard output; else "engage: done" and the mode that the daemon reported.
void print_success(bool json, const std::string& command, const std::string& result);
/// JSON: {"ok":false,"error":{...}} on standard output; else one sentence on standard error.
void print_failure(bool json, const std::string& code, const std::string& message);
/// One sentence on standard error; returns `exit_code`.
[[nodiscard]] int fail(const Error& error, int exit_code);
/// The same for a file that cannot be read or written: kExitPermission or kExitFailed.
[[nodiscard]] int fail_file(const Error& error);

}  // namespace embody::ctl
