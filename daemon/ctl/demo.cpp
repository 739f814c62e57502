#include "daemon/ctl/demo.hpp"

#include <poll.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>

#include "daemon/app/config_io.hpp"
#include "daemon/app/signals.hpp"
#include "daemon/control/control_client.hpp"
#include "daemon/control/exit_code.hpp"
#include "daemon/ctl/child_process.hpp"
#include "daemon/ctl/command.hpp"
#include "daemon/ctl/demo_view.hpp"
#include "drivers/transport/clock.hpp"

namespace embody::ctl {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using std::chrono::milliseconds;
using std::chrono::seconds;
using transport::now;

constexpr const char* kLimits =
    "Limits of this demo: flange 0.6 m/s and 2.5 rad/s, joints [1, 1, 1.5, 2, 2, 2] rad/s and [4, 4, 6, 10, 10, 10] "
    "rad/s^2;\n"
    "motion holds when the tracker is silent for 100 ms (50 ms by default: this machine may stall).\n";

/// A private folder that disappears with its owner.
class PrivateFolder {
 public:
  PrivateFolder() {
    const char* base = std::getenv("XDG_RUNTIME_DIR");
    std::string name =
        std::string(base != nullptr && ::access(base, W_OK) == 0 ? base : "/tmp") + "/embody-demo-XXXXXX";
    if (::mkdtemp(name.data()) != nullptr) path_ = name;
  }
  PrivateFolder(const PrivateFolder&) = delete;
  PrivateFolder& operator=(const PrivateFolder&) = delete;
  ~PrivateFolder() {
    std::error_code ignored;
    if (!path_.empty()) fs::remove_all(path_, ignored);
  }
  [[nodiscard]] bool ok() const noexcept { return !path_.empty(); }
  [[nodiscard]] std::string file(const char* name) const { return path_ + "/" + name; }

 private:
  std::string path_;
};

std::string folder_of_this_program() {
  return fs::read_symlink("/proc/self/exe").parent_path().string();
}

void print_tail(const std::string& file) {
  std::ifstream log(file);
  std::vector<std::string> lines;
  for (std::string line; std::getline(log, line);) lines.push_back(line);
  for (std::size_t i = lines.size() > 12 ? lines.size() - 12 : 0; i < lines.size(); ++i) {
    std::cerr << "  | " << lines[i] << "\n";
  }
}

/// Plays the operator in front of a simulated lab.
class Demo {
 public:
  explicit Demo(const DemoOptions& options) : options_(options), terminal_(::isatty(STDOUT_FILENO) != 0) {}

  int run() {
    if (!folder_.ok()) return fail("cannot create a private folder in $XDG_RUNTIME_DIR or /tmp", kExitFailed);
    int code = start_lab();
    if (code == kExitOk) code = start_daemon();
    if (code == kExitOk) code = operate();
    const int finished = finish();
    if (interrupted_) return kExitInterrupted;
    return code != kExitOk ? code : finished;
  }

 private:
  int fail(const std::string& sentence, int code) {
    std::cerr << "embodyctl demo: " << sentence << "\n";
    return code;
  }
  int child_failed(const char* name, ChildProcess& child, const char* log) {
    const int code = child.wait(now() + seconds(2));
    std::cerr << "embodyctl demo: " << name << " ended with exit code " << code << ":\n";
    print_tail(folder_.file(log));
    return code == kExitOk ? kExitFailed : code;
  }

  /// Settings for both programs. Ports are those that the lab took.
  void write_config(const json& ready) {
    std::ofstream file(folder_.file("demo.toml"));
    file << "schema = 1\n[tracker]\nport = " << ready.value("qtm_port", 1)
         << "\n[arm]\nport = " << ready.value("ur_port", 1)
         << "\ndashboard_port = " << ready.value("ur_dashboard_port", 1)
         << "\nstale_after_ms = 500\n[arm.program]\nport = " << ready.value("ur_primary_port", 1)
         << "\nwatchdog_hz = 2.0\n[arm.limits]\nspeed_m_s = 0.6\nspeed_rad_s = 2.5\n[hand]\ndevice = \""
         << folder_.file("mia") << "\"\n[safety]\nhold_after_ms = 100\n[control]\nsocket = \""
         << folder_.file("control.sock") << "\"\n[dds]\ndomain = " << 1 + ::getpid() % 100 << "\n";
  }

