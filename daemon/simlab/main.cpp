// embody-sim: the simulated lab. Events go to standard output and commands come from standard input, one per line, so
// that a demo, a test or a person can drive it.
#include <poll.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <csignal>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>

#include "core/hand/synthetic_motion.hpp"
#include "daemon/app/config_io.hpp"
#include "daemon/app/signals.hpp"
#include "daemon/app/version.hpp"
#include "daemon/control/exit_code.hpp"
#include "daemon/simlab/demo_recording.hpp"
#include "daemon/simlab/lab.hpp"
#include "daemon/simlab/landmark_sender.hpp"
#include "drivers/recording/tsv_recording.hpp"

namespace {

using namespace embody;
using nlohmann::json;

void say(const json& event) {
  std::cout << event.dump() << std::endl;
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

/// Waits for lines on standard input; keeps what follows the last newline.
class Commands {
 public:
  /// Complete lines so far; false at the end of the input.
  bool read(std::vector<std::string>& lines) {
    char chunk[512];
    const ssize_t size = ::read(STDIN_FILENO, chunk, sizeof chunk);
    if (size <= 0) return false;
    text_.append(chunk, static_cast<std::size_t>(size));
    for (std::size_t end = text_.find('\n'); end != std::string::npos; end = text_.find('\n')) {
      lines.push_back(text_.substr(0, end));
      text_.erase(0, end + 1);
    }
    if (text_.size() > 4096) text_.clear();
    return true;
  }

 private:
  std::string text_;
};

void obey(sim::Lab& lab, const std::string& line, bool& quit) {
  if (line == "play") return lab.play();
  if (line == "quit") {
    quit = true;
  } else if (line == "report") {
    say({{"event", "report"}, {"report", json::parse(lab.report_json())}});
  } else if (!line.empty()) {
    if (const Status status = lab.fault(line); !status) {
      say({{"event", "error"}, {"message", status.error().detail.view()}});
    } else {
      say({{"event", "fault"}, {"fault", line}});
    }
  }
}

int run(sim::Lab& lab, StopSignals& signals, bool wait_for_play) {
  say({{"event", "ready"},
       {"qtm_port", lab.qtm_port()},
       {"ur_port", lab.ur().port()},
       {"ur_primary_port", lab.ur().primary_port()},
       {"ur_dashboard_port", lab.ur().dashboard_port()},
       {"mia_device", lab.mia_device()},
       {"frames", lab.frame_count()},
       {"rate_hz", lab.rate_hz()}});
  Commands commands;
  bool in_use = false;
  bool finished = false;
  bool quit = false;
  bool input_open = true;
  while (!quit) {
    pollfd entries[2] = {{signals.fd(), POLLIN, 0}, {input_open ? STDIN_FILENO : -1, POLLIN, 0}};
    ::poll(entries, 2, in_use && !finished ? 2 : 20);
    if (signals.take() != 0) break;
    std::vector<std::string> lines;
    if (entries[1].revents != 0) input_open = commands.read(lines);
    for (const std::string& line : lines) obey(lab, line, quit);
    if (!in_use && lab.all_devices_in_use()) {
      in_use = true;
      say({{"event", "devices_in_use"}});
      if (!wait_for_play) lab.play();
    }
    if (!finished && lab.finished()) {
      finished = true;
      say({{"event", "playback_finished"}});
    }
  }
  signals.restore();
  say({{"event", "report"}, {"report", json::parse(lab.report_json())}});
  return kExitOk;
}

int run_lab(const std::string& config_file, const sim::LabConfig& lab_config, bool wait_for_play) {
  StopSignals signals;
  const Result<std::filesystem::path> path = config::find_config(config_file);
  if (!path) return fail(path.error());
  const Result<config::EmbodyConfig> config = config::load_config(*path);
  if (!config) return fail(config.error()), kExitConfiguration;
  Result<std::unique_ptr<sim::Lab>> lab = sim::Lab::create(*config, lab_config);
  if (!lab) return fail(lab.error());
  if (const Status status = (*lab)->start(); !status) return fail(status.error());
  return run(**lab, signals, wait_for_play);
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

int run_program(int argc, char** argv) {
  CLI::App app{"The simulated lab of embody: QTM server, UR10e controller and Mia hand with real bytes on loopback."};
  app.set_version_flag("--version", std::string("embody-sim ") + kVersion);
  app.require_subcommand(1);

  std::string config_file;
  sim::LabConfig lab;
  bool wait_for_play = false;
  CLI::App* run_command =
      app.add_subcommand("run", "Start the three devices and play a recording once, as soon as all of them are in use");
  run_command->add_option("recording", lab.recording, "QTM export (TSV) to play")->required();
  run_command->add_option("--config", config_file, "Configuration of the cell and the models (as for embodyd)");
  run_command->add_option("--duration", lab.duration_s, "Play only so many seconds")->check(CLI::PositiveNumber);
  run_command->add_option("--address", lab.address, "IPv4 address to listen on")->capture_default_str();
  run_command->add_option("--qtm-port", lab.qtm_port, "TCP port of the QTM server; 0 takes a free one");
  run_command->add_option("--ur-port", lab.ur_port, "TCP port of the UR controller; 0 takes a free one");
  run_command->add_option("--ur-primary-port", lab.ur_primary_port, "TCP port in place of the controller's 30001");
  run_command->add_option("--ur-dashboard-port", lab.ur_dashboard_port, "TCP port in place of the controller's 29999");
  run_command->add_option("--mia-link", lab.mia_link, "Create a symlink to the hand's pseudo-terminal here");
  run_command->add_flag("--wait", wait_for_play, "Play only after the line 'play' on standard input");

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
  return *generate_command ? generate(output, duration_s, seed) : run_lab(config_file, lab, wait_for_play);
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
