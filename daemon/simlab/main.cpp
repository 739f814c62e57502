// embody-sim: the simulated lab.
#include <CLI/CLI.hpp>
#include <cmath>
#include <csignal>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>

#include "core/hand/synthetic_motion.hpp"
#include "daemon/app/config_io.hpp"
#include "daemon/app/signals.hpp"
#include "daemon/app/version.hpp"
#include "daemon/control/exit_code.hpp"
#include "daemon/simlab/demo_recording.hpp"
#include "daemon/simlab/lab.hpp"
#include "daemon/simlab/lab_run.hpp"
#include "daemon/simlab/landmark_sender.hpp"
#include "drivers/recording/tsv_recording.hpp"

namespace {

using namespace embody;
using nlohmann::json;

void say(const json& event) {
  std::cout << event.dump(-1, ' ', false, json::error_handler_t::replace) << std::endl;
}

int fail(const Error& error) {
  std::cerr << "embody-sim: " << error.detail.view() << "\n";
  switch (error.code) {
    case Errc::kPermission:
      return kExitPermission;
    case Errc::kInvalidArgument:
      return kExitConfiguration;
    default:
      return kExitFailed;
  }
}

struct RunOptions {
  std::string config_file;
  sim::LabConfig lab;
  sim::LabRunOptions run;
};

int run_lab(const RunOptions& options) {
  StopSignals signals;
  const Result<std::filesystem::path> path = config::find_config(options.config_file);
  if (!path) return fail(path.error());
  const Result<config::EmbodyConfig> config = config::load_config(*path);
  if (!config) return fail(config.error()), kExitConfiguration;
  Result<std::unique_ptr<sim::Lab>> lab = sim::Lab::create(*config, options.lab);
  if (!lab) return fail(lab.error());
  if (const Status status = (*lab)->start(); !status) return fail(status.error());
  const Status ended = sim::run_lab(**lab, signals, options.run);
  return ended ? kExitOk : fail(ended.error());
}

int generate(const std::string& output, double duration_s, std::uint64_t seed) {
  const Status saved = recording::save_tsv(sim::make_demo_recording(duration_s, seed), output);
  return saved ? kExitOk : fail(saved.error());
}

/// What `embody-sim landmarks` sends.
struct LandmarkOptions {
  std::string recording;
  double duration_s{sim::kDemoDuration_s};
  std::uint64_t seed{sim::kDemoSeed};
  sim::LandmarkSenderConfig sender;
};

int send_landmarks(LandmarkOptions options) {
  StopSignals signals;
  Result<sim::LandmarkRecording> recording =
      options.recording.empty() ? sim::make_landmarks(options.sender.rate_hz, options.duration_s, options.seed)
                                : sim::load_landmarks(options.recording);
  if (!recording) return fail(recording.error());
  say({{"event", "ready"},
       {"port", options.sender.port},
       {"frames", recording->size()},
       {"rate_hz", options.sender.rate_hz}});
  const auto report = sim::send_landmarks(std::move(*recording), options.sender, signals);
  if (!report) return fail(report.error());
  say({{"event", "playback_finished"}, {"sent", report->sent}, {"unheard", report->unheard}});
  return kExitOk;
}

/// As CLI::Range, which takes "nan" for a number in range.
CLI::Validator between(double low, double high) {
  const CLI::Range range(low, high);
  return CLI::Validator(
      [range](std::string& text) {
        double value = 0.0;
        const bool number = CLI::detail::lexical_cast(text, value) && std::isfinite(value);
        return number ? range(text) : "Value " + text + " is not a number";
      },
      range.get_description());
}

void add_landmark_options(CLI::App& command, LandmarkOptions& options) {
  command.add_option("recording", options.recording, "Table of landmarks (CSV) to send; without it a motion is made");
  command.add_option("--rate", options.sender.rate_hz, "Frames per second")
      ->check(between(1.0, 1000.0))
      ->capture_default_str();
  command.add_option("--host", options.sender.host, "IPv4 address to send to")->capture_default_str();
  command.add_option("--port", options.sender.port, "UDP port to send to")
      ->check(CLI::Range(1, 65535))
      ->capture_default_str();
  command.add_option("--duration", options.duration_s, "Seconds of the motion that is made")
      ->check(between(1.0, 600.0));
  command.add_option("--seed", options.seed, "Seed of its noise");
  command.add_flag("--loop", options.sender.loop, "Begin again after the last frame, until a signal");
}

void add_run_options(CLI::App& command, RunOptions& options) {
  sim::LabConfig& lab = options.lab;
  command.add_option("recording", lab.recording, "QTM export (TSV) to play")->required();
  command.add_option("--config", options.config_file,
                     "Configuration of the cell, the hand and the models (as embodyd)");
  command.add_option("--duration", lab.duration_s, "Play only so many seconds")->check(CLI::PositiveNumber);
  command.add_flag("--loop", lab.loop, "Begin again after the last frame, for ever");
  command.add_option("--address", lab.address, "IPv4 address to listen on")->capture_default_str();
  command.add_option("--qtm-port", lab.qtm_port, "TCP port of the QTM server; 0 takes a free one");
  command.add_option("--ur-port", lab.ur_port, "TCP port of the UR controller; 0 takes a free one");
  command.add_option("--ur-primary-port", lab.ur_primary_port, "TCP port in place of the controller's 30001");
  command.add_option("--ur-dashboard-port", lab.ur_dashboard_port, "TCP port in place of the controller's 29999");
  command.add_option("--mia-link,--hand-link", lab.mia_link, "Create a symlink to the hand's pseudo-terminal here");
  const std::map<std::string, mia::Generation> generations{{"acknowledging", mia::Generation::kAcknowledging},
                                                           {"streaming", mia::Generation::kStreaming}};
  command
      .add_option_function<std::string>(
          "--mia-protocol", [&lab, generations](const std::string& name) { lab.mia_generation = generations.at(name); },
          "Firmware of a Mia: acknowledging or streaming (default: what the configuration expects)")
      ->check(CLI::IsMember({"acknowledging", "streaming"}));
  command.add_flag("--wait", options.run.wait_for_play, "Play only when told to");
  command.add_option("--faults", options.run.fault_script, "File of faults and when they happen");
  CLI::Option* socket =
      command.add_option("--socket", options.run.socket, "Socket for 'embodyctl sim' (default: a personal one)");
  command.add_flag("--no-socket", options.run.no_socket, "Listen to standard input only")->excludes(socket);
}

int run_program(int argc, char** argv) {
  CLI::App app{"The simulated lab of embody: QTM server, UR controller and robot hand with real bytes on loopback."};
  app.set_version_flag("--version", std::string("embody-sim ") + kVersion);
  app.require_subcommand(1);

  RunOptions run;
  CLI::App* run_command =
      app.add_subcommand("run", "Start the three devices and play a recording once, as soon as all of them are in use");
  add_run_options(*run_command, run);

  std::string output;
  double duration_s = sim::kDemoDuration_s;
  std::uint64_t seed = sim::kDemoSeed;
  CLI::App* generate_command = app.add_subcommand("generate", "Write the demo recording: reach, grasp, lift, place");
  generate_command->add_option("output", output, "TSV file to write")->required();
  generate_command->add_option("--duration", duration_s, "Length in seconds")->check(between(5.0, 600.0));
  generate_command->add_option("--seed", seed, "Seed of noise and drop-outs");

  LandmarkOptions landmarks;
  CLI::App* landmarks_command =
      app.add_subcommand("landmarks", "Send hand landmarks as a camera-based tracker would (docs/landmarks.md)");
  add_landmark_options(*landmarks_command, landmarks);

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kExitOk : kExitUsage;
  }
  if (*landmarks_command) return send_landmarks(landmarks);
  return *generate_command ? generate(output, duration_s, seed) : run_lab(run);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run_program(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "embody-sim: %s\n", error.what());
    return kExitFailed;
  }
}
