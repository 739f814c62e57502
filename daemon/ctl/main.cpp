// embodyctl: control client of embodyd, and its offline tools.
#include <CLI/CLI.hpp>
#include <array>
#include <cstdio>
#include <exception>
#include <string>
#include <vector>

#include "daemon/control/exit_code.hpp"
#include "daemon/ctl/command.hpp"

namespace {

constexpr std::array kCommands{
    embody::ctl::Command{&embody::ctl::add_control_commands},
    embody::ctl::Command{&embody::ctl::add_markers_command},
    embody::ctl::Command{&embody::ctl::add_demo_command},
    embody::ctl::Command{&embody::ctl::add_import_mano_command},
    embody::ctl::Command{&embody::ctl::add_calibrate_command},
    embody::ctl::Command{&embody::ctl::add_evaluate_command},
    embody::ctl::Command{&embody::ctl::add_convert_command},
    embody::ctl::Command{&embody::ctl::add_onboard_command},
    embody::ctl::Command{&embody::ctl::add_capture_command},
    embody::ctl::Command{&embody::ctl::add_discover_command},
    embody::ctl::Command{&embody::ctl::add_arm_command},
    embody::ctl::Command{&embody::ctl::add_hand_command},
    embody::ctl::Command{&embody::ctl::add_sim_command},
};

constexpr const char* kFooter =
    "Exit codes: 0 done, 1 failed, 2 usage, 3 refused in this mode, 4 the robot did not follow,\n"
    "69 daemon or device not there, 77 not permitted, 78 configuration, 130 interrupted.";

/// A subcommand is missing where a word stands that is none: CLI11 says the first only. Empty: no word.
std::string misplaced_word(const CLI::App& app) {
  const CLI::App* command = &app;
  while (!command->get_subcommands().empty()) command = command->get_subcommands().front();
  const std::vector<std::string> words = command->remaining();
  return words.empty() ? "" : words.front();
}

int run(int argc, char** argv) {
  int exit_code = embody::kExitOk;
  CLI::App app("Controls embodyd, the daemon that lets a person drive a robot arm and hand with their own hand.");
  app.set_version_flag("--version", "embodyctl " EMBODY_VERSION);
  app.require_subcommand(0, 1);
  app.footer(kFooter);
  for (const auto& command : kCommands) command.add(app, exit_code);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    const std::string word = error.get_name() == "RequiredError" ? misplaced_word(app) : "";
    if (!word.empty()) std::fprintf(stderr, "'%.60s' is not one of its subcommands\n", word.c_str());
    return app.exit(error) == 0 ? embody::kExitOk : embody::kExitUsage;
  }
  if (!app.get_subcommands().empty()) return exit_code;
  std::fputs(app.help().c_str(), stderr);
  return embody::kExitUsage;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "embodyctl: %s\n", error.what());
    return embody::kExitFailed;
  }
}
