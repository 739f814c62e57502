// embodyctl calibrate: hand shape, marker places and the pose of the hand under the glove from ten seconds of motion.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <ctime>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "daemon/app/config_io.hpp"
#include "daemon/app/devices.hpp"
#include "daemon/control/exit_code.hpp"
#include "daemon/ctl/answer.hpp"
#include "daemon/ctl/collect_frames.hpp"
#include "daemon/ctl/command.hpp"
#include "daemon/ctl/offline.hpp"
#include "daemon/ctl/status_table.hpp"
#include "daemon/evaluate/calibration_report.hpp"
#include "daemon/evaluate/recorded_frames.hpp"
#include "drivers/recording/tsv_recording.hpp"
#include "drivers/transport/file.hpp"

namespace embody::ctl {
namespace {

struct Options {
  std::string recording;
  std::string frames;
  std::string config;
  int duration_s{10};
  std::string output{"subject.toml"};
  bool force{false};
  std::optional<std::string> json_file;
};

/// What is calibrated from, or the exit code of what went wrong (and was said).
struct Source {
  std::vector<MarkerFrame> frames;
  std::string name;
  int exit_code{kExitOk};
};

int fail_device(const Error& error) {
  return fail(error, error.code == Errc::kTimeout ? kExitUnavailable : exit_code_of(error.code));
}

Source read_recording(const Options& options, const hand::GloveLayout& layout) {
  Source source;
  evaluate::FrameRange range;
  if (!options.frames.empty()) {
    const auto parsed = evaluate::parse_frame_range(options.frames);
    if (!parsed) return {{}, {}, fail(parsed.error(), kExitUsage)};
    range = *parsed;
  }
  const auto recording = recording::load_tsv(options.recording);
  if (!recording) return {{}, {}, fail_file(recording.error())};
  auto frames = evaluate::marker_frames(*recording, layout, range);
  if (!frames) {
    return {{}, {}, fail(frames.error(), frames.error().code == Errc::kInvalidArgument ? kExitUsage : kExitFailed)};
  }
  source.name = printable(options.recording) + ", frames " + std::to_string(frames->front().frame_number) + " to " +
                std::to_string(frames->back().frame_number);
  source.frames = std::move(*frames);
  return source;
}

Source record_live(const Options& options, const config::EmbodyConfig& config, const hand::GloveLayout& layout) {
  StopSignals signals;
  const std::unique_ptr<HandTracker> tracker = make_tracker(config);
  CollectOptions collect;
  collect.duration = std::chrono::seconds(options.duration_s);
  auto collected = collect_frames(*tracker, layout, collect, signals);
  if (!collected) return {{}, {}, fail_device(collected.error())};
  if (collected->interrupted) {
    std::fprintf(stderr, "embodyctl: interrupted; nothing was written\n");
    return {{}, {}, kExitInterrupted};
  }
  signals.restore();  // from now on Ctrl-C ends the program; nothing is half written
  std::printf("Done: %zu frames. Calculating ...\n", collected->frames.size());
  std::fflush(stdout);
  return {std::move(collected->frames),
          "the tracker at " + printable(config.tracker.host) + ", " + std::to_string(options.duration_s) + " s"};
}

std::string date_now() {
  const std::time_t t = std::time(nullptr);
  std::tm local{};
  ::localtime_r(&t, &local);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%d %H:%M", &local);
  return text;
}

int run(const Options& options) {
  const auto path = config::find_config(options.config);
  if (!path) return fail(path.error(), kExitConfiguration);
  const auto config = config::load_config(*path);
  if (!config) return fail(config.error(), kExitConfiguration);
  if (config->tracker.driver != config::TrackerDriver::kQualisys) {
    std::fprintf(stderr, "embodyctl: calibrate is for marker gloves: set tracker.driver = \"qualisys\"\n");
    return kExitConfiguration;
  }
  const auto nominal = make_operator_models(evaluate::nominal_config(*config));
  if (!nominal) return fail(nominal.error(), kExitConfiguration);
  if (const int code = check_outputs(options.output, options.json_file, options.force); code != kExitOk) return code;

  const Source source = options.recording.empty() ? record_live(options, *config, nominal->layout)
                                                  : read_recording(options, nominal->layout);
  if (source.exit_code != kExitOk) return source.exit_code;
  const auto calibration =
      hand::calibrate(source.frames, nominal->layout, nominal->data, nominal->points, nominal->X_HM);
  if (!calibration) return fail(calibration.error(), kExitFailed);
  const config::SubjectConfig subject = evaluate::calibrated_subject(*calibration, nominal->layout, config->subject);
  if (const std::string why = subject.problem(); !why.empty()) {
    return fail(make_error(Errc::kInvalidArgument,
                           "nothing was written, no hand is like that: %s; move the fingers more", why.c_str()),
                kExitFailed);
  }
  const auto residuals = evaluate::residual_change(*config, subject, source.frames);
  if (!residuals) return fail(residuals.error(), kExitConfiguration);

  const std::string text = evaluate::subject_file(subject, *calibration, *residuals, source.name, date_now());
  if (const Status saved = transport::save_text(text, options.output, options.force); !saved)
    return fail_file(saved.error());
  std::printf("%s", evaluate::calibration_text(*calibration, *nominal, *residuals).c_str());
  std::printf("written to %s; in the configuration: [subject] file = \"...\"\n", printable(options.output).c_str());
  if (!options.json_file) return kExitOk;
  const std::string json = evaluate::calibration_json(*calibration, *nominal, subject, *residuals) + "\n";
  if (const Status saved = transport::save_text(json, *options.json_file, options.force); !saved)
    return fail_file(saved.error());
  return kExitOk;
}

}  // namespace

void add_calibrate_command(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<Options>();  // lives in the callback
  CLI::App* command = app.add_subcommand(
      "calibrate", "Find hand shape, marker places and the hand's pose under the glove from free finger motion");
  CLI::Option* recording = command->add_option(
      "RECORDING", options->recording, "Motion export of Qualisys Track Manager (.tsv); without it: the live tracker");
  command->add_option("--frames", options->frames, "First and last frame of the recording, counted from 1, like 1-1000")
      ->needs(recording);
  command->add_option("--config", options->config, "Configuration file (default: the one that embodyd would use)");
  command->add_option("--duration", options->duration_s, "Live: seconds to collect (10)")
      ->check(CLI::Range(2, 120))
      ->excludes(recording);
  command->add_option("--output", options->output, "Subject file to write (subject.toml)");
  command->add_flag("--force", options->force, "Replace the files if they exist");
  command->add_option("--json", options->json_file, "Also write the figures to this file");
  command->callback([options, &exit_code] { exit_code = run(*options); });
}

}  // namespace embody::ctl
