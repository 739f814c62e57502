// embodyctl onboard: a hand file for any robot hand from its URDF.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "core/embodiment/onboarding.hpp"
#include "daemon/control/exit_code.hpp"
#include "daemon/ctl/answer.hpp"
#include "daemon/ctl/command.hpp"
#include "daemon/ctl/offline.hpp"
#include "daemon/ctl/status_table.hpp"
#include "daemon/evaluate/onboard_toml.hpp"
#include "drivers/transport/file.hpp"

namespace embody::ctl {
namespace {

struct Options {
  std::string urdf;
  std::string output;
  std::string name;
  bool force{false};
  std::optional<std::string> json_file;
};

/// `urdf` as the hand file at `output` has to name it.
std::string beside(const std::string& urdf, const std::string& output) {
  std::error_code error;
  const auto folder = std::filesystem::weakly_canonical(output, error).parent_path();
  const auto file = error ? std::filesystem::path() : std::filesystem::weakly_canonical(urdf, error);
  if (error) return urdf;
  const auto relative = file.lexically_relative(folder);
  return relative.empty() ? file.string() : relative.string();
}

int run(Options options) {
  const auto text = transport::load_text(options.urdf, robot::kMaxUrdfBytes, "a robot model (.urdf)");
  if (!text) return fail_file(text.error());
  const Result<robot::RobotModel> model = robot::load_urdf(*text);
  if (!model) return fail(model.error(), kExitFailed);
  if (options.output.empty()) {
    options.output = std::filesystem::path(options.urdf).stem().string() + ".toml";
  }
  if (const int code = check_outputs(options.output, options.json_file, options.force); code != kExitOk) return code;

  OnboardingOptions onboard;
  onboard.name = options.name;
  onboard.urdf = beside(options.urdf, options.output);
  const Result<Onboarding> onboarding = onboard_hand(*model, onboard);
  if (!onboarding) return fail(onboarding.error(), kExitFailed);
  const std::string toml = evaluate::onboard_toml(*onboarding, options.urdf);
  if (const Status saved = transport::save_text(toml, options.output, options.force); !saved) {
    return fail_file(saved.error());
  }
  std::printf("%swritten to %s; in the configuration: [hand] file = \"...\"\n",
              evaluate::onboard_text(*model, *onboarding).c_str(), printable(options.output).c_str());
  if (!options.json_file) return kExitOk;
  const std::string json = evaluate::onboard_json(*model, *onboarding) + "\n";
  const Status saved = transport::save_text(json, *options.json_file, options.force);
  return saved ? kExitOk : fail_file(saved.error());
}

}  // namespace

void add_onboard_command(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<Options>();  // lives in the callback
  CLI::App* command =
      app.add_subcommand("onboard", "Propose a hand file for any robot hand from its URDF, with a score card");
  command->add_option("HAND", options->urdf, "Robot description of the hand (.urdf)")->required();
  command->add_option("--output", options->output, "Hand file to write (default: HAND.toml in this folder)");
  command->add_option("--name", options->name, "Name of the hand, for people (default: the URDF's)");
  command->add_flag("--force", options->force, "Replace the files if they exist");
  command->add_option("--json", options->json_file, "Also write the figures to this file");
  command->callback([options, &exit_code] { exit_code = run(*options); });
}

}  // namespace embody::ctl
