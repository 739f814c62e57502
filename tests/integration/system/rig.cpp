#include "tests/integration/system/rig.hpp"

#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <thread>

#include "drivers/transport/clock.hpp"

namespace embody::test {
namespace {

namespace fs = std::filesystem;
using std::chrono::milliseconds;
using std::chrono::seconds;
using transport::now;

std::string program(const std::string& name) {
  return std::string(EMBODY_BINARY_DIR) + "/" + name;
}

}  // namespace

Finished run_program(const std::string& name, const std::vector<std::string>& arguments, int seconds_) {
  const TemporaryFolder folder;
  Finished finished;
  auto child = ctl::ChildProcess::start(program(name), arguments, folder.file("log"));
  if (!child) {
    finished.errors = child.error().detail.view();
    return finished;
  }
  const TimePoint deadline = now() + seconds(seconds_);
  while (!child->exit_code() && now() < deadline) {
    for (auto line = child->next_line(); line; line = child->next_line()) finished.output += *line + "\n";
    std::this_thread::sleep_for(milliseconds(5));
  }
  finished.exit_code = child->wait(now());
  for (auto line = child->next_line(); line; line = child->next_line()) finished.output += *line + "\n";
  finished.errors = folder.read("log");
  return finished;
}

TemporaryFolder::TemporaryFolder() {
  std::string name = "/tmp/embody-test-XXXXXX";
  path_ = ::mkdtemp(name.data());
}
TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}
void TemporaryFolder::write(const std::string& name, const std::string& text) const {
  std::ofstream(file(name)) << text;
}
std::string TemporaryFolder::read(const std::string& name) const {
  std::ifstream in(file(name));
  std::stringstream text;
  text << in.rdbuf();
  return text.str();
}

Rig::Rig(const RigOptions& options) {
  const std::string recording =
      options.recording.empty() ? std::string(EMBODY_SOURCE_DIR) + "/config/recordings/demo.tsv" : options.recording;
  const auto config = [&](const json& ready) {
    const auto port = [&ready](const char* name) { return std::to_string(ready.value(name, 1)); };
    return "schema = 1\n[tracker]\nport = " + port("qtm_port") + "\n[arm]\nport = " + port("ur_port") +
           "\ndashboard_port = " + port("ur_dashboard_port") +
           "\nstale_after_ms = 500\n[arm.program]\nport = " + port("ur_primary_port") +
           "\nwatchdog_hz = 2.0\n[arm.limits]\nspeed_m_s = 0.6\nspeed_rad_s = 2.5\n[hand]\ndevice = \"" +
           folder.file("mia") + "\"\n[safety]\nhold_after_ms = 100\n[control]\nsocket = \"" +
           folder.file("control.sock") + "\"\n[dds]\nenabled = false\n" + options.extra_config;
  };
  folder.write("embody.toml", config(json::object()));
  std::vector<std::string> arguments{"run",        recording,         "--wait", "--config", folder.file("embody.toml"),
                                     "--mia-link", folder.file("mia")};
  if (options.duration_s > 0.0) arguments.insert(arguments.end(), {"--duration", std::to_string(options.duration_s)});
  auto lab = ctl::ChildProcess::start(program("embody-sim"), arguments, folder.file("sim.log"));
  EXPECT_TRUE(lab.ok()) << lab.error().detail.view();
  if (!lab) return;
  lab_.emplace(std::move(*lab));
  const json ready = wait_event("ready");
  folder.write("embody.toml", config(ready));
  if (options.start_daemon) start_daemon();
}

Rig::~Rig() {
  client_.reset();
  if (daemon_ && !daemon_->exit_code()) stop_daemon(SIGTERM);
  if (lab_) {
    lab_->signal(SIGTERM);
    lab_->wait(now() + seconds(20));
  }
  if (::testing::Test::HasFailure())
    std::fprintf(stderr, "%s\n%s\n", daemon_log().c_str(), folder.read("sim.log").c_str());
}

void Rig::start_daemon() {
  auto daemon = ctl::ChildProcess::start(program("embodyd"), {"--config", folder.file("embody.toml")},
                                         folder.file("embodyd.log"));
  ASSERT_TRUE(daemon.ok()) << daemon.error().detail.view();
  daemon_.emplace(std::move(*daemon));
  const TimePoint deadline = now() + seconds(10);
  client_.reset();
  while (now() < deadline && !client_) {
    auto client = control::ControlClient::connect(folder.file("control.sock"));
    if (client) client_.emplace(std::move(*client));
    std::this_thread::sleep_for(milliseconds(10));
  }
  ASSERT_TRUE(client_.has_value()) << "embodyd does not listen: " << daemon_log();
}

json Rig::wait_event(const std::string& name, int seconds_) {
  const TimePoint deadline = now() + seconds(seconds_);
  while (now() < deadline) {
    for (auto line = lab_->next_line(); line; line = lab_->next_line()) {
      const json event = json::parse(*line, nullptr, false);
      if (event.is_object() && event.value("event", "") == name) return event;
    }
    if (lab_->exit_code()) break;
    std::this_thread::sleep_for(milliseconds(5));
  }
  ADD_FAILURE() << "the lab never said '" << name << "': " << folder.read("sim.log");
  return json::object();
}

json Rig::report() {
  lab("report");
  return wait_event("report")["report"];
}

json Rig::ask(control::Command command) {
  control::Request request;
  request.command = command;
  const auto response = client_->request(request, seconds(10));
  if (!response)
    return {{"ok", false}, {"result", json::object()}, {"error", {{"message", response.error().detail.view()}}}};
  return {{"ok", response->ok},
          {"result", json::parse(response->result, nullptr, false)},
          {"error", {{"code", response->code}, {"message", response->message}}}};
}

bool Rig::until(const std::function<bool(const json&)>& condition, int seconds_) {
  const TimePoint deadline = now() + seconds(seconds_);
  while (now() < deadline) {
    const json s = status();
    if (s.contains("mode") && condition(s)) return true;
    std::this_thread::sleep_for(milliseconds(10));
  }
  return false;
}

bool Rig::until_mode(const std::string& name, int seconds_) {
  return until([&](const json& s) { return s["mode"]["name"] == name; }, seconds_);
}

bool Rig::engage() {
  return until([&](const json&) { return ask(control::Command::kEngage)["ok"].get<bool>(); });
}

bool Rig::play_and_engage() {
  const auto connected = [](const json& s) {
    for (const auto& device : s["devices"]) {
      if (device["state"] != "connected") return false;
    }
    return s["mode"]["name"] != "offline";
  };
  if (!until(connected)) return false;
  lab("play");
  // The robot's program confirms within some cycles that it follows.
  return engage() && until([](const json& s) { return s["counters"]["hand_commands"] > 0; });
}

int Rig::stop_daemon(int signal) {
  client_.reset();
  daemon_->signal(signal);
  return daemon_->wait(now() + seconds(15));
}

}  // namespace embody::test
