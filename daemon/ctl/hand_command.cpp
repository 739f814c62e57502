// embodyctl hand: what a person in front of the robot hand asks of it before the daemon is started. The hand moves.
#include <CLI/CLI.hpp>
#include <array>
#include <cstdio>
#include <memory>
#include <string>

#include "daemon/app/config_io.hpp"
#include "daemon/app/devices.hpp"
#include "daemon/control/exit_code.hpp"
#include "daemon/control/protocol.hpp"
#include "daemon/ctl/answer.hpp"
#include "daemon/ctl/command.hpp"
#include "drivers/mia/mia_hand.hpp"
#include "drivers/robotiq/robotiq_hand.hpp"

namespace embody::ctl {
namespace {

struct Options {
  std::string config;
  bool json{false};
};

Status calibrate(HandDriver& hand) {
  auto* mia = dynamic_cast<mia::MiaHand*>(&hand);
  if (mia != nullptr) return mia->calibrate();
  return make_error(Errc::kUnsupported, "only a Mia hand behind its serial protocol is calibrated from here");
}

Status activate(HandDriver& hand) {
  auto* gripper = dynamic_cast<robotiq::RobotiqHand*>(&hand);
  if (gripper != nullptr) return gripper->activate();
  return make_error(Errc::kUnsupported, "only a Robotiq gripper is activated; this hand needs no activation");
}

struct Action {
  const char* name;
  const char* help;
  Status (*run)(HandDriver& hand);
};

constexpr std::array kActions{
    Action{"calibrate", "Mia: let the hand find the zero of its motors; IT MOVES", &calibrate},
    Action{"activate", "Robotiq: activate the gripper, once after power-up; IT OPENS AND CLOSES", &activate},
};

/// Errors as the steps have them; the daemon must not run, because the device has one owner.
Status act(const Action& action, const Options& options) {
  const auto path = config::find_config(options.config);
  if (!path) return path.error();
  const auto config = config::load_config(*path);
  if (!config) return config.error();
  if (const Status fits = check_devices(*config); !fits) return fits;
  if (config->hand.driver == config::HandDriverKind::kJointState) {
    return make_error(Errc::kUnsupported, "[hand] driver \"joint_state\": the hand's own driver does that");
  }
  const std::unique_ptr<HandDriver> hand = make_hand(*config);
  const Result<HandInfo> info = hand->connect();
  if (!info) return info.error();
  return action.run(*hand);
}

int run(const Action& action, const Options& options) {
  const Status done = act(action, options);
  if (done) {
    print_success(options.json, action.name, "{}");
    return kExitOk;
  }
  const bool refused = done.error().code == Errc::kRefused;
  print_failure(options.json, refused ? control::code::kRefused : code_of(done.error().code),
                std::string(done.error().detail.view()));
  return refused ? kExitRefused : exit_code_of(done.error().code);
}

}  // namespace

void add_hand_command(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<Options>();
  CLI::App* hand = app.add_subcommand("hand", "Prepare the robot hand, while the daemon does not run; the hand moves");
  hand->require_subcommand(1);
  for (const Action& action : kActions) {
    CLI::App* command = hand->add_subcommand(action.name, action.help);
    command->add_option("--config", options->config, "Configuration of embodyd, for the hand");
    command->add_flag("--json", options->json, "Print JSON");
    command->callback([options, &exit_code, &action] { exit_code = run(action, *options); });
  }
}

}  // namespace embody::ctl
