#include "tests/integration/faults/cell.hpp"

#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <thread>

#include "core/robot/ur_kinematics.hpp"
#include "daemon/app/config_io.hpp"
#include "daemon/app/devices.hpp"
#include "daemon/simlab/follow_report.hpp"
#include "drivers/transport/clock.hpp"
#include "tests/integration/faults/operator_motion.hpp"

namespace embody::faults {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using transport::now;

/// Flange speeds as in the demonstration. What is slower than the product's default would have the matrix judge stalls
/// of the machine that it runs on: a simulated controller that is held up, and a program on it that ends.
std::string toml(const std::string& folder, const SimulatedTracker& tracker, const sim::UrController* arm,
                 HandKind hand) {
  const auto port = [arm](std::uint16_t (sim::UrController::*get)() const noexcept) {
    return std::to_string(arm == nullptr ? 1 : (arm->*get)());
  };
  std::string text = "schema = 1\n[arm]\nport = " + port(&sim::UrController::port) +
                     "\ndashboard_port = " + port(&sim::UrController::dashboard_port) +
                     "\nstale_after_ms = 500\n[arm.program]\nport = " + port(&sim::UrController::primary_port) +
                     "\nwatchdog_hz = 2.0\n[arm.limits]\nspeed_m_s = 0.6\nspeed_rad_s = 2.5\n[control]\nsocket = \"" +
                     folder + "/control.sock\"\n[dds]\nenabled = false\n[hand]\n";
  if (hand == HandKind::kRobotiq) text += "file = \"hands/robotiq_2f140.toml\"\ndriver = \"robotiq\"\n";
  text += "device = \"" + folder + "/hand\"\n";
  if (hand == HandKind::kCanMia) {
    text += "[hand.mia]\nwire = \"can_compact\"\ncan_interface = \"unix:" + folder + "/hand\"\n";
  }
  return text + "[tracker]\n" + tracker.config();
}

/// A usual pose of the arm (elbow up, wrist down) that has the robot hand where the operator's is.
Result<Vector6> first_joints(const config::EmbodyConfig& config) {
  config::EmbodyConfig glove = config;
  glove.tracker = {};  // the operator's hand is in the same place for any sensor
  const auto models = make_models(glove);
  if (!models) return models.error();
  const sim::Motion motion = operator_markers();
  recording::Recording recording;
  recording.rate_hz = motion.rate_hz;
  recording.marker_names = motion.marker_names;
  recording.frames.push_back(motion.frame(0));
  const auto targets = sim::ungated_targets(*models, recording, {{0, TimePoint{}}});
  if (targets.empty()) return make_error(Errc::kInvalidArgument, "the operator's hand has no pose");
  robot::UrJointRange range;
  range.lower_rad = models->arm.joints.lower_rad;
  range.upper_rad = models->arm.joints.upper_rad;
  return robot::solve_nearest(targets.front().X_BE, {0.0, -1.5708, 1.5708, -1.5708, -1.5708, 0.0}, range,
                              models->arm.geometry);
}

}  // namespace

Result<std::unique_ptr<Cell>> Cell::start(TrackerKind tracker, HandKind hand, const std::string& programs) {
  std::string folder = "/tmp/embody-faults-XXXXXX";
  if (::mkdtemp(folder.data()) == nullptr) return make_error(Errc::kIo, "cannot create a folder in /tmp");
  std::unique_ptr<Cell> cell(new Cell(folder, programs));
  if (const Status started = cell->start_devices(tracker, hand); !started) return started.error();
  if (const Status started = cell->start_daemon(); !started) return started.error();
  return cell;
}

Cell::~Cell() {
  client_.reset();
  if (daemon_ && !daemon_->exit_code()) {
    daemon_->signal(SIGCONT);
    daemon_->signal(SIGTERM);
    daemon_->wait(now() + seconds(10));
  }
  std::error_code ignored;
  std::filesystem::remove_all(folder_, ignored);
}

Status Cell::start_devices(TrackerKind tracker, HandKind hand) {
  tracker_ = make_tracker(tracker);
  if (const Status started = tracker_->start(); !started) return started;
  const auto config = config::parse_config(toml(folder_, *tracker_, nullptr, hand), "embody.toml", folder_);
  if (!config) return config.error();
  sim::HandOptions options;
  options.link = folder_ + "/hand";
  if (hand == HandKind::kStreamingMia) options.mia_generation = mia::Generation::kStreaming;
  hand_ = sim::make_simulated_hand(*config, options);
  if (const Status started = hand_->start(); !started) return started;
  const auto q_start = first_joints(*config);
  if (!q_start) return q_start.error();

  sim::UrControllerConfig arm;
  arm.robot.q_start_rad = *q_start;
  arm.robot.program = control_script_config(config->arm);
  arm.log_capacity = 15'000;  // half a minute: a row is shorter
  arm.times.boot = arm.times.power = arm.times.brakes = milliseconds(200);
  arm.times.unlock = milliseconds(500);
  arm_ = std::make_unique<sim::UrController>(arm);
  if (const Status started = arm_->start(); !started) return started;
  limits_ = {arm.robot.program.max_acceleration_rad_s2, arm.robot.program.max_velocity_rad_s, config->safety.hold_after,
             config->arm.stale_after, config->arm.program.watchdog_hz};
  config_ = folder_ + "/embody.toml";
  std::ofstream(config_) << toml(folder_, *tracker_, arm_.get(), hand);
  return {};
}

