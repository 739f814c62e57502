// embodyctl discover: which QTM computers are on the network.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "daemon/control/exit_code.hpp"
#include "daemon/ctl/answer.hpp"
#include "daemon/ctl/command.hpp"
#include "drivers/qualisys/discovery.hpp"
#include "drivers/transport/udp.hpp"

namespace embody::ctl {
namespace {

struct Options {
  double seconds{1.0};
  bool json{false};
};

int discover(const Options& options) {
  const auto hosts = qualisys::discover(transport::interface_addresses(), from_seconds(options.seconds));
  if (!hosts) {
    print_failure(options.json, code_of(hosts.error().code), std::string(hosts.error().detail.view()));
    return exit_code_of(hosts.error().code);
  }
  if (options.json) {
    auto list = nlohmann::json::array();
    for (const qualisys::QtmHost& host : *hosts) {
      list.push_back({{"address", host.address},
                      {"port", host.reply.base_port + 1},
                      {"local_address", host.local_address},
                      {"info", host.reply.info}});
    }
    std::printf("%s\n", list.dump().c_str());
  } else {
    for (const qualisys::QtmHost& host : *hosts) {
      std::printf("%-15s  port %d  %s\n", host.address.c_str(), host.reply.base_port + 1, host.reply.info.c_str());
    }
    if (hosts->empty())
      std::fprintf(stderr, "embodyctl: no QTM answered; is its real-time server on, and a firewall open for UDP?\n");
  }
  return hosts->empty() ? kExitUnavailable : kExitOk;
}

}  // namespace

void add_discover_command(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand("discover", "List the QTM computers that answer on the network");
  command->add_option("--seconds", options->seconds, "How long to wait for answers")
      ->check(CLI::Range(0.1, 30.0))
      ->capture_default_str();
  command->add_flag("--json", options->json, "Print JSON");
  command->callback([options, &exit_code] { exit_code = discover(*options); });
}

}  // namespace embody::ctl
