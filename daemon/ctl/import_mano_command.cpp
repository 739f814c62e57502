// embodyctl import-mano: checks a user's own MANO model and puts it where the daemon finds it.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "daemon/control/exit_code.hpp"
#include "daemon/ctl/answer.hpp"
#include "daemon/ctl/command.hpp"
#include "daemon/ctl/status_table.hpp"
#include "drivers/mano/mano_file.hpp"

namespace embody::ctl {
namespace {

struct Options {
  std::string input;
  std::string output;
  bool force{false};
  bool json{false};
};

int fail(const Error& error, bool json) {
  const Errc code = error.code == Errc::kNotFound ? Errc::kIo : error.code;  // a file, not a device
  print_failure(json, code_of(code), std::string(error.detail.view()));
  return exit_code_of(code);
}

/// $XDG_DATA_HOME/embody/mano_<side>.json (XDG Base Directory Specification 0.8).
Result<std::string> default_output(const char* side) {
  const auto absolute = [](const char* name) -> std::string {
    const char* value = std::getenv(name);
    return value != nullptr && value[0] == '/' ? value : "";
  };
  std::string folder = absolute("XDG_DATA_HOME");
  if (folder.empty()) {
    const std::string home = absolute("HOME");
    if (home.empty())
      return make_error(Errc::kInvalidArgument, "neither $XDG_DATA_HOME nor $HOME is set; use --output");
    folder = home + "/.local/share";
  }
  return folder + "/embody/mano_" + side + ".json";
}

int run_import(const Options& options) {
  const auto model = mano::load_model(options.input);
  if (!model) return fail(model.error(), options.json);
  const char* side = model->side == Side::kRight ? "right" : "left";
  std::string path = options.output;
  if (path.empty()) {
    const auto found = default_output(side);
    if (!found) return fail(found.error(), options.json);
    path = *found;
  }
  std::error_code ignored;
  const auto absolute = std::filesystem::absolute(path, ignored);
  if (!ignored) path = absolute.lexically_normal().string();
  if (const auto saved = mano::save_model(*model, path, options.force); !saved)
    return fail(saved.error(), options.json);

  const hand::HandData data = mano::hand_data(*model, path);
  const double length_m = (data.tips_M.col(static_cast<int>(Finger::kMiddle)) - data.joints_M.col(0)).norm();
  const auto replace = nlohmann::json::error_handler_t::replace;
  const std::string line = "model = " + nlohmann::json(path).dump(-1, ' ', true, replace);  // a TOML string as well
  if (options.json) {
    const nlohmann::ordered_json result{{"side", side},
                                        {"vertices", model->template_M.cols()},
                                        {"triangles", model->triangles.cols()},
                                        {"hand_length_m", length_m},
                                        {"file", path},
                                        {"subject_line", line}};
    print_success(true, "import-mano", result.dump(-1, ' ', true, replace));
    return kExitOk;
  }
  std::printf(
      "%s hand, %td vertices, %td triangles, %.1f mm from wrist to middle finger tip\nwritten to %s\n"
      "For a person with this hand, put into the subject file:\n  %s\n",
      side, static_cast<std::ptrdiff_t>(model->template_M.cols()), static_cast<std::ptrdiff_t>(model->triangles.cols()),
      1e3 * length_m, printable(path).c_str(), line.c_str());
  return kExitOk;
}

}  // namespace

void add_import_mano_command(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand("import-mano", "Check your own MANO hand model and keep it for subject files");
  command->add_option("FILE", options->input, "MANO model: .json of hand_embodiment or .npz of smplx")->required();
  command->add_option("--output", options->output,
                      "Where to write it (default: $XDG_DATA_HOME/embody/mano_left.json or mano_right.json)");
  command->add_flag("--force", options->force, "Replace the file if it exists");
  command->add_flag("--json", options->json, "Print JSON");
  command->callback([options, &exit_code] { exit_code = run_import(*options); });
}

}  // namespace embody::ctl