Status Cell::start_daemon() {
  if (daemon_) daemon_->wait(now() + seconds(5));
  auto daemon = ctl::ChildProcess::start(programs_ + "/embodyd", {"--config", config_}, folder_ + "/embodyd.log");
  if (!daemon) return daemon.error();
  daemon_.reset();
  daemon_.emplace(std::move(*daemon));
  suspended_ = false;
  ++daemons_started_;
  return connect();
}

Status Cell::connect() {
  client_.reset();
  for (const TimePoint deadline = now() + seconds(10); now() < deadline;) {
    auto client = control::ControlClient::connect(folder_ + "/control.sock");
    if (client) {
      client_.emplace(std::move(*client));
      return {};
    }
    std::this_thread::sleep_for(milliseconds(5));
  }
  return make_error(Errc::kTimeout, "embodyd does not listen");
}

Status Cell::act(const std::string& words) {
  const std::size_t blank = std::min(words.find(' '), words.size());
  const std::string who = words.substr(0, blank);
  const std::string what = words.substr(std::min(blank + 1, words.size()));
  if (who == "tracker") return tracker_->fault(what);
  if (who == "arm") return arm_->fault(what);
  if (who == "hand") return hand_->fault(what);
  if (who == "daemon") return act_on_daemon(what);
  if (who == "operator") return act_as_operator(what);
  if (words == "client leaves") return connect();
  if (words == "request stop") {
    return ask(control::Command::kStop) ? Status{} : make_error(Errc::kRefused, "no stop");
  }
  return make_error(Errc::kInvalidArgument, "the fault '%.60s' is for nobody", words.c_str());
}

Status Cell::act_on_daemon(const std::string& action) {
  if (action == "start") return start_daemon();
  if (action == "continue") {
    daemon_->signal(SIGCONT);
    suspended_ = false;
    return connect();
  }
  client_.reset();
  suspended_ = action == "stop";
  daemon_->signal(action == "kill" ? SIGKILL : action == "term" ? SIGTERM : SIGSTOP);
  return {};
}

Status Cell::act_as_operator(const std::string& action) {
  if (action == "calibrate" || action == "activate") {
    daemon_->wait(now() + seconds(5));
    auto program = ctl::ChildProcess::start(programs_ + "/embodyctl", {"hand", action, "--config", config_},
                                            folder_ + "/embodyctl.log");
    if (!program) return program.error();
    return program->wait(now() + seconds(10)) == 0 ? Status{}
                                                   : make_error(Errc::kIo, "embodyctl hand %s failed", action.c_str());
  }
  ur::DashboardConfig config;
  config.port = arm_->dashboard_port();
  ur::Dashboard dashboard(config);
  if (action == "unlock") return dashboard.unlock_protective_stop();
  if (action == "stop-program") return dashboard.stop_program();
  if (action == "bring-up") return dashboard.bring_up({}, [] { return false; });
  if (action == "restart-safety") {
    const auto reply = dashboard.ask("restart safety");
    return reply ? Status{} : reply.error();
  }
  return make_error(Errc::kInvalidArgument, "an operator cannot '%.60s'", action.c_str());
}

std::optional<json> Cell::look(control::Command command) {
  if (!client_ || !daemon_runs()) return std::nullopt;
  control::Request request;
  request.command = command;
  const auto response = client_->request(request, milliseconds(500));
  if (!response || !response->ok) {
    client_.reset();  // whatever still comes would be the answer to something else
    if (daemon_runs()) (void)connect();
    return std::nullopt;
  }
  json result = json::parse(response->result, nullptr, false);
  if (!result.is_object()) return std::nullopt;
  return result;
}

std::optional<json> Cell::status() {
  return look(control::Command::kStatus);
}

std::optional<json> Cell::markers() {
  return look(control::Command::kMarkers);
}

bool Cell::ask(control::Command command) {
  if (!client_ || !daemon_runs()) return false;
  control::Request request;
  request.command = command;
  const auto response = client_->request(request, seconds(5));
  return response && response->ok;
}

std::uint64_t Cell::hand_motions() const {
  for (const sim::HandCounter& counter : hand_->counters()) {
    if (std::string_view(counter.name) == "motions") return counter.value;
  }
  return 0;
}

std::string Cell::new_log() {
  std::ifstream in(folder_ + "/embodyd.log");
  std::stringstream text;
  text << in.rdbuf();
  const std::string all = text.str();
  const std::string fresh = all.substr(std::min(log_read_, all.size()));
  log_read_ = all.size();
  return fresh;
}

}  // namespace embody::faults
