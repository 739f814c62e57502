// embodyctl evaluate: judges the record mapping on recordings.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "daemon/app/config_io.hpp"
#include "daemon/control/exit_code.hpp"
#include "daemon/ctl/answer.hpp"
#include "daemon/ctl/command.hpp"
#include "daemon/ctl/offline.hpp"
#include "daemon/ctl/status_table.hpp"
#include "daemon/evaluate/record_summary.hpp"
#include "daemon/evaluate/recorded_frames.hpp"
#include "drivers/recording/tsv_recording.hpp"
#include "drivers/transport/file.hpp"

namespace embody::ctl {
namespace {

struct Options {
  std::vector<std::string> recordings;
  std::string config;
  std::string subject;
  std::vector<std::string> fit;
  std::string frames;
  std::string solver;
  std::string objective;
  bool no_prior{false};
  std::optional<std::string> json_file;
};

/// The configuration with what the command line changes.
Result<config::EmbodyConfig> configuration(const Options& options) {
  Result<config::EmbodyConfig> config = offline_config(options.config, options.subject);
  if (!config) return config;
  config::RecordMappingConfig& mapping = config->record_mapping;
  if (options.solver == "own") mapping.solver = hand::FingerSolver::kOwn;
  if (options.solver == "slsqp") mapping.solver = hand::FingerSolver::kSlsqp;
  if (options.objective == "paper") mapping.objective = hand::FingerObjective::kPaper;
  if (options.objective == "published") mapping.objective = hand::FingerObjective::kPublished;
  return config;
}

/// Bounds and weights of the published problem, which has no other prior.
void remove_prior(hand::FingerEstimatorConfig& fingers) {
  const auto published = hand::FingerEstimatorConfig::published();
  fingers.lower_rad = published.lower_rad;
  fingers.upper_rad = published.upper_rad;
  fingers.weight_plus = published.weight_plus;
  fingers.weight_minus = published.weight_minus;
  fingers.temporal_m_rad = published.temporal_m_rad;
  fingers.coupling_m_rad = published.coupling_m_rad;
}

std::function<void(std::size_t, std::size_t)> progress_on_terminal() {
  if (::isatty(STDERR_FILENO) == 0) return {};
  return [](std::size_t done, std::size_t total) {
    if (done % 50 == 0 || done == total)
      std::fprintf(stderr, done < total ? "\r%zu of %zu frames" : "\r\033[K", done, total);
  };
}

int run(const Options& options) {
  const auto config = configuration(options);
  if (!config) return fail(config.error(), kExitConfiguration);
  Result<OperatorModels> models = make_operator_models(*config);
  if (!models) return fail(models.error(), kExitConfiguration);
  if (options.no_prior) remove_prior(models->fingers);
  if (options.json_file) {
    if (const Status writable = transport::check_output(*options.json_file, true); !writable) {
      return fail_file(writable.error());
    }
  }
  evaluate::FrameRange range;
  if (!options.frames.empty()) {
    const auto parsed = evaluate::parse_frame_range(options.frames);
    if (!parsed) return fail(parsed.error(), kExitUsage);
    range = *parsed;
  }
  evaluate::EvaluationOptions evaluation;
  evaluation.fit = options.fit;
  evaluation.progress = progress_on_terminal();

  evaluate::RecordSamples pooled;
  auto each = nlohmann::ordered_json::array();
  for (const std::string& path : options.recordings) {
    const auto recording = recording::load_tsv(path);
    if (!recording) return fail_file(recording.error());
    const auto frames = evaluate::marker_frames(*recording, models->layout, range);
    if (!frames) return fail(frames.error(), frames.error().code == Errc::kInvalidArgument ? kExitUsage : kExitFailed);
    const auto samples = evaluate::evaluate_record(*models, *frames, evaluation);
    if (!samples) return fail(samples.error(), kExitUsage);
    const auto summary = evaluate::summarise(*samples);
    std::printf("recording              %s, frames %llu to %llu\n%s", printable(path).c_str(),
                static_cast<unsigned long long>(frames->front().frame_number),
                static_cast<unsigned long long>(frames->back().frame_number), evaluate::summary_text(summary).c_str());
    std::fflush(stdout);
    auto object = nlohmann::ordered_json::parse(evaluate::summary_json(summary));
    object["recording"] = path;
    each.push_back(std::move(object));
    pooled.add(*samples);
  }
  auto summary = evaluate::summarise(pooled);
  if (options.recordings.size() > 1) {
    summary.costly.clear();  // frame numbers mean nothing without their recording
    std::printf("all %zu recordings\n%s", options.recordings.size(), evaluate::summary_text(summary).c_str());
  }
  if (!options.json_file) return kExitOk;
  auto object = nlohmann::ordered_json::parse(evaluate::summary_json(summary));
  object["recordings"] = std::move(each);
  const std::string text = object.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
  if (const Status saved = transport::save_text(text, *options.json_file, true); !saved) {
    return fail_file(saved.error());
  }
  return kExitOk;
}

}  // namespace

void add_evaluate_command(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<Options>();  // lives in the callback
  CLI::App* evaluate = app.add_subcommand("evaluate", "Judge record mapping and robot hands on recordings");
  evaluate->require_subcommand(1);
  CLI::App* record = evaluate->add_subcommand(
      "record", "From markers to the human hand: residuals, frozen fingers, joint steps, cost, time");
  record->add_option("RECORDING", options->recordings, "Motion exports of Qualisys Track Manager (.tsv)")->required();
  record->add_option("--config", options->config, "Configuration file (default: the one that embodyd would use)");
  record->add_option("--subject", options->subject, "Subject file instead of the configuration's");
  record->add_option("--fit", options->fit, "Finger markers to fit; the others are judged only (default: fit all)")
      ->delimiter(',');
  record->add_option("--frames", options->frames, "First and last frame, counted from 1, like 1001-3000");
  record->add_option("--solver", options->solver, "Solver instead of the configuration's")
      ->check(CLI::IsMember({"own", "slsqp"}));
  record->add_option("--objective", options->objective, "Objective instead of the configuration's")
      ->check(CLI::IsMember({"paper", "published"}));
  record->add_flag("--no-prior", options->no_prior,
                   "Bounds and weights of the published record mapping, without coupling and temporal term");
  record->add_option("--json", options->json_file, "Also write the figures to this file");
  record->callback([options, &exit_code] { exit_code = run(*options); });
  add_evaluate_hands_commands(*evaluate, exit_code);
}

}  // namespace embody::ctl