  int start_lab() {
    std::string recording = options_.recording;
    if (recording.empty()) {
      for (const fs::path& data : config::data_folders()) {
        if (recording.empty() && fs::exists(data / "recordings/demo.tsv")) recording = data / "recordings/demo.tsv";
      }
    }
    write_config(json::object());
    std::vector<std::string> arguments{"run",        recording,          "--config", folder_.file("demo.toml"),
                                       "--mia-link", folder_.file("mia")};
    if (options_.duration_s > 0.0) {
      arguments.insert(arguments.end(), {"--duration", std::to_string(options_.duration_s)});
    }
    auto lab = ChildProcess::start(folder_of_this_program() + "/embody-sim", arguments, folder_.file("sim.log"));
    if (!lab) return fail(std::string(lab.error().detail.view()), kExitFailed);
    lab_.emplace(std::move(*lab));
    const TimePoint deadline = now() + seconds(20);
    while (now() < deadline && !lab_->exit_code() && !interrupted_) {
      wait(milliseconds(20));
      for (auto line = lab_->next_line(); line; line = lab_->next_line()) {
        const json event = json::parse(*line, nullptr, false);
        if (event.value("event", "") != "ready") continue;
        progress_.duration_s = event.value("frames", 0.0) / event.value("rate_hz", 100.0);
        write_config(event);
        std::cout << "Simulated lab: QTM on port " << event.value("qtm_port", 0) << ", UR10e controller on port "
                  << event.value("ur_port", 0) << ", Mia hand on " << event.value("mia_device", "") << "; playing "
                  << recording << "\n"
                  << kLimits;
        return kExitOk;
      }
    }
    return interrupted_ ? kExitInterrupted : child_failed("the simulated lab", *lab_, "sim.log");
  }

  int start_daemon() {
    auto daemon = ChildProcess::start(folder_of_this_program() + "/embodyd", {"--config", folder_.file("demo.toml")},
                                      folder_.file("embodyd.log"));
    if (!daemon) return fail(std::string(daemon.error().detail.view()), kExitFailed);
    daemon_.emplace(std::move(*daemon));
    const TimePoint deadline = now() + seconds(20);
    while (now() < deadline && !daemon_->exit_code() && !interrupted_) {
      auto client = control::ControlClient::connect(folder_.file("control.sock"));
      if (client) {
        client_.emplace(std::move(*client));
        return kExitOk;
      }
      wait(milliseconds(20));
    }
    return interrupted_ ? kExitInterrupted : child_failed("embodyd", *daemon_, "embodyd.log");
  }

  /// Sleeps, but wakes for the lab's output and for Ctrl-C.
  void wait(milliseconds time) {
    const bool lab_speaks = lab_ && !lab_->exit_code();
    pollfd entries[2] = {{lab_speaks ? lab_->output_fd() : -1, POLLIN, 0}, {signals_.fd(), POLLIN, 0}};
    ::poll(entries, 2, static_cast<int>(time.count()));
    while (signals_.take() != 0) {
      if (interrupted_) signals_.restore();  // the third Ctrl-C ends everything at once
      interrupted_ = true;
    }
  }

  std::optional<control::Response> ask(control::Command command) {
    control::Request request;
    request.command = command;
    auto response = client_->request(request, seconds(2));
    if (!response) return std::nullopt;
    return *response;
  }

  std::string status() {
    const auto response = ask(control::Command::kStatus);
    return response ? response->result : "{}";
  }

  int operate() {
    while (true) {
      wait(milliseconds(20));
      if (interrupted_) return kExitInterrupted;
      if (daemon_->exit_code()) return child_failed("embodyd", *daemon_, "embodyd.log");
      if (lab_->exit_code()) return child_failed("the simulated lab", *lab_, "sim.log");
      if (take_events()) return kExitOk;
      if (now() < t_next_look_) continue;
      t_next_look_ = now() + milliseconds(50);
      look();
      if (now() - t_started_ > seconds(30) && t_playback_ == TimePoint{}) {
        std::cerr << live_table(last_status_, progress_);
        return fail("the devices did not come up within 30 s", kExitUnavailable);
      }
    }
  }

  /// True when the playback is over; disengages at once.
  bool take_events() {
    for (auto line = lab_->next_line(); line; line = lab_->next_line()) {
      const std::string event = json::parse(*line, nullptr, false).value("event", "");
      if (event == "devices_in_use") t_playback_ = now();
      if (event == "playback_finished") {
        ask(control::Command::kDisengage);
        t_finished_ = now();
        return true;
      }
    }
    return false;
  }

