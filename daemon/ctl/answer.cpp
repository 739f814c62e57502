#include "daemon/ctl/answer.hpp"

#include <cstdio>
#include <nlohmann/json.hpp>

#include "daemon/control/protocol.hpp"
#include "daemon/ctl/status_table.hpp"

namespace embody::ctl {

ExitCode exit_code_of(std::string_view code) noexcept {
  if (code == control::code::kRefused) return kExitRefused;
  if (code == control::code::kNotFollowing) return kExitNotFollowing;
  if (code == control::code::kUnavailable) return kExitUnavailable;
  return kExitFailed;
}

ExitCode exit_code_of(Errc code) noexcept {
  switch (code) {
    case Errc::kDisconnected:
    case Errc::kNotFound:
      return kExitUnavailable;
    case Errc::kPermission:
      return kExitPermission;
    default:
      return kExitFailed;
  }
}

const char* code_of(Errc code) noexcept {
  switch (code) {
    case Errc::kDisconnected:
    case Errc::kNotFound:
      return control::code::kUnavailable;
    case Errc::kPermission:
      return "permission";
    case Errc::kTimeout:
      return "timeout";
    default:
      return control::code::kFailed;
  }
}

void print_success(bool json, const std::string& command, const std::string& result) {
  const auto value = nlohmann::ordered_json::parse(result, nullptr, false);
  if (json) {
    std::printf("%s\n", nlohmann::ordered_json{{"ok", true}, {"result", value}}.dump().c_str());
    return;
  }
  std::string mode;
  if (value.is_object() && value.contains("mode") && value["mode"].is_string()) {
    mode = ", mode " + printable(value["mode"].get<std::string>());
  }
  std::printf("%s: done%s\n", command.c_str(), mode.c_str());
}

void print_failure(bool json, const std::string& code, const std::string& message) {
  if (json) {
    const nlohmann::ordered_json line{{"ok", false}, {"error", {{"code", code}, {"message", message}}}};
    std::printf("%s\n", line.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace).c_str());
    return;
  }
  std::fprintf(stderr, "embodyctl: %s\n", printable(message.empty() ? code : message).c_str());
}

int fail(const Error& error, int exit_code) {
  print_failure(false, code_of(error.code), std::string(error.detail.view()));
  return exit_code;
}

int fail_file(const Error& error) {
  return fail(error, error.code == Errc::kPermission ? kExitPermission : kExitFailed);
}

}  // namespace embody::ctl
