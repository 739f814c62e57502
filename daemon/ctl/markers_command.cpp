// `embodyctl markers`: which markers of the glove are seen and believed, and which labels are probably wrong.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <memory>
#include <string>
#include <thread>

#include "daemon/control/control_client.hpp"
#include "daemon/control/exit_code.hpp"
#include "daemon/control/socket_path.hpp"
#include "daemon/ctl/answer.hpp"
#include "daemon/ctl/command.hpp"
#include "daemon/ctl/markers_view.hpp"

namespace embody::ctl {
namespace {

using control::ControlClient;
using std::chrono::milliseconds;

constexpr milliseconds kTimeout{5000};
constexpr milliseconds kScreenInterval{200};
constexpr milliseconds kLineInterval{1000};

struct Options {
  std::string socket;
  bool json{false};
  bool once{false};
  int interval_ms{0};  ///< 0: by what the output is
};

void print(const std::string& result, const Options& options, bool screen) {
  if (options.json) {
    std::printf("%s\n", result.c_str());
  } else if (screen) {
    std::printf("\033[H\033[J%s", markers_table(result).c_str());
  } else {
    std::printf("%s", options.once ? markers_table(result).c_str() : markers_line(result).c_str());
  }
  std::fflush(stdout);
}

int run(const Options& options) {
  auto client = ControlClient::connect(control::client_socket_path(options.socket));
  const auto fail = [&options](const Error& error) {
    print_failure(options.json, code_of(error.code), std::string(error.detail.view()));
    return exit_code_of(error.code);
  };
  if (!client) return fail(client.error());
  const bool screen = !options.json && !options.once && ::isatty(STDOUT_FILENO) != 0;
  const milliseconds interval = options.interval_ms > 0 ? milliseconds(options.interval_ms)
                                : screen                ? kScreenInterval
                                                        : kLineInterval;
  control::Request request;
  request.command = control::Command::kMarkers;
  for (auto t_next = std::chrono::steady_clock::now();; std::this_thread::sleep_until(t_next)) {
    t_next = std::max(t_next + interval, std::chrono::steady_clock::now());
    const auto response = client->request(request, kTimeout);
    if (!response) return fail(response.error());
    if (!response->ok) {
      print_failure(options.json, response->code, response->message);
      return exit_code_of(response->code);
    }
    print(response->result, options, screen);
    if (options.once) return kExitOk;
  }
}

}  // namespace

void add_markers_command(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<Options>();  // lives in the callback
  CLI::App* markers =
      app.add_subcommand("markers", "Show which markers are seen and believed, and which label is probably wrong");
  markers->add_option("--socket", options->socket,
                      "Control socket of the daemon (default: $EMBODY_SOCKET, else the one that is there)");
  markers->add_flag("--json", options->json, "Print JSON, one object per line");
  markers->add_flag("--once", options->once, "Show them once instead of until Ctrl-C");
  markers
      ->add_option("--interval-ms", options->interval_ms,
                   "Period (default: 200 on a terminal, else 1000, with one line each time)")
      ->check(CLI::Range(20, 60'000));
  markers->callback([options, &exit_code] {
    std::signal(SIGINT, [](int) { ::_exit(kExitInterrupted); });
    exit_code = run(*options);
  });
}

}  // namespace embody::ctl
