// embodyctl convert: recordings of a person's hand to trajectories of a robot hand.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "daemon/app/config_io.hpp"
#include "daemon/control/exit_code.hpp"
#include "daemon/convert/batch.hpp"
#include "daemon/convert/convert_job.hpp"
#include "daemon/convert/trajectory_columns.hpp"
#include "daemon/ctl/answer.hpp"
#include "daemon/ctl/command.hpp"
#include "daemon/ctl/offline.hpp"
#include "daemon/ctl/status_table.hpp"

namespace embody::ctl {
namespace {

namespace fs = std::filesystem;

struct Options {
  std::vector<std::string> recordings;
  std::string hand;
  std::string config;
  std::string subject;
  std::string output;
  std::string format;
  std::optional<double> rate_hz;
  std::string frames;
  convert::SegmentSource segments;
  std::vector<std::string> object;
  std::vector<std::string> fixed;
  bool filter{false};
  bool force{false};
  std::size_t threads{0};
};

/// The configuration with what the command line changes.
Result<config::EmbodyConfig> configuration(const Options& options) {
  Result<config::EmbodyConfig> config = offline_config(options.config, options.subject);
  if (!config) return config;
  if (!options.hand.empty()) {
    Result<config::HandConfig> hand = config::load_hand(options.hand);
    if (!hand) return hand.error();
    config->hand.embodiment = std::move(hand->embodiment);
    config->hand.embodiment.side = config->subject.side;
  }
  return config;
}

/// "JOINT=VALUE"
Result<convert::FixedJoint> parse_fixed(const std::string& text) {
  const auto equals = text.find('=');
  convert::FixedJoint joint;
  if (equals != std::string::npos && equals > 0 && convert::parse_number(text.substr(equals + 1), joint.value)) {
    joint.name = text.substr(0, equals);
    return joint;
  }
  return make_error(Errc::kInvalidArgument, "--fix '%.60s': give a joint and its value, like j_thumb_opp=-0.2",
                    text.c_str());
}

Result<convert::ConversionOptions> conversion_options(const Options& options, const std::string& hand) {
  convert::ConversionOptions conversion;
  conversion.hand = hand;
  conversion.rate_hz = options.rate_hz;
  conversion.object = options.object;
  conversion.filter = options.filter;
  if (!options.frames.empty()) {
    const auto range = evaluate::parse_frame_range(options.frames);
    if (!range) return range.error();
    conversion.range = *range;
  }
  for (const std::string& text : options.fixed) {
    const auto joint = parse_fixed(text);
    if (!joint) return joint.error();
    conversion.fixed.push_back(*joint);
  }
  return conversion;
}

Result<std::vector<convert::ConvertJob>> plan(const Options& options) {
  std::optional<convert::TextFormat> format;
  if (!options.format.empty()) format = convert::format_of("x." + options.format);
  auto jobs = convert::plan_jobs(options.recordings, options.output, format);
  if (!jobs) return jobs;
  const fs::path folder = fs::path(jobs->front().output).parent_path();
  if (jobs->size() == 1 && !options.output.ends_with('/')) return jobs;
  std::error_code failed;
  fs::create_directories(folder, failed);
  if (!failed) return jobs;
  return make_error(Errc::kPermission, "cannot make the folder %.100s: %s", folder.c_str(), failed.message().c_str());
}

void show_progress(double part, std::size_t files) {
  constexpr int kWidth = 40;
  const int done = static_cast<int>(part * kWidth);
  std::fprintf(stderr, "\r[%.*s%*s] %3.0f %% of %zu recording%s", done, "########################################",
               kWidth - done, "", 100.0 * part, files, files == 1 ? "" : "s");
  std::fflush(stderr);
}

/// Mean, 99 % and greatest time of a stage.
void print_stage(std::FILE* out, const char* name, std::vector<float> us) {
  if (us.empty()) return;
  std::sort(us.begin(), us.end());
  double sum_us = 0.0;
  for (const float t : us) sum_us += static_cast<double>(t);
  const double mean_us = sum_us / static_cast<double>(us.size());
  const auto p99 = static_cast<double>(us[(us.size() - 1) * 99 / 100]);
  std::fprintf(out, "  %-12s %9.2f %9.2f %9.2f %11.0f\n", name, mean_us, p99, static_cast<double>(us.back()),
               mean_us > 0.0 ? 1e6 / mean_us : 0.0);
}

void print_times(std::FILE* out, const convert::StageTimes& times) {
  std::vector<float> all_us(times.pose_us.size());
  for (std::size_t i = 0; i < all_us.size(); ++i) {
    all_us[i] = times.pose_us[i] + times.fingers_us[i] + times.embodiment_us[i];
  }
  std::fprintf(out, "CPU us per frame      mean       99%%      most  frames/s of one core\n");
  print_stage(out, "hand pose", times.pose_us);
  print_stage(out, "fingers", times.fingers_us);
  print_stage(out, "embodiment", times.embodiment_us);
  print_stage(out, "all", all_us);
}

void print_report(std::FILE* out, const convert::ConvertJob& job, const convert::JobReport& report) {
  const convert::Conversion& conversion = report.conversion;
  const std::size_t files = report.outputs.size();
  std::fprintf(out, "%s: %zu frames, %zu rows in %s%s\n", printable(job.recording).c_str(), conversion.frames,
               report.rows, printable(report.outputs.front()).c_str(),
               files == 1 ? "" : (" and " + std::to_string(files - 1) + " more").c_str());
  if (conversion.frames_without_hand > 0) {
    std::fprintf(out, "  %zu frames without the hand: the last known one, marked as not valid\n",
                 conversion.frames_without_hand);
  }
  if (conversion.frames_without_object > 0) {
    std::fprintf(out, "  %zu frames without the object: where it was last seen\n", conversion.frames_without_object);
  }
}

int exit_code_of_job(const Error& error, std::size_t jobs) {
  if (jobs > 1) return kExitFailed;
  if (error.code == Errc::kInvalidArgument) return kExitUsage;
  return error.code == Errc::kPermission ? kExitPermission : kExitFailed;
}

/// Converts everything and reports in the order of the command line.
int convert_all(const Options& options, const Models& models, const std::vector<convert::ConvertJob>& jobs,
                const convert::ConversionOptions& conversion) {
  const std::size_t cores = std::max(1U, std::thread::hardware_concurrency());
  const std::size_t threads = std::min(jobs.size(), options.threads == 0 ? cores : options.threads);
  std::vector<std::optional<Result<convert::JobReport>>> results(jobs.size());
  const auto work = [&](std::size_t i, const convert::Progress& progress) {
    try {
      convert::ConversionOptions own = conversion;
      own.progress = progress;
      results[i] = convert::run_job(models, jobs[i], options.segments, own, options.force);
    } catch (const std::exception& error) {
      results[i] = make_error(Errc::kIo, "%.100s: %s", jobs[i].recording.c_str(), error.what());
    }
  };
  const bool terminal = ::isatty(STDERR_FILENO) == 1;
  const auto tick = [&](double part) { show_progress(part, jobs.size()); };
  const auto start = std::chrono::steady_clock::now();
  convert::run_batch(jobs.size(), threads, work, terminal ? convert::Progress(tick) : convert::Progress());
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - start;
  if (terminal) std::fprintf(stderr, "\r\033[K");

  std::FILE* out = options.output.starts_with("/dev/") ? stderr : stdout;  // not among the numbers
  int exit_code = kExitOk;
  convert::StageTimes times;
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    const Result<convert::JobReport>& result = *results[i];
    if (!result) {
      exit_code = fail(result.error(), exit_code_of_job(result.error(), jobs.size()));
      continue;
    }
    print_report(out, jobs[i], *result);
    times.add(result->conversion.times);
  }
  if (times.pose_us.empty()) return exit_code;
  print_times(out, times);
  std::fprintf(out, "%zu frames in %.2f s on %zu thread%s, files included: %.0f frames/s\n", times.pose_us.size(),
               wall.count(), threads, threads == 1 ? "" : "s",
               static_cast<double>(times.pose_us.size()) / wall.count());
  return exit_code;
}

int run(const Options& options) {
  const auto config = configuration(options);
  if (!config) return fail(config.error(), kExitConfiguration);
  const Result<Models> models = make_models(*config);
  if (!models) return fail(models.error(), kExitConfiguration);
  const auto conversion = conversion_options(options, config->hand.embodiment.name);
  if (!conversion) return fail(conversion.error(), kExitUsage);
  if (const Status known = convert::check_fixed(conversion->fixed, models->embodiment); !known) {
    return fail(known.error(), kExitUsage);
  }
  const auto jobs = plan(options);
  if (!jobs) return jobs.error().code == Errc::kPermission ? fail_file(jobs.error()) : fail(jobs.error(), kExitUsage);
  return convert_all(options, *models, *jobs, *conversion);
}

}  // namespace

