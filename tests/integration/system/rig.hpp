#pragma once
// The real binaries against each other: embody-sim plays a recording, embodyd drives its devices.
#include <gtest/gtest.h>

#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "daemon/control/control_client.hpp"
#include "daemon/ctl/child_process.hpp"

namespace embody::test {

using nlohmann::json;

/// A program run to its end.
struct Finished {
  int exit_code{-1};
  std::string output;  ///< standard output
  std::string errors;  ///< standard error
};
/// @param seconds after which the program is killed
Finished run_program(const std::string& name, const std::vector<std::string>& arguments, int seconds = 20);

/// A folder that disappears with its owner.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  [[nodiscard]] std::string file(const std::string& name) const { return path_ + "/" + name; }
  void write(const std::string& name, const std::string& text) const;
  [[nodiscard]] std::string read(const std::string& name) const;

 private:
  std::string path_;
};

struct RigOptions {
  std::string recording;  ///< empty: the shipped one
  double duration_s{0.0};
  std::string extra_config;  ///< TOML appended to the configuration
  bool start_daemon{true};
};

/// Simulated lab and daemon. Playback waits for play(). Everything ends with the rig.
class Rig {
 public:
  explicit Rig(const RigOptions& options = {});
  ~Rig();

  void start_daemon();
  /// Sends a line to the lab: a fault or "play".
  void lab(const std::string& line) { lab_->send_line(line); }
  /// Next event of the lab with this name; fails the test after `seconds`.
  json wait_event(const std::string& name, int seconds = 20);
  /// The lab's judgement and counts now.
  json report();

  /// One request to the daemon; {"ok":..., "result" or "error":...}.
  json ask(control::Command command);
  json status() { return ask(control::Command::kStatus)["result"]; }
  std::string mode() { return status()["mode"]["name"]; }
  /// Looks at the status until `condition` holds; false after `seconds`.
  bool until(const std::function<bool(const json& status)>& condition, int seconds = 10);
  bool until_mode(const std::string& name, int seconds = 10);
  /// play() and engage as an operator would; false when that fails within 10 s.
  bool play_and_engage();
  bool engage();
  /// Ends the daemon with a signal and returns its exit code.
  int stop_daemon(int signal);

  ctl::ChildProcess& daemon() { return *daemon_; }
  [[nodiscard]] std::string daemon_log() const { return folder.read("embodyd.log"); }

  TemporaryFolder folder;

 private:
  std::optional<ctl::ChildProcess> lab_;
  std::optional<ctl::ChildProcess> daemon_;
  std::optional<control::ControlClient> client_;
};

}  // namespace embody::test
