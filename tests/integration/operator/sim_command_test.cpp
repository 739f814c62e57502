// `embodyctl sim` as people and programs call it, against a lab that runs.
#include <fcntl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>

#include <csignal>
#include <thread>

#include "daemon/control/exit_code.hpp"
#include "drivers/transport/clock.hpp"
#include "drivers/transport/unique_fd.hpp"
#include "tests/integration/system/rig.hpp"

namespace embody::test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using transport::now;

const std::string kRecording = EMBODY_SOURCE_DIR "/config/recordings/demo.tsv";

/// A lab without a daemon, with a socket of its own.
class SimCommand : public ::testing::Test {
 protected:
  void start(std::vector<std::string> options = {}, const std::string& extra_config = "") {
    folder_.write("embody.toml", "schema = 1\n" + extra_config);
    std::vector<std::string> arguments{"run", kRecording, "--duration", "3", "--config", folder_.file("embody.toml")};
    if (std::find(options.begin(), options.end(), "--no-socket") == options.end()) {
      arguments.insert(arguments.end(), {"--socket", socket()});
    }
    arguments.insert(arguments.end(), options.begin(), options.end());
    auto lab = ctl::ChildProcess::start(EMBODY_BINARY_DIR "/embody-sim", arguments, folder_.file("sim.log"));
    ASSERT_TRUE(lab.ok()) << lab.error().detail.view();
    lab_.emplace(std::move(*lab));
    ready_ = event("ready");
  }
  void TearDown() override {
    if (!lab_) return;
    lab_->signal(SIGTERM);
    EXPECT_EQ(lab_->wait(now() + seconds(20)), kExitOk) << folder_.read("sim.log");
  }

  [[nodiscard]] std::string socket() const { return folder_.file("sim.sock"); }

  json event(const std::string& name) {
    for (const TimePoint deadline = now() + seconds(20); now() < deadline;) {
      for (auto line = lab_->next_line(); line; line = lab_->next_line()) {
        const json event = json::parse(*line, nullptr, false);
        if (event.is_object() && event.value("event", "") == name) return event;
      }
      if (lab_->exit_code()) break;
      std::this_thread::sleep_for(milliseconds(2));
    }
    ADD_FAILURE() << "no event '" << name << "': " << folder_.read("sim.log");
    return json::object();
  }

  Finished sim(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), "sim");
    arguments.insert(arguments.end(), {"--socket", socket()});
    return run_program("embodyctl", arguments, 40);
  }
  json answer(std::vector<std::string> arguments) const {
    arguments.emplace_back("--json");
    const Finished finished = sim(arguments);
    EXPECT_EQ(finished.exit_code, kExitOk) << finished.output << finished.errors;
    return json::parse(finished.output, nullptr, false).value("result", json());
  }

  TemporaryFolder folder_;
  std::optional<ctl::ChildProcess> lab_;
  json ready_;
};

TEST_F(SimCommand, MakesFaultsHappenWhetherTheWordsAreOneOrMany) {
  start({"--wait"});
  EXPECT_EQ(ready_["socket"], socket());
  for (const std::vector<std::string>& words : {std::vector<std::string>{"qtm hide index_tip"},
                                                {"qtm", "hide", "index_tip"},
                                                {"ur", "freeze", "0.1"},
                                                {"mia", "unplug"}}) {
    std::vector<std::string> arguments{"fault"};
    arguments.insert(arguments.end(), words.begin(), words.end());
    const Finished made = sim(arguments);
    EXPECT_EQ(made.exit_code, kExitOk) << made.errors;
    EXPECT_NE(made.output.find(": done"), std::string::npos);
    std::string joined;
    for (const std::string& word : words) joined += (joined.empty() ? "" : " ") + word;
    EXPECT_EQ(event("fault")["fault"], joined) << "the lab says so too";
  }
  EXPECT_EQ(answer({"status"})["hand"]["device"], "") << "it is unplugged";
}

