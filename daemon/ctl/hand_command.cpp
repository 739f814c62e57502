// embodyctl hand: what a person in front of the robot hand asks of it before the daemon is started.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <string>

#include "daemon/app/config_io.hpp"
#include "daemon/app/devices.hpp"
#include "daemon/control/control_client.hpp"
#include "daemon/control/exit_code.hpp"
#include "daemon/control/protocol.hpp"
#include "daemon/control/socket_path.hpp"
#include "daemon/ctl/answer.hpp"
#include "daemon/ctl/command.hpp"
#include "daemon/ctl/hand_tasks.hpp"

namespace embody::ctl {
namespace {

struct Options {
  std::string config;
  HandTaskOptions task;
};

/// A serial line has one owner, and the second one is refused; a CAN bus takes everybody.
Status check_owner(const config::HandConfig& hand) {
  const bool exclusive = hand.driver != config::HandDriverKind::kMia || hand.mia.wire == config::MiaWire::kSerial;
  if (exclusive || !control::ControlClient::connect(control::client_socket_path(""))) return {};
  return make_error(Errc::kRefused, "embodyd runs and has the hand: see 'embodyctl status', or end it first");
}

/// Errors as the steps have them; the daemon must not run, because the device has one owner. The hand is left stopped.
Result<HandAnswer> act(const HandTask& task, const Options& options) {
  const auto path = config::find_config(options.config);
  if (!path) return path.error();
  const auto config = config::load_config(*path);
  if (!config) return config.error();
  if (const Status fits = check_devices(*config); !fits) return fits.error();
  if (config->hand.driver == config::HandDriverKind::kJointState) {
    return make_error(Errc::kUnsupported, "[hand] driver \"joint_state\": the hand's own driver does that");
  }
  if (const Status free = check_owner(config->hand); !free) return free.error();
  const std::unique_ptr<HandDriver> hand = make_hand(*config);
  const Result<HandInfo> info = hand->connect();
  if (!info) return info.error();
  return task.run(*hand, *info, options.task);
}

int run(const HandTask& task, const Options& options) {
  catch_interrupts();
  const Result<HandAnswer> answer = act(task, options);
  if (answer) {
    if (options.task.json || answer->text.empty()) {
      print_success(options.task.json, task.name, answer->json);
    } else {
      std::fputs(answer->text.c_str(), stdout);
    }
    return kExitOk;
  }
  const bool refused = answer.error().code == Errc::kRefused;
  const std::string detail(answer.error().detail.view());
  print_failure(options.task.json, refused ? control::code::kRefused : code_of(answer.error().code), detail);
  if (interrupted()) return kExitInterrupted;
  return refused ? kExitRefused : exit_code_of(answer.error().code);
}

}  // namespace

void add_hand_command(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<Options>();
  CLI::App* hand = app.add_subcommand("hand", "Prepare and look at the robot hand, while the daemon does not run");
  hand->require_subcommand(1);
  for (const HandTask& task : hand_tasks()) {
    CLI::App* command = hand->add_subcommand(task.name, task.help);
    command->add_option("--config", options->config, "Configuration of embodyd, for the hand");
    command->add_flag("--json", options->task.json, "Print JSON");
    if (std::string_view(task.name) == "show") {
      command->add_flag("--watch", options->task.watch, "Twice a second until Ctrl-C");
      command->add_flag("--tare", options->task.tare, "Take what is measured first for zero force (Mia)");
    }
    command->callback([options, &exit_code, &task] { exit_code = run(task, *options); });
  }
}

}  // namespace embody::ctl
