// The subcommands that talk to a running daemon.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <array>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <memory>
#include <string>

#include "daemon/control/control_client.hpp"
#include "daemon/control/exit_code.hpp"
#include "daemon/control/socket_path.hpp"
#include "daemon/ctl/answer.hpp"
#include "daemon/ctl/command.hpp"
#include "daemon/ctl/status_table.hpp"

namespace embody::ctl {
namespace {

using control::ControlClient;
using control::Request;
using std::chrono::milliseconds;

constexpr milliseconds kTimeout{5000};

struct Options {
  std::string socket;
  bool json{false};
  bool watch{false};
  int interval_ms{1000};
};

void exit_on_interrupt() {
  std::signal(SIGINT, [](int) { ::_exit(kExitInterrupted); });
}

void add_common_options(CLI::App& command, Options& options) {
  command.add_option("--socket", options.socket,
                     "Control socket of the daemon (default: $EMBODY_SOCKET, else the one that is there)");
  command.add_flag("--json", options.json, "Print JSON, one object per line");
}

/// Says what went wrong, to people on standard error or to programs on standard output.
int fail(const Error& error, bool json) {
  print_failure(json, code_of(error.code), std::string(error.detail.view()));
  return exit_code_of(error.code);
}

int fail(const control::Response& response, bool json) {
  print_failure(json, response.code, response.message);
  return exit_code_of(response.code);
}

int run_action(control::Command command, const Options& options) {
  auto client = ControlClient::connect(control::client_socket_path(options.socket));
  if (!client) return fail(client.error(), options.json);
  Request request;
  request.command = command;
  const auto response = client->request(request, kTimeout);
  if (!response) return fail(response.error(), options.json);
  if (!response->ok) return fail(*response, options.json);
  print_success(options.json, control::to_string(command), response->result);
  return kExitOk;
}

void print_status(const std::string& result, const Options& options) {
  if (options.json) {
    std::printf("%s\n", result.c_str());
  } else {
    const bool screen = options.watch && ::isatty(STDOUT_FILENO) != 0;
    std::printf("%s%s%s", screen ? "\033[H\033[J" : "", status_table(result).c_str(),
                options.watch && !screen ? "\n" : "");
  }
  std::fflush(stdout);
}

int run_status(const Options& options) {
  auto client = ControlClient::connect(control::client_socket_path(options.socket));
  if (!client) return fail(client.error(), options.json);
  Request request;
  request.command = options.watch ? control::Command::kSubscribe : control::Command::kStatus;
  request.interval = milliseconds(options.interval_ms);
  auto response = client->request(request, kTimeout);
  while (true) {
    if (!response) return fail(response.error(), options.json);
    if (!response->ok) return fail(*response, options.json);
    print_status(response->result, options);
    if (!options.watch) return kExitOk;
    response = client->next(request.interval + kTimeout);
  }
}

struct Action {
  control::Command command;
  const char* help;
};

constexpr std::array kActions{
    Action{control::Command::kEngage, "Let the robot follow the hand from now on"},
    Action{control::Command::kDisengage, "End following: decelerate and stand still"},
    Action{control::Command::kStop, "Stop arm and hand at once; needs a reset afterwards"},
    Action{control::Command::kReset, "Acknowledge a stop, so that engaging is possible again"},
    Action{control::Command::kShutdown, "Stop the robot and end the daemon"},
};

}  // namespace

void add_control_commands(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<Options>();  // lives in the callbacks
  CLI::App* status = app.add_subcommand("status", "Show mode, devices, rates, latencies and counters");
  add_common_options(*status, *options);
  status->add_flag("--watch", options->watch, "Show the status again and again until Ctrl-C");
  status->add_option("--interval-ms", options->interval_ms, "Period of --watch")
      ->check(CLI::Range(20, 60'000))
      ->capture_default_str();
  status->callback([options, &exit_code] {
    exit_on_interrupt();
    exit_code = run_status(*options);
  });
  for (const Action& action : kActions) {
    CLI::App* command = app.add_subcommand(control::to_string(action.command), action.help);
    add_common_options(*command, *options);
    command->callback([options, &exit_code, code = action.command] {
      exit_on_interrupt();
      exit_code = run_action(code, *options);
    });
  }
}

}  // namespace embody::ctl
