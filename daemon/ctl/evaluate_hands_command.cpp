// embodyctl evaluate embodiment | similarity: judges robot hands on recordings.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/embodiment/similarity.hpp"
#include "daemon/app/config_io.hpp"
#include "daemon/app/models.hpp"
#include "daemon/control/exit_code.hpp"
#include "daemon/ctl/answer.hpp"
#include "daemon/ctl/command.hpp"
#include "daemon/ctl/offline.hpp"
#include "daemon/evaluate/embodiment_evaluation.hpp"
#include "daemon/evaluate/recorded_frames.hpp"
#include "daemon/evaluate/similarity_report.hpp"
#include "drivers/recording/tsv_recording.hpp"
#include "drivers/transport/file.hpp"

namespace embody::ctl {
namespace {

struct Options {
  std::vector<std::string> recordings;
  std::vector<std::string> hands;
  std::string config;
  std::string subject;
  std::string frames;
  bool no_reference{false};
  int every{10};
  std::optional<std::string> json_file;
};

/// A failure that was said already carries its exit code.
struct Inputs {
  std::vector<std::vector<HandState>> states;  ///< by recording
  std::vector<EmbodimentConfig> hands;
  std::optional<OperatorModels> models;
  int exit_code{kExitOk};
};

Inputs failed(int exit_code) {
  Inputs inputs;
  inputs.exit_code = exit_code;
  return inputs;
}

Inputs read_inputs(const Options& options) {
  if (options.json_file) {
    if (const Status writable = transport::check_output(*options.json_file, true); !writable) {
      return failed(fail_file(writable.error()));
    }
  }
  const Result<config::EmbodyConfig> config = offline_config(options.config, options.subject);
  if (!config) return failed(fail(config.error(), kExitConfiguration));
  Inputs inputs;
  Result<OperatorModels> models = make_operator_models(*config);
  if (!models) return failed(fail(models.error(), kExitConfiguration));
  inputs.models = std::move(*models);
  for (const std::string& name : options.hands) {
    const auto hand = config::load_hand(name);
    if (!hand) return failed(fail(hand.error(), kExitConfiguration));
    inputs.hands.push_back(hand->embodiment);
    inputs.hands.back().side = config->subject.side;
  }
  evaluate::FrameRange range;
  if (!options.frames.empty()) {
    const auto parsed = evaluate::parse_frame_range(options.frames);
    if (!parsed) return failed(fail(parsed.error(), kExitUsage));
    range = *parsed;
  }
  for (const std::string& file : options.recordings) {
    const auto recording = recording::load_tsv(file);
    if (!recording) return failed(fail_file(recording.error()));
    const auto frames = evaluate::marker_frames(*recording, inputs.models->layout, range);
    if (!frames) {
      return failed(fail(frames.error(), frames.error().code == Errc::kInvalidArgument ? kExitUsage : kExitFailed));
    }
    inputs.states.push_back(evaluate::hand_states(*inputs.models, *frames));
  }
  return inputs;
}

std::function<void(std::size_t, std::size_t)> progress_of(const std::string& hand) {
  if (::isatty(STDERR_FILENO) == 0) return {};
  return [hand](std::size_t done, std::size_t total) {
    if (done < total && done % 50 != 0) return;
    std::fprintf(stderr, done < total ? "\r%s: %zu of %zu frames" : "\r\033[K", hand.c_str(), done, total);
  };
}

int finish(const std::string& text, const std::string& json, const std::optional<std::string>& json_file) {
  std::printf("%s", text.c_str());
  if (!json_file) return kExitOk;
  const Status saved = transport::save_text(json + "\n", *json_file, true);
  return saved ? kExitOk : fail_file(saved.error());
}

int run_embodiment(const Options& options) {
  const Inputs inputs = read_inputs(options);
  if (inputs.exit_code != kExitOk) return inputs.exit_code;
  std::vector<evaluate::EmbodimentSummary> summaries;
  for (const EmbodimentConfig& hand : inputs.hands) {
    const auto mapping = make_embodiment(hand);
    if (!mapping) return fail(mapping.error(), kExitConfiguration);
    evaluate::EmbodimentSamples samples;
    for (const auto& states : inputs.states) {
      samples.add(evaluate::evaluate_embodiment(*mapping, states, !options.no_reference, progress_of(hand.name)));
    }
    summaries.push_back(evaluate::summarise(hand.name, samples));
  }
  return finish(evaluate::embodiment_text(summaries), evaluate::embodiment_json(summaries), options.json_file);
}

/// Adds every so manieth frame of a recording; the mapping sees all of them.
void add_similarity(EmbodimentMapping mapping, Similarity& similarity, const std::vector<HandState>& states,
                    std::size_t every, evaluate::SimilarityMean& mean) {
  FingerTarget target;
  robot::HandKinematics::Workspace links;
  for (std::size_t i = 0; i < states.size(); ++i) {
    mapping.step(states[i], target);
    if (!target.valid || i % every != 0) continue;
    mapping.kinematics().update(target.q_rad, links);
    hand::Vector48 q_rad = hand::Vector48::Zero();
    q_rad.tail<45>() = states[i].q_rad;
    mean.add(similarity.distances(q_rad, mapping.X_PM(), links.X_PL));
  }
}

int run_similarity(const Options& options) {
  const Inputs inputs = read_inputs(options);
  if (inputs.exit_code != kExitOk) return inputs.exit_code;
  std::vector<evaluate::SimilarityRow> rows;
  for (const EmbodimentConfig& hand : inputs.hands) {
    const auto mapping = make_embodiment(hand);
    if (!mapping) return fail(mapping.error(), kExitConfiguration);
    Result<Similarity> similarity =
        Similarity::create(inputs.models->data, inputs.models->shape, mapping->kinematics().model(), mapping->config());
    if (!similarity) return fail(similarity.error(), kExitConfiguration);
    evaluate::SimilarityMean mean;
    for (const auto& states : inputs.states) {
      add_similarity(*mapping, *similarity, states, static_cast<std::size_t>(options.every), mean);
    }
    rows.push_back(mean.row(hand.name));
  }
  return finish(evaluate::similarity_text(rows), evaluate::similarity_json(rows), options.json_file);
}

CLI::App* add_hands_command(CLI::App& evaluate, const char* name, const char* what, Options& options) {
  CLI::App* command = evaluate.add_subcommand(name, what);
  command->add_option("RECORDING", options.recordings, "Motion exports of Qualisys Track Manager (.tsv)")->required();
  command->add_option("--hand", options.hands, "Hands: shipped names or hand files (default: all that are shipped)")
      ->delimiter(',')
      ->default_val(std::vector<std::string>{"mia", "shadow", "robotiq_2f140", "barrett"});
  command->add_option("--config", options.config, "Configuration file (default: the one that embodyd would use)");
  command->add_option("--subject", options.subject, "Subject file instead of the configuration's");
  command->add_option("--frames", options.frames, "First and last frame, counted from 1, like 1001-3000");
  command->add_option("--json", options.json_file, "Also write the figures to this file");
  return command;
}

}  // namespace

void add_evaluate_hands_commands(CLI::App& evaluate, int& exit_code) {
  const auto embodiment = std::make_shared<Options>();  // lives in the callback
  CLI::App* command = add_hands_command(
      evaluate, "embodiment", "From the human to robot hands: point errors, joint steps, cost, time", *embodiment);
  command->add_flag("--no-reference", embodiment->no_reference, "Do not compare with SLSQP: faster");
  command->callback([embodiment, &exit_code] { exit_code = run_embodiment(*embodiment); });

  const auto similarity = std::make_shared<Options>();
  command =
      add_hands_command(evaluate, "similarity",
                        "Distance between the contact surfaces of robot hands and of the human hand", *similarity);
  command->add_option("--every", similarity->every, "Judge every so manieth frame (10)")->check(CLI::Range(1, 100000));
  command->callback([similarity, &exit_code] { exit_code = run_similarity(*similarity); });
}

}  // namespace embody::ctl
