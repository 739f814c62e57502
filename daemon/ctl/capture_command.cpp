// embodyctl capture: the bytes between a driver and its device, in a file that replays as a test fixture.
#include <poll.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "daemon/app/config_io.hpp"
#include "daemon/app/signals.hpp"
#include "daemon/control/exit_code.hpp"
#include "daemon/ctl/answer.hpp"
#include "daemon/ctl/capture_link.hpp"
#include "daemon/ctl/captured_driver.hpp"
#include "daemon/ctl/command.hpp"
#include "daemon/ctl/status_table.hpp"
#include "drivers/transport/clock.hpp"

namespace embody::ctl {
namespace {

using capture::CaptureWriter;
using transport::now;

constexpr int kPoll_ms = 10;  // a hand driver wants to be called at least every 20 ms

struct Options {
  std::string config;
  std::optional<double> duration_s;
  std::string output;
  bool proxy{false};
  bool force{false};
  std::string program{"embodyctl"};
};

int fail_device(const Error& error) {
  const bool absent = error.code == Errc::kTimeout || error.code == Errc::kRefused;
  return fail(error, absent ? kExitUnavailable : exit_code_of(error.code));
}

/// One run: counts, clock and signals.
class CaptureRun {
 public:
  CaptureRun(const Options& options, CaptureWriter& writer, StopSignals& signals)
      : options_(options), writer_(writer), signals_(signals), t_start_(now()), t_line_(t_start_ + kLine) {
    if (options.duration_s) t_end_ = t_start_ + from_seconds(*options.duration_s);
  }

  /// Until the time is over, Ctrl-C, or a failure of file, link or driver (nothing: only the proxy). Exit code.
  int run(const CaptureLink& link, CapturedDriver* driver, int fd) {
    while (!t_end_ || now() < *t_end_) {
      pollfd polled[2] = {{signals_.fd(), POLLIN, 0}, {fd, POLLIN, 0}};
      ::poll(polled, 2, kPoll_ms);
      if (signals_.take() != 0) return t_end_ ? kExitInterrupted : kExitOk;
      if (driver != nullptr) {
        if (const Status served = driver->serve(now()); !served) return fail_device(served.error());
      }
      if (const Status written = writer_.status(); !written) return kExitFailed;  // told by close()
      if (const Status there = link.status(); !there) return fail(there.error(), kExitUnavailable);
      print_line();
    }
    return kExitOk;
  }

  void print_summary(const CapturedDriver* driver) const {
    const auto counters = writer_.counters();
    std::printf("%s: %.1f s, %llu connections, %llu chunks, %llu bytes in, %llu bytes out",
                printable(options_.output).c_str(), to_seconds(now() - t_start_), ull(counters.connections),
                ull(counters.chunks), ull(counters.bytes_in), ull(counters.bytes_out));
    if (driver != nullptr) std::printf(", %llu readings of the driver", ull(driver->readings()));
    std::printf("\n");
  }

 private:
  static constexpr Duration kLine = std::chrono::seconds(1);
  static unsigned long long ull(std::uint64_t value) { return value; }

  void print_line() {
    if (now() < t_line_) return;
    const auto counters = writer_.counters();
    std::printf("  %4.0f s: %llu chunks, %llu bytes in, %llu bytes out\n", to_seconds(t_line_ - t_start_),
                ull(counters.chunks), ull(counters.bytes_in), ull(counters.bytes_out));
    std::fflush(stdout);
    while (t_line_ <= now()) t_line_ += kLine;
  }

  const Options& options_;
  CaptureWriter& writer_;
  StopSignals& signals_;
  const TimePoint t_start_;
  TimePoint t_line_;
  std::optional<TimePoint> t_end_;
};

/// The file ends before the driver says goodbye, so that a replay ends with measurements.
int capture_driver(const Options& options, CapturedDevice device, const config::EmbodyConfig& config,
                   const CaptureLink& link, CaptureWriter& writer, StopSignals& signals) {
  const auto driver = make_captured_driver(device, config);
  const auto fd = driver->connect();
  CaptureRun run(options, writer, signals);
  const int exit_code = fd ? run.run(link, driver.get(), *fd) : fail_device(fd.error());
  if (const Status closed = writer.close(); !closed) return fail(closed.error(), kExitFailed);
  run.print_summary(driver.get());
  return exit_code;
}

/// Another program drives the device.
int capture_others(const Options& options, const CaptureLink& link, CaptureWriter& writer, StopSignals& signals) {
  std::printf("%s", link.advice().c_str());
  std::fflush(stdout);
  CaptureRun run(options, writer, signals);
  const int exit_code = run.run(link, nullptr, -1);
  if (const Status closed = writer.close(); !closed) return fail(closed.error(), kExitFailed);
  run.print_summary(nullptr);
  if (exit_code == kExitOk && link.listens_only() && writer.counters().chunks == 0) {
    return fail(make_error(Errc::kDisconnected, "no frame of the hand came by: does something drive it?"),
                kExitUnavailable);
  }
  return exit_code;
}

int run(const Options& options, CapturedDevice device) {
  const auto path = config::find_config(options.config);
  if (!path) return fail(path.error(), kExitConfiguration);
  auto config = config::load_config(*path);
  if (!config) return fail(config.error(), kExitConfiguration);
  StopSignals signals;
  capture::Header header = link_header(device, *config);
  header.program = options.program;
  const auto writer = CaptureWriter::open(options.output, options.force, header);
  if (!writer) return fail_file(writer.error());
  const auto link = open_capture_link(device, *config, **writer);
  if (!link) {
    static_cast<void>((*writer)->close());
    std::error_code ignored;  // nothing was captured; a device like /dev/stdout stays
    if (std::filesystem::is_regular_file(options.output, ignored)) std::filesystem::remove(options.output, ignored);
    return fail_device(link.error());
  }
  return options.proxy || (*link)->listens_only() ? capture_others(options, **link, **writer, signals)
                                                  : capture_driver(options, device, *config, **link, **writer, signals);
}

void add_device(CLI::App& capture, const char* name, const char* text, CapturedDevice device, CLI::App& app,
                int& exit_code) {
  const auto options = std::make_shared<Options>();  // lives in the callback
  CLI::App* command = capture.add_subcommand(name, text);
  command->add_option("--config", options->config, "Configuration file (default: the one that embodyd would use)");
  command->add_option("--duration", options->duration_s, "Seconds; without it until Ctrl-C")
      ->check(CLI::Range(0.1, 86'400.0));
  command->add_option("-o,--output", options->output, "File to write")->required();
  command->add_flag("--proxy", options->proxy,
                    "Connect nothing: only stand between embodyd and the device, and print where");
  command->add_flag("--force", options->force, "Replace the file if it exists");
  command->callback([options, device, &app, &exit_code] {
    if (const std::string version = app.version(); !version.empty()) options->program = version;
    exit_code = run(*options, device);
  });
}

}  // namespace

void add_capture_command(CLI::App& app, int& exit_code) {
  CLI::App* capture = app.add_subcommand("capture", "Record the raw bytes between a driver and its device to a file");
  capture->require_subcommand(1);
  add_device(*capture, "tracker", "The tracker: connects and reads frames", CapturedDevice::kTracker, app, exit_code);
  add_device(*capture, "arm", "The arm: connects and reads states; sends no command, loads no program",
             CapturedDevice::kArm, app, exit_code);
  add_device(*capture, "hand",
             "The robot hand: connects and asks for positions; sends nothing that moves. On CAN: listens only",
             CapturedDevice::kHand, app, exit_code);
}

}  // namespace embody::ctl