TEST_F(SimCommand, ARefusedFaultIsTheSimulatorsSentenceAndAnExitCode) {
  start({"--wait"});
  const Finished unknown = sim({"fault", "qtm hide nobody"});
  EXPECT_EQ(unknown.exit_code, kExitFailed);
  EXPECT_NE(unknown.errors.find("has no marker 'nobody'"), std::string::npos) << unknown.errors;
  EXPECT_NE(sim({"fault", "robotiq", "mute", "on"}).errors.find("qtm, ur or mia"), std::string::npos);
  const json error = json::parse(sim({"fault", "ur", "explode", "--json"}).output, nullptr, false);
  EXPECT_EQ(error["ok"], false);
  EXPECT_EQ(error["error"]["code"], "failed");
  EXPECT_EQ(sim({}).exit_code, kExitUsage);
  EXPECT_EQ(sim({"fault"}).exit_code, kExitUsage);
  EXPECT_EQ(sim({"fault", std::string(500, 'x')}).exit_code, kExitUsage);
  EXPECT_NE(unknown.errors.find("embodyctl sim faults"), std::string::npos) << "it says where to look";
  const Finished misspelt = sim({"fualt"});
  EXPECT_EQ(misspelt.exit_code, kExitUsage);
  EXPECT_NE(misspelt.errors.find("'fualt'"), std::string::npos) << misspelt.errors;
}

TEST_F(SimCommand, ListsFaultsShowsStatusAndReportAndStartsThePlayback) {
  start({"--wait"});
  const Finished list = sim({"faults"});
  for (const char* word : {"qtm\n", "ur\n", "mia\n", "disconnect", "freeze on|off|SECONDS", "stall MOTOR on|off"}) {
    EXPECT_NE(list.output.find(word), std::string::npos) << word << " in\n" << list.output;
  }
  EXPECT_GT(answer({"faults"})["faults"].size(), 60U);
  EXPECT_EQ(answer({"status"})["playback"], "waiting");
  EXPECT_EQ(answer({"report"})["followed"], false);
  EXPECT_NE(sim({"report"}).output.find("followed  no"), std::string::npos);
  EXPECT_EQ(sim({"play"}).exit_code, kExitOk);
  event("playback_finished");
  EXPECT_EQ(answer({"status"})["playback"], "finished");
  EXPECT_NE(sim({"status"}).output.find("finished, "), std::string::npos);
}

TEST_F(SimCommand, SaysWhenNoLabRuns) {
  const Finished nobody = sim({"status"});
  EXPECT_EQ(nobody.exit_code, kExitUnavailable);
  EXPECT_NE(nobody.errors.find("embody-sim is not running"), std::string::npos) << nobody.errors;
  EXPECT_EQ(json::parse(sim({"status", "--json"}).output, nullptr, false)["error"]["code"], "unavailable");
}

TEST_F(SimCommand, TheSocketIsTheUsersOnlyAndGoesWithTheLab) {
  start({"--wait"});
  struct stat status {};
  ASSERT_EQ(::stat(socket().c_str(), &status), 0);
  EXPECT_TRUE(S_ISSOCK(status.st_mode));
  EXPECT_EQ(status.st_mode & 0777, 0600U);
  const Finished second =
      run_program("embody-sim", {"run", kRecording, "--config", folder_.file("embody.toml"), "--socket", socket()}, 20);
  EXPECT_EQ(second.exit_code, kExitFailed) << second.output;
  EXPECT_NE(second.errors.find("another embody-sim answers on"), std::string::npos) << second.errors;
  EXPECT_EQ(answer({"status"})["playback"], "waiting") << "the first goes on";
  lab_->signal(SIGTERM);
  EXPECT_EQ(lab_->wait(now() + seconds(20)), kExitOk);
  lab_.reset();
  EXPECT_NE(::stat(socket().c_str(), &status), 0);
}

TEST_F(SimCommand, WithoutASocketStandardInputRemains) {
  start({"--wait", "--no-socket"});
  EXPECT_EQ(ready_["socket"], "");
  struct stat status {};
  EXPECT_NE(::stat(socket().c_str(), &status), 0);
  lab_->send_line("qtm hide index_tip");
  EXPECT_EQ(event("fault")["fault"], "qtm hide index_tip");
  lab_->send_line("qtm hide \xff\xfe");
  EXPECT_TRUE(event("error").contains("message")) << "text that is no UTF-8 ends nothing";
  lab_->send_line("report");
  EXPECT_EQ(event("report")["report"]["followed"], false);
}

