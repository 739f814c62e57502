// embodyctl sim: breaks things in a running simulated lab, and looks at it.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <array>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "daemon/control/control_client.hpp"
#include "daemon/ctl/answer.hpp"
#include "daemon/ctl/command.hpp"
#include "daemon/ctl/sim_view.hpp"
#include "daemon/ctl/status_table.hpp"
#include "daemon/simlab/lab_protocol.hpp"

namespace embody::ctl {
namespace {

using sim::LabCommand;

constexpr std::chrono::seconds kTimeout{30};  // a report is computed from all that has happened

struct Options {
  std::string socket;
  bool json{false};
  std::vector<std::string> words;
};

int fail(const std::string& code, const std::string& message, ExitCode exit_code, bool json) {
  print_failure(json, code, message);
  return exit_code;
}

int fail(const Error& error, bool json) {
  return fail(code_of(error.code), std::string(error.detail.view()), exit_code_of(error.code), json);
}

/// "qtm hide index_tip" from one word or from several. A name with blanks keeps its quotation marks.
std::string joined(const std::vector<std::string>& words) {
  std::string fault;
  for (const std::string& word : words) {
    const bool name_with_blank = words.size() > 1 && word.find(' ') != std::string::npos && word.front() != '"';
    fault += (fault.empty() ? "" : " ") + (name_with_blank ? "\"" + word + "\"" : word);
  }
  return fault;
}

void print(const sim::LabRequest& request, const std::string& result, bool json) {
  if (json) return print_success(true, "", result);
  switch (request.command) {
    case LabCommand::kStatus:
      std::fputs(lab_status_text(result).c_str(), stdout);
      return;
    case LabCommand::kReport:
      std::fputs(lab_report_text(result).c_str(), stdout);
      return;
    case LabCommand::kFaults:
      std::fputs(lab_faults_text(result).c_str(), stdout);
      return;
    case LabCommand::kFault:
      std::printf("%s: done\n", printable(request.fault).c_str());
      return;
    case LabCommand::kPlay:
      std::printf("play: done\n");
  }
}

int ask(const sim::LabRequest& request, const Options& options) {
  if (request.fault.size() > sim::kMostFaultBytes) {
    return fail("usage", "a fault has at most 400 bytes", kExitUsage, options.json);
  }
  const std::string path = options.socket.empty() ? sim::default_lab_socket() : options.socket;
  auto client = control::ControlClient::connect(path, "embody-sim");
  if (!client) return fail(client.error(), options.json);
  const auto response = client->request_line(sim::format_lab_request(request), kTimeout);
  if (!response) return fail(response.error(), options.json);
  if (!response->ok) {
    const bool unclear = request.command == LabCommand::kFault && response->code == control::code::kFailed;
    return fail(response->code, response->message + (unclear ? "; 'embodyctl sim faults' lists what there is" : ""),
                exit_code_of(response->code), options.json);
  }
  print(request, response->result, options.json);
  return kExitOk;
}

struct Action {
  LabCommand command;
  const char* help;
};

constexpr std::array kActions{
    Action{LabCommand::kStatus, "Show the playback, and who uses which device"},
    Action{LabCommand::kReport, "Show how arm and hand have followed so far"},
    Action{LabCommand::kFaults, "List the faults that the devices of this lab can have"},
    Action{LabCommand::kFault, "Make one happen now, like 'sim fault qtm hide index_tip'"},
    Action{LabCommand::kPlay, "Start the recording"},
};

}  // namespace

void add_sim_command(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<Options>();  // lives in the callbacks
  CLI::App* sim = app.add_subcommand("sim", "Break things in a running simulated lab (embody-sim), and look at it");
  sim->require_subcommand(1);
  for (const Action& action : kActions) {
    CLI::App* command = sim->add_subcommand(sim::to_string(action.command), action.help);
    command->add_option("--socket", options->socket, "Socket of the lab (default: that of this user's first lab)");
    command->add_flag("--json", options->json, "Print JSON, one object per line");
    if (action.command == LabCommand::kFault) {
      command->add_option("fault", options->words, "Device and words of the fault; 'sim faults' lists them")
          ->required()
          ->expected(1, 16);
    }
    command->callback([options, &exit_code, code = action.command] {
      std::signal(SIGINT, [](int) { ::_exit(kExitInterrupted); });
      sim::LabRequest request;
      request.command = code;
      if (code == LabCommand::kFault) request.fault = joined(options->words);
      exit_code = ask(request, *options);
    });
  }
}

}  // namespace embody::ctl
