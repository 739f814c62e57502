// embodyd: the real-time teleoperation daemon.
#include <poll.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>
#include <systemd/sd-daemon.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>
#include <iostream>

#include "daemon/app/config_io.hpp"
#include "daemon/app/control_handler.hpp"
#include "daemon/app/daemon.hpp"
#include "daemon/app/signals.hpp"
#include "daemon/app/version.hpp"
#include "daemon/control/control_server.hpp"
#include "daemon/control/exit_code.hpp"
#include "daemon/control/socket_path.hpp"
#include "drivers/transport/clock.hpp"

namespace {

using namespace embody;

int fail(const Error& error, int exit_code) {
  std::cerr << "embodyd: " << error.detail.view() << "\n";
  return exit_code;
}

int exit_code_of(const Error& error) {
  return error.code == Errc::kPermission ? kExitPermission : kExitFailed;
}

/// "<N>" with the syslog level, as the journal reads it (sd-daemon(3)).
class JournalLevel : public spdlog::custom_flag_formatter {
 public:
  void format(const spdlog::details::log_msg& message, const std::tm&, spdlog::memory_buf_t& out) override {
    static constexpr std::array<const char*, 7> kPrefix{"<7>", "<7>", "<6>", "<4>", "<3>", "<2>", "<6>"};
    const char* prefix = kPrefix[static_cast<std::size_t>(message.level)];
    out.append(prefix, prefix + 3);
  }
  [[nodiscard]] std::unique_ptr<custom_flag_formatter> clone() const override {
    return std::make_unique<JournalLevel>();
  }
};

/// Standard error; under the journal with its level prefixes and without time and colour.
void set_up_log(config::LogLevel level) {
  static constexpr std::array<spdlog::level::level_enum, 4> kLevels{spdlog::level::debug, spdlog::level::info,
                                                                    spdlog::level::warn, spdlog::level::err};
  if (std::getenv("JOURNAL_STREAM") != nullptr) {
    auto logger = std::make_shared<spdlog::logger>("embodyd", std::make_shared<spdlog::sinks::stderr_sink_mt>());
    auto formatter = std::make_unique<spdlog::pattern_formatter>();
    formatter->add_flag<JournalLevel>('*').set_pattern("%*%v");
    logger->set_formatter(std::move(formatter));
    spdlog::set_default_logger(std::move(logger));
  } else {
    spdlog::set_default_logger(spdlog::stderr_color_mt("embodyd"));
    spdlog::set_pattern("%H:%M:%S.%e %^%l%$ %v");
  }
  spdlog::set_level(kLevels[static_cast<std::size_t>(level)]);
}

/// Serves the operator until a signal, a shutdown request or, where configured, a missing device.
int serve(Daemon& daemon, control::ControlServer& server, const bool& shutdown, StopSignals& signals,
          const config::LinksConfig& links) {
  const TimePoint t_start = transport::now();
  TimePoint t_health{};
  while (true) {
    pollfd entries[2] = {{signals.fd(), POLLIN, 0}, {server.fd(), POLLIN, 0}};
    ::poll(entries, 2, 100);
    if (const int signal = signals.take(); signal != 0) {
      spdlog::info("signal {}: stopping", signal);
      return signal == SIGINT ? kExitInterrupted : kExitOk;
    }
    server.serve();
    if (shutdown) return kExitOk;
    if (daemon.failed()) return kExitFailed;
    const TimePoint t = transport::now();
    if (t - t_health > std::chrono::milliseconds(300)) {
      if (daemon.healthy()) ::sd_notify(0, "WATCHDOG=1");
      t_health = t;
    }
    if (links.on_missing == config::OnMissing::kExit && !daemon.ever_connected() &&
        t - t_start > links.missing_timeout) {
      for (const DeviceReport& device : daemon.devices()) {
        if (!device.connected) spdlog::error("{} is missing: {}", device.name, device.detail);
      }
      return kExitUnavailable;
    }
  }
}

int run(const config::EmbodyConfig& config) {
  StopSignals signals;
  set_up_log(config.log.level);
  Result<std::unique_ptr<Daemon>> daemon = Daemon::create(config);
  if (!daemon) return fail(daemon.error(), kExitConfiguration);

  bool shutdown = false;
  // Under systemd the unit's group may command, by hand only the user (docs/control.md).
  const bool group = config.control.group_access || std::getenv("RUNTIME_DIRECTORY") != nullptr;
  control::ServerConfig server_config{control::server_socket_path(config.control.socket), group};
  Result<std::unique_ptr<control::ControlServer>> server =
      control::ControlServer::open(server_config, make_control_handler(**daemon, shutdown));
  if (!server) return fail(server.error(), exit_code_of(server.error()));
  if (const Status started = (*daemon)->start(); !started) return fail(started.error(), exit_code_of(started.error()));

  spdlog::info("embodyd {} started, control socket {}", kVersion, server_config.path);
  ::sd_notify(0, "READY=1");
  const int exit_code = serve(**daemon, **server, shutdown, signals, config.links);
  ::sd_notify(0, "STOPPING=1");
  signals.restore();  // a second Ctrl-C ends at once
  if ((*daemon)->stop()) {
    spdlog::info("embodyd stopped: the arm stands still");
  } else {
    spdlog::error("embodyd stopped without seeing the arm at rest: the robot brakes by itself");
  }
  return exit_code;
}

int run_program(int argc, char** argv) {
  CLI::App app{"Drives a robot arm and a robotic hand with a person's own hand, in real time."};
  app.set_version_flag("--version", std::string("embodyd ") + kVersion);
  std::string config_file;
  bool print_config = false;
  app.add_option("--config", config_file,
                 "Configuration file (default: $EMBODY_CONFIG, /etc/embody/embody.toml, then the shipped one)");
  app.add_flag("--print-config", print_config, "Print the complete configuration in use and exit");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kExitOk : kExitUsage;
  }
  const Result<std::filesystem::path> path = config::find_config(config_file);
  if (!path) return fail(path.error(), kExitConfiguration);
  const Result<config::EmbodyConfig> config = config::load_config(*path);
  if (!config) return fail(config.error(), kExitConfiguration);
  const config::EmbodyConfig adapted = config::adapted_to_sensor(*config);
  if (!print_config) return run(adapted);
  std::cout << config::print_toml(adapted);
  return kExitOk;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run_program(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "embodyd: %s\n", error.what());
    return kExitFailed;
  }
}