void add_convert_command(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<Options>();  // lives in the callback
  CLI::App* command =
      app.add_subcommand("convert", "Turn recordings into trajectories of a robot hand: pose and joints");
  command->add_option("RECORDING", options->recordings, "Motion exports of Qualisys Track Manager (.tsv)")->required();
  command->add_option("--hand", options->hand,
                      "Robot hand: a name (hands/NAME.toml) or a file (default: the configuration's)");
  command->add_option("--config", options->config, "Configuration file (default: the one that embodyd would use)");
  command->add_option("--subject", options->subject, "Subject file instead of the configuration's");
  command->add_option("-o,--output", options->output, "File (.csv, .tsv, .json), or a folder for several recordings")
      ->required();
  command->add_option("--format", options->format, "Format where the name does not tell; csv in a folder")
      ->check(CLI::IsMember({"csv", "tsv", "json"}));
  command->add_option("--rate", options->rate_hz, "Rows per second (default: those of the recording)")
      ->check(CLI::Range(0.001, 1e5));
  CLI::Option* frames =
      command->add_option("--frames", options->frames, "First and last frame, counted from 1, like 1001-3000");
  CLI::Option* metadata =
      command->add_option("--segments", options->segments.metadata,
                          "One file per segment of this metadata file (.json), or of RECORDING.json in this folder");
  CLI::Option* events =
      command->add_flag("--events", options->segments.events, "One file per pair of EVENT lines of the recording");
  frames->excludes(metadata)->excludes(events);
  metadata->excludes(events);
  command->add_option("--label", options->segments.label, "Only segments of this label");
  command->add_option("--label-field", options->segments.label_field, "Which label of the metadata: 1 or 2 (1)")
      ->check(CLI::Range(1, 2))
      ->needs(metadata);
  command
      ->add_option("--object", options->object,
                   "Poses relative to the object with these three markers: origin, x axis, xy plane")
      ->delimiter(',')
      ->expected(3);
  command->add_option("--fix", options->fixed, "Write this value for a joint, like j_thumb_opp=-0.2 (rad); may repeat")
      ->take_all()
      ->expected(1)
      ->allow_extra_args(false);
  command->add_flag("--filter", options->filter, "Also smooth the finger angles as the configuration says");
  command->add_option("--threads", options->threads, "Recordings at a time (default: one per core)")
      ->check(CLI::Range(1, 256));
  command->add_flag("--force", options->force, "Replace files that exist");
  command->callback([options, &exit_code] { exit_code = run(*options); });
}

}  // namespace embody::ctl
