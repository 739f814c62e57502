#include "daemon/simlab/lab_run.hpp"

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <iostream>
#include <nlohmann/json.hpp>
#include <vector>

#include "daemon/simlab/fault_script.hpp"
#include "daemon/simlab/lab_desk.hpp"
#include "drivers/transport/clock.hpp"

namespace embody::sim {
namespace {

using nlohmann::json;
using std::chrono::milliseconds;

void say(const json& event) {
  std::cout << event.dump(-1, ' ', false, json::error_handler_t::replace) << std::endl;
}

/// Lines of standard input; keeps what follows the last newline.
class Lines {
 public:
  /// Complete lines so far; false at the end of the input.
  bool read(std::vector<std::string>& lines) {
    std::array<char, 512> chunk{};
    const ssize_t size = ::read(STDIN_FILENO, chunk.data(), chunk.size());
    if (size <= 0) return false;
    text_.append(chunk.data(), static_cast<std::size_t>(size));
    for (std::size_t end = text_.find('\n'); end != std::string::npos; end = text_.find('\n')) {
      lines.push_back(text_.substr(0, end));
      text_.erase(0, end + 1);
    }
    if (text_.size() > 4096) text_.clear();
    return true;
  }

 private:
  std::string text_;
};

class Run {
 public:
  Run(Lab& lab, StopSignals& signals, const LabRunOptions& options) : lab_(lab), signals_(signals), options_(options) {}

  Status prepare() {
    if (!options_.fault_script.empty()) {
      auto script = load_script(options_.fault_script, lab_.fault_check());
      if (!script) return script.error();
      script_ = ScriptReader(std::move(*script));
    }
    return options_.no_socket ? Status() : open_socket();
  }

  void loop() {
    say_ready();
    while (!quit_) {
      if (!wait()) break;
      act_on_script();
      watch();
    }
    signals_.restore();
    say_report();
  }

 private:
  /// A default place that somebody else has, or that cannot be used, is no reason not to run.
  Status open_socket() {
    const bool asked_for = !options_.socket.empty();
    const std::string path = asked_for ? options_.socket : default_lab_socket();
    auto server = open_lab_socket(path, make_lab_desk(lab_, [](const std::string& fault) {
                                    say({{"event", "fault"}, {"fault", fault}});
                                  }));
    if (server) {
      server_ = std::move(*server);
      socket_ = path;
      return {};
    }
    if (asked_for) return server.error();
    std::cerr << "embody-sim: no socket for 'embodyctl sim': " << server.error().detail.view() << "\n";
    return {};
  }

  void say_ready() const {
    say({{"event", "ready"},
         {"qtm_port", lab_.qtm_port()},
         {"ur_port", lab_.ur().port()},
         {"ur_primary_port", lab_.ur().primary_port()},
         {"ur_dashboard_port", lab_.ur().dashboard_port()},
         {"mia_device", lab_.mia_device()},
         {"hand", lab_.hand().name()},
         {"hand_device", lab_.hand().device()},
         {"socket", socket_},
         {"frames", lab_.frame_count()},
         {"rate_hz", lab_.rate_hz()}});
  }

  void say_report() const { say({{"event", "report"}, {"report", json::parse(lab_.report_json())}}); }

  /// Until something comes in or is due; obeys what came. False: a signal.
  bool wait() {
    std::array<pollfd, 3> entries{pollfd{signals_.fd(), POLLIN, 0}, pollfd{input_open_ ? STDIN_FILENO : -1, POLLIN, 0},
                                  pollfd{server_ ? server_->fd() : -1, POLLIN, 0}};
    const Duration left = std::clamp<Duration>(time_to_next_fault(), Duration{0}, pause());
    const timespec timeout{0, left.count()};
    ::ppoll(entries.data(), entries.size(), &timeout, nullptr);
    if (signals_.take() != 0) return false;
    std::vector<std::string> lines;
    if (entries[1].revents != 0) input_open_ = input_.read(lines);
    for (const std::string& line : lines) obey(line);
    if (server_ && entries[2].revents != 0) server_->serve();
    return true;
  }

  /// The end of the playback is looked for more often than the first clients.
  [[nodiscard]] Duration pause() const { return in_use_ && !finished_ ? milliseconds(2) : milliseconds(20); }

  [[nodiscard]] Duration time_to_next_fault() const {
    const auto t_play = lab_.t_play();
    const Duration next = script_.next();
    return !t_play || next == Duration::max() ? Duration(milliseconds(20)) : *t_play + next - transport::now();
  }

  void act_on_script() {
    const auto t_play = lab_.t_play();
    if (!t_play) return;
    while (const ScriptedFault* fault = script_.take(transport::now() - *t_play)) {
      const double at_s = to_seconds(fault->at);
      if (const Status made = lab_.fault(fault->command); !made) {
        say({{"event", "error"}, {"message", made.error().detail.view()}, {"line", fault->line}, {"at_s", at_s}});
      } else {
        say({{"event", "fault"}, {"fault", fault->command}, {"line", fault->line}, {"at_s", at_s}});
      }
    }
  }

  void obey(const std::string& line) {
    if (line.empty()) return;
    if (line == "play") return lab_.play();
    if (line == "report") return say_report();
    if (line == "quit") {
      quit_ = true;
    } else if (const Status made = lab_.fault(line); !made) {
      say({{"event", "error"}, {"message", made.error().detail.view()}});
    } else {
      say({{"event", "fault"}, {"fault", line}});
    }
  }

  void watch() {
    if (!in_use_ && lab_.all_devices_in_use()) {
      in_use_ = true;
      say({{"event", "devices_in_use"}});
      if (!options_.wait_for_play) lab_.play();
    }
    if (!finished_ && lab_.finished()) {
      finished_ = true;
      say({{"event", "playback_finished"}});
    }
  }

  Lab& lab_;
  StopSignals& signals_;
  const LabRunOptions& options_;
  ScriptReader script_;
  std::unique_ptr<control::ControlServer> server_;
  std::string socket_;
  Lines input_;
  bool input_open_{true};
  bool in_use_{false};
  bool finished_{false};
  bool quit_{false};
};

}  // namespace

Status run_lab(Lab& lab, StopSignals& signals, const LabRunOptions& options) {
  Run run(lab, signals, options);
  if (Status prepared = run.prepare(); !prepared) return prepared;
  run.loop();
  return {};
}

}  // namespace embody::sim
