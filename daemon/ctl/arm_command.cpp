// embodyctl arm: what a person in front of the robot asks of its dashboard server. Nothing here is done by the daemon.
#include <CLI/CLI.hpp>
#include <array>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "daemon/app/config_io.hpp"
#include "daemon/control/exit_code.hpp"
#include "daemon/control/protocol.hpp"
#include "daemon/ctl/answer.hpp"
#include "daemon/ctl/command.hpp"
#include "drivers/ur_rtde/dashboard.hpp"
#include "drivers/ur_rtde/status_text.hpp"

namespace embody::ctl {
namespace {

struct Options {
  std::string config;
  std::string text;
  bool json{false};
};

std::atomic<bool> interrupted{false};

Status bring_up(ur::Dashboard& arm) {
  std::signal(SIGINT, [](int) { interrupted = true; });
  return arm.bring_up({}, [] { return interrupted.load(); });
}

struct Action {
  const char* name;
  const char* help;
  Status (*run)(ur::Dashboard& arm, const Options& options);
};

constexpr std::array kActions{
    Action{"power-on", "Power the arm; its brakes stay closed",
           [](ur::Dashboard& arm, const Options&) { return arm.power_on(); }},
    Action{"power-off", "Close the brakes and take the power off",
           [](ur::Dashboard& arm, const Options&) { return arm.power_off(); }},
    Action{"release-brakes", "Release the brakes: the arm may move a little",
           [](ur::Dashboard& arm, const Options&) { return arm.release_brakes(); }},
    Action{"bring-up", "Power on, wait, release the brakes, wait until the robot runs",
           [](ur::Dashboard& arm, const Options&) { return bring_up(arm); }},
    Action{"unlock", "Release a protective stop, after you have looked for its cause",
           [](ur::Dashboard& arm, const Options&) { return arm.unlock_protective_stop(); }},
    Action{"close-popup", "Close a popup on the teach pendant",
           [](ur::Dashboard& arm, const Options&) { return arm.close_popup(); }},
    Action{"close-safety-popup", "Close a safety popup on the teach pendant",
           [](ur::Dashboard& arm, const Options&) { return arm.close_safety_popup(); }},
    Action{"stop-program", "Stop the program that plays on the robot",
           [](ur::Dashboard& arm, const Options&) { return arm.stop_program(); }},
};

Result<ur::Dashboard> open(const Options& options) {
  const auto path = config::find_config(options.config);
  if (!path) return path.error();
  const auto config = config::load_config(*path);
  if (!config) return config.error();
  ur::DashboardConfig dashboard;
  dashboard.host = config->arm.host;
  dashboard.port = static_cast<std::uint16_t>(config->arm.dashboard_port);
  return ur::Dashboard(dashboard);
}

int fail(const Error& error, const Options& options) {
  const bool refused = error.code == Errc::kRefused;  // by the robot, as it is now
  print_failure(options.json, refused ? control::code::kRefused : code_of(error.code),
                std::string(error.detail.view()));
  if (refused) return kExitRefused;
  return interrupted ? kExitInterrupted : exit_code_of(error.code);
}

int act(const Action& action, const Options& options) {
  auto arm = open(options);
  if (!arm) return fail(arm.error(), options);
  const Status done = action.run(*arm, options);
  if (!done) return fail(done.error(), options);
  print_success(options.json, action.name, "{}");
  return kExitOk;
}

int show(const Options& options) {
  auto arm = open(options);
  if (!arm) return fail(arm.error(), options);
  const auto mode = arm->robot_mode();
  if (!mode) return fail(mode.error(), options);
  const auto safety = arm->safety_status();
  if (!safety) return fail(safety.error(), options);
  const auto remote = arm->in_remote_control();  // not on every controller, as what follows
  const auto version = arm->polyscope_version();
  const auto serial = arm->serial_number();
  nlohmann::json json{{"robot_mode", rtde::robot_mode_text(*mode)}, {"safety", rtde::safety_text(*safety)}};
  if (remote) json["remote_control"] = *remote;
  if (version) json["version"] = *version;
  if (serial) json["serial_number"] = *serial;
  if (options.json) {
    std::printf("%s\n", json.dump().c_str());
    return kExitOk;
  }
  for (const auto& [key, value] : json.items()) {
    std::printf("%-15s %s\n", key.c_str(), value.is_string() ? value.get<std::string>().c_str() : value.dump().c_str());
  }
  return kExitOk;
}

CLI::App* add(CLI::App& app, const char* name, const char* help, Options& options) {
  CLI::App* command = app.add_subcommand(name, help);
  command->add_option("--config", options.config, "Configuration of embodyd, for the robot's address");
  command->add_flag("--json", options.json, "Print JSON");
  return command;
}

}  // namespace

void add_arm_command(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<Options>();
  CLI::App* arm = app.add_subcommand("arm", "Power, brakes and stops of the robot arm, by its dashboard server");
  arm->require_subcommand(1);
  add(*arm, "status", "Robot mode, safety status, version", *options)->callback([options, &exit_code] {
    exit_code = show(*options);
  });
  for (const Action& action : kActions) {
    add(*arm, action.name, action.help, *options)->callback([options, &exit_code, &action] {
      exit_code = act(action, *options);
    });
  }
}

}  // namespace embody::ctl