/// Connects by hand, to say what embodyctl never would.
transport::UniqueFd connect_to(const std::string& path) {
  transport::UniqueFd fd(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path.copy(address.sun_path, sizeof address.sun_path - 1);
  EXPECT_EQ(::connect(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  return fd;
}

TEST_F(SimCommand, ClientsThatSayRubbishOrNeverReadDelayNobody) {
  start({"--wait"});
  const auto rubbish = connect_to(socket());
  const std::string lines = "hello\n{\"protocol\":1,\"command\":\"engage\"}\n";
  ASSERT_EQ(::send(rubbish.get(), lines.data(), lines.size(), MSG_NOSIGNAL), static_cast<ssize_t>(lines.size()));
  std::string heard;
  char chunk[1024];
  while (std::count(heard.begin(), heard.end(), '\n') < 2) {
    const ssize_t size = ::recv(rubbish.get(), chunk, sizeof chunk, 0);
    ASSERT_GT(size, 0);
    heard.append(chunk, static_cast<std::size_t>(size));
  }
  EXPECT_NE(heard.find("one JSON object"), std::string::npos) << heard;
  EXPECT_NE(heard.find("command must be one of"), std::string::npos) << heard;

  const auto endless = connect_to(socket());
  const std::string flood(200'000, 'x');
  static_cast<void>(::send(endless.get(), flood.data(), flood.size(), MSG_NOSIGNAL | MSG_DONTWAIT));
  const auto deaf = connect_to(socket());
  const std::string ask = "{\"protocol\":1,\"command\":\"faults\"}\n";
  for (int i = 0; i < 2000; ++i) {
    if (::send(deaf.get(), ask.data(), ask.size(), MSG_NOSIGNAL | MSG_DONTWAIT) < 0) break;
  }
  EXPECT_EQ(answer({"status"})["playback"], "waiting");
}

TEST_F(SimCommand, AScriptMakesItsFaultsHappenAtTheirTimes) {
  folder_.write("f.faults",
                "# seconds since the start of the playback\n0.6 ur freeze 0.1\n0.2s qtm hide index_tip\n"
                "0.4 mia mute on\n0.7 qtm rename_label thumb_tip x\n");
  start({"--wait", "--faults", folder_.file("f.faults")});
  EXPECT_EQ(answer({"status"})["playback"], "waiting");
  lab_->send_line("play");
  double last_s = 0.0;
  for (const char* fault : {"qtm hide index_tip", "mia mute on", "ur freeze 0.1", "qtm rename_label thumb_tip x"}) {
    const json made = event("fault");
    EXPECT_EQ(made["fault"], fault);
    EXPECT_GT(made["at_s"], last_s);
    last_s = made["at_s"];
    EXPECT_GE(answer({"status"})["playing_s"].get<double>(), last_s) << "not before its time";
  }
}

TEST_F(SimCommand, AScriptWithAMistakeIsRefusedBeforeAnythingStarts) {
  for (const auto& [text, why] : std::vector<std::pair<std::string, std::string>>{
           {"1 qtm hide index_tip\n2 qtm hide nobody\n", ":2: the simulated QTM has no marker 'nobody'"},
           {"1 robotiq mute on\n", ":1: a fault begins with the device, qtm, ur or mia"},
           {"soon qtm kill\n", ":1: a line starts with seconds"},
           {"1 ur explode\n", ":1: unknown fault 'explode'"}}) {
    folder_.write("bad.faults", text);
    folder_.write("embody.toml", "schema = 1\n");
    const Finished finished = run_program("embody-sim",
                                          {"run", kRecording, "--config", folder_.file("embody.toml"), "--socket",
                                           socket(), "--faults", folder_.file("bad.faults")},
                                          20);
    EXPECT_EQ(finished.exit_code, kExitFailed);
    EXPECT_EQ(finished.output, "") << "nothing was ready";
    EXPECT_NE(finished.errors.find(folder_.file("bad.faults") + why), std::string::npos) << finished.errors;
  }
}

TEST_F(SimCommand, TheLabsHandIsTheConfiguredOne) {
  start({"--wait"}, "[hand]\nfile = \"" EMBODY_SOURCE_DIR "/config/hands/robotiq_2f140.toml\"\ndriver = \"robotiq\"\n");
  EXPECT_EQ(ready_["hand"], "robotiq");
  EXPECT_EQ(ready_["hand_device"].get<std::string>().find("/dev/pts/"), 0U);
  EXPECT_EQ(sim({"fault", "robotiq", "object", "60"}).exit_code, kExitOk);
  EXPECT_NE(sim({"faults"}).output.find("object MM|none"), std::string::npos);
  EXPECT_EQ(answer({"status"})["hand"]["q_rad"].size(), 1U);
}

}  // namespace
}  // namespace embody::test