  /// One look at the status: engage where that is possible, show it.
  void look() {
    last_status_ = status();
    const std::string mode = json::parse(last_status_, nullptr, false).value("/mode/name"_json_pointer, "");
    if (mode == "aligned" || mode == "holding") engage();
    if (mode == "stopped") reset();
    if (mode == "engaged" && status_engaged_.empty()) {
      status_engaged_ = last_status_;
      t_engaged_ = now();
    }
    if (t_playback_ != TimePoint{}) progress_.elapsed_s = to_seconds(now() - t_playback_);
    if (now() < t_next_show_) return;
    t_next_show_ = now() + (terminal_ ? milliseconds(200) : milliseconds(2000));
    if (!terminal_) {
      std::cout << live_line(last_status_, progress_) << std::flush;
      return;
    }
    const std::string table = live_table(last_status_, progress_);
    if (shown_lines_ > 0) std::cout << "\033[" << shown_lines_ << "A\033[J";
    shown_lines_ = std::count(table.begin(), table.end(), '\n');
    std::cout << table << std::flush;
  }

  void engage() {
    const auto response = ask(control::Command::kEngage);
    if (!response || !response->ok) return;
    if (engaged_once_) ++progress_.re_engagements;
    engaged_once_ = true;
  }

  /// A stop is worth a line: the operator would look for its cause.
  void reset() {
    const auto response = ask(control::Command::kReset);
    if (!response || !response->ok) return;
    const json s = json::parse(last_status_, nullptr, false);
    std::cout << "stopped: " << s.value("/mode/cause"_json_pointer, "?") << "; reset by the demo\n";
    shown_lines_ = 0;
    ++progress_.resets;
  }

  /// Ends the daemon, then the lab; prints the summary.
  int finish() {
    const std::string status_after = client_ ? status() : "{}";
    int daemon_code = kExitOk;
    if (daemon_) {
      daemon_->signal(SIGTERM);
      daemon_code = daemon_->wait(now() + seconds(10));
    }
    if (!lab_) return kExitFailed;
    lab_->signal(SIGTERM);
    std::string report;
    const TimePoint deadline = now() + seconds(60);
    while (now() < deadline) {
      wait(milliseconds(20));
      const bool ended = lab_->exit_code().has_value();
      for (auto line = lab_->next_line(); line; line = lab_->next_line()) {
        const json event = json::parse(*line, nullptr, false);
        if (event.value("event", "") == "report") report = event["report"].dump();
      }
      if (ended) break;
    }
    if (t_finished_ == TimePoint{}) return kExitFailed;  // interrupted: nothing to judge
    const double played_s = t_engaged_ == TimePoint{} ? 0.0 : to_seconds(t_finished_ - t_engaged_);
    const std::string summary = summary_json(report, status_engaged_, status_after, played_s, progress_);
    std::cout << "\nSummary\n" << summary_text(summary);
    if (!options_.json_file.empty()) {
      std::ofstream file(options_.json_file);
      file << summary << "\n";
      if (!file.flush()) return fail("cannot write " + options_.json_file, kExitFailed);
    }
    if (daemon_code != kExitOk) return child_failed("embodyd", *daemon_, "embodyd.log");
    return json::parse(summary).value("followed", false) ? kExitOk : kExitNotFollowing;
  }

  DemoOptions options_;
  bool terminal_;
  StopSignals signals_;
  PrivateFolder folder_;
  std::optional<ChildProcess> lab_;  // outlives the daemon
  std::optional<ChildProcess> daemon_;
  std::optional<control::ControlClient> client_;
  DemoProgress progress_;
  std::string last_status_{"{}"};
  std::string status_engaged_;
  TimePoint t_started_{now()};
  TimePoint t_playback_{};
  TimePoint t_engaged_{};
  TimePoint t_finished_{};
  TimePoint t_next_look_{};
  TimePoint t_next_show_{};
  std::ptrdiff_t shown_lines_{0};
  bool engaged_once_{false};
  bool interrupted_{false};
};

}  // namespace

int run_demo(const DemoOptions& options) {
  return Demo(options).run();
}

void add_demo_command(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<DemoOptions>();
  CLI::App* command = app.add_subcommand(
      "demo", "Play a recording through the simulated lab and the daemon, and judge whether the robot followed");
  command->add_option("--recording", options->recording, "QTM export (TSV) to play; default: the shipped recording");
  command->add_option("--duration", options->duration_s, "Play only so many seconds")->check(CLI::PositiveNumber);
  command->add_option("--json", options->json_file, "Write the summary to this file, for programs");
  command->callback([options, &exit_code] { exit_code = run_demo(*options); });
}

}  // namespace embody::ctl
