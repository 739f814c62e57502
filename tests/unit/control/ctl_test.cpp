// embodyctl as its users run it: output and exit codes of the real program against a real socket.
#include <fcntl.h>
#include <grp.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <nlohmann/json.hpp>

#include "daemon/ctl/markers_view.hpp"
#include "daemon/ctl/status_table.hpp"
#include "tests/unit/control/serving.hpp"

namespace embody::ctl {
namespace {

using control::Command;
using control::Request;
using control::Response;
using nlohmann::json;

const std::string kProgram = std::string(EMBODY_BINARY_DIR) + "/embodyctl";

const char* const kStatus = R"({"version":"1.2.3","uptime_s":3725,
  "mode":{"name":"holding","cause":"tracker stale","since_s":2.5,"epoch":7},
  "devices":{"tracker":{"state":"connected","peer":"127.0.0.1:22223","detail":"",
                        "counters":{"frames":777,"skipped":0}},
             "arm":{"state":"missing","peer":"","detail":"connection refused"}},
  "rates_hz":{"tracker":99.98,"arm":500},
  "counters":{"frames_received":123456,"holds":2},
  "latency_us":{"decode":{"p50":12,"p99":40,"p999":80.5,"max":120},"arm":{"p50":3}},
  "marker_residual_mm":{"thumb":5.25,"index":4},
  "filter":{"lag_ms":{"thumb":400.0,"index":12.5},"lag_at_rest_ms":400,"lag_in_motion_ms":10,
            "predict_ms":0,"predict_pose_ms":40},
  "realtime":{"mode":"try","scheduled":false,"locked":true,"warning":"no rights"},
  "hand":{"condition":"fault","why_not":"too hot","supply":"low","position_rad":{"j_thumb":0.5},
          "current_raw":{"j_thumb":321},"force_raw":{"thumb":{"normal":-3,"tangential":4}}},
  "novelty":42})";

const char* const kMarkers = R"({"frame_number":4711,"frames":100,"valid":true,
  "confidence":{"hand":0.75,"thumb":1,"index":0.75},"quality":{"thumb":"optimal","index":"held"},
  "markers":[
    {"label":"hand_top","finger":"back","point":"top","seen":true,"seen_percent":100,"verdict":"used"},
    {"label":"index_tip","finger":"index","point":"tip","seen":true,"seen_percent":87.5,"verdict":"relabelled",
     "from":"middle_tip","residual_mm":1.25},
    {"label":"ring_tip","finger":"ring","point":"tip","seen":false,"seen_percent":0,"verdict":"missing"}],
  "back":{"state":"good","edges_mm":{"top_left":51.25},"reference_mm":{"top_left":51.5},"fit_error_mm":0.25},
  "findings":["index_tip and middle_tip are probably swapped"]})";

struct Outcome {
  int exit_code{-1};
  std::string output;  // standard output
  std::string errors;  // standard error
};

/// A started program with its two output streams.
class Program {
 public:
  Program(const std::vector<std::string>& arguments, bool as_nobody) {
    int out[2], err[2];
    if (::pipe2(out, O_CLOEXEC) != 0 || ::pipe2(err, O_CLOEXEC) != 0) throw std::runtime_error("pipe");
    pid_ = ::fork();
    if (pid_ == 0) {
      ::dup2(out[1], STDOUT_FILENO);
      ::dup2(err[1], STDERR_FILENO);
      std::vector<char*> argv{const_cast<char*>(kProgram.c_str())};
      for (const auto& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
      argv.push_back(nullptr);
      if (as_nobody && (::setgroups(0, nullptr) != 0 || ::setgid(65534) != 0 || ::setuid(65534) != 0)) ::_exit(126);
      ::execv(kProgram.c_str(), argv.data());
      ::_exit(127);
    }
    ::close(out[1]);
    ::close(err[1]);
    out_.reset(out[0]);
    err_.reset(err[0]);
  }
  [[nodiscard]] pid_t pid() const { return pid_; }
  /// Waits until something was printed.
  std::string read_some() {
    char text[4096];
    const ssize_t size = ::read(out_.get(), text, sizeof text);
    return {text, static_cast<std::size_t>(std::max<ssize_t>(size, 0))};
  }
  Outcome finish() {
    Outcome outcome;
    outcome.output = drain(out_.get());
    outcome.errors = drain(err_.get());
    int status = 0;
    ::waitpid(pid_, &status, 0);
    outcome.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
    return outcome;
  }

 private:
  static std::string drain(int fd) {
    std::string text;
    char piece[4096];
    for (ssize_t size = 0; (size = ::read(fd, piece, sizeof piece)) > 0;) {
      text.append(piece, static_cast<std::size_t>(size));
    }
    return text;
  }

  pid_t pid_{-1};
  transport::UniqueFd out_, err_;
};

class EmbodyCtl : public ::testing::Test {
 protected:
  EmbodyCtl() : serving_(path_, &answer) {}

  static Response answer(const Request& request) {
    switch (request.command) {
      case Command::kStatus:
        return {true, kStatus, "", ""};
      case Command::kMarkers:
        return {true, kMarkers, "", ""};
      case Command::kEngage:
        return control::refusal(control::code::kRefused, "the tracker is missing");
      case Command::kReset:
        return control::refusal(control::code::kNotFollowing, "the robot stands still");
      case Command::kShutdown:
        return control::refusal(control::code::kUnavailable, "no arm");
      default:
        return {true, R"({"mode":"idle"})", "", ""};
    }
  }
  [[nodiscard]] std::vector<std::string> with_socket(std::vector<std::string> arguments) const {
    arguments.insert(arguments.end(), {"--socket", path_});
    return arguments;
  }
  [[nodiscard]] Outcome run(const std::vector<std::string>& arguments, bool as_nobody = false) const {
    return Program(with_socket(arguments), as_nobody).finish();
  }

  control::test::TemporaryFolder folder_;
  std::string path_{folder_.path() + "/control.sock"};
  control::test::ServingThread serving_;
};

TEST_F(EmbodyCtl, ACommandThatTheDaemonTakesEndsWithZero) {
  const Outcome outcome = run({"stop"});
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_EQ(outcome.output, "stop: done, mode idle\n");
  const Outcome machine = run({"disengage", "--json"});
  EXPECT_EQ(machine.exit_code, 0);
  EXPECT_EQ(json::parse(machine.output)["result"]["mode"], "idle");
}

TEST_F(EmbodyCtl, TheReasonOfARefusalIsTheExitCodeAndOneSentence) {
  const Outcome refused = run({"engage"});
  EXPECT_EQ(refused.exit_code, 3);
  EXPECT_EQ(refused.errors, "embodyctl: the tracker is missing\n");
  EXPECT_EQ(refused.output, "");
  EXPECT_EQ(run({"reset"}).exit_code, 4);
  EXPECT_EQ(run({"shutdown"}).exit_code, 69);
}

TEST_F(EmbodyCtl, WithJsonAnErrorIsAnObjectOnStandardOutput) {
  const Outcome outcome = run({"engage", "--json"});
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_EQ(outcome.errors, "");
  EXPECT_EQ(json::parse(outcome.output)["error"]["code"], "refused");
}

TEST_F(EmbodyCtl, StatusIsATableOrTheDaemonsJson) {
  const Outcome table = run({"status"});
  EXPECT_EQ(table.exit_code, 0);
  EXPECT_EQ(table.output, status_table(kStatus));
  EXPECT_EQ(json::parse(run({"status", "--json"}).output), json::parse(kStatus));
}

TEST_F(EmbodyCtl, WatchGoesOnUntilInterrupted) {
  Program program(with_socket({"status", "--watch", "--json", "--interval-ms", "20"}), false);
  std::string text;
  while (std::count(text.begin(), text.end(), '\n') < 3) {
    const std::string piece = program.read_some();
    ASSERT_FALSE(piece.empty()) << "ended by itself";
    text += piece;
  }
  ASSERT_EQ(::kill(program.pid(), SIGINT), 0);
  EXPECT_EQ(program.finish().exit_code, 130);
}

TEST_F(EmbodyCtl, MarkersOnceIsATableOrTheDaemonsJson) {
  const Outcome table = run({"markers", "--once"});
  EXPECT_EQ(table.exit_code, 0);
  EXPECT_EQ(table.output, markers_table(kMarkers));
  EXPECT_EQ(json::parse(run({"markers", "--once", "--json"}).output), json::parse(kMarkers));
}

TEST_F(EmbodyCtl, MarkersGoOnLineByLineUntilInterrupted) {
  Program program(with_socket({"markers", "--interval-ms", "20"}), false);
  std::string text;
  while (std::count(text.begin(), text.end(), '\n') < 3) {
    const std::string piece = program.read_some();
    ASSERT_FALSE(piece.empty()) << "ended by itself";
    text += piece;
  }
  EXPECT_EQ(text.rfind(markers_line(kMarkers), 0), 0U);
  EXPECT_EQ(text.find('\x1b'), std::string::npos) << "no terminal, no control characters";
  ASSERT_EQ(::kill(program.pid(), SIGINT), 0);
  EXPECT_EQ(program.finish().exit_code, 130);
}

TEST_F(EmbodyCtl, MarkersWithoutADaemonSaySo) {
  const Outcome outcome = Program({"markers", "--socket", folder_.path() + "/none.sock"}, false).finish();
  EXPECT_EQ(outcome.exit_code, 69);
  EXPECT_NE(outcome.errors.find("embodyd is not running"), std::string::npos);
}

TEST(MarkersView, HasARowPerMarkerTheBackAndTheSentences) {
  const std::string table = markers_table(kMarkers);
  for (const char* part :
       {"frame 4711, 100 in the last second", "back top", "relabelled from middle_tip", "yes 88 %", "1.2 mm", "no  0 %",
        "missing", "back of the hand   good, top-left 51.2 of 51.5 mm", "fit error 0.25 mm", "hand 0.75",
        "index 0.75 held", "! index_tip and middle_tip are probably swapped"}) {
    EXPECT_NE(table.find(part), std::string::npos) << part << " is missing in\n" << table;
  }
  const std::string line = markers_line(kMarkers);
  EXPECT_EQ(std::count(line.begin(), line.end(), '\n'), 1);
  for (const char* part : {"2 of 3 markers seen", "ring_tip missing", "probably swapped"}) {
    EXPECT_NE(line.find(part), std::string::npos) << part << " is missing in\n" << line;
  }
}

TEST(MarkersView, EveryMemberMayBeMissingOrOfAnyType) {
  const json whole = json::parse(kMarkers);
  for (const auto& [key, value] : whole.items()) {
    json changed = whole;
    changed.erase(key);
    EXPECT_FALSE(markers_table(changed.dump()).empty());
    EXPECT_FALSE(markers_line(changed.dump()).empty());
    for (const json& other : {json(nullptr), json(1.5), json("x"), json(true), json::array({1}),
                              json{{"top_left", "x"}, {"hand", json::array()}, {"state", 3}}}) {
      changed[key] = other;
      EXPECT_FALSE(markers_table(changed.dump()).empty()) << key << " " << other;
      EXPECT_FALSE(markers_line(changed.dump()).empty()) << key << " " << other;
    }
  }
  for (const char* text : {"", "{}", "[]", "null", "{", "\xff"}) {
    EXPECT_FALSE(markers_table(text).empty());
    EXPECT_FALSE(markers_line(text).empty());
  }
}

TEST(MarkersView, LabelsOfATrackerCannotSteerTheTerminal) {
  const std::string text = R"({"markers":[{"label":"\u001b[2J","finger":"\u0007","verdict":"ghost"}],
                               "findings":["\u001b[31m"]})";
  for (const std::string& shown : {markers_table(text), markers_line(text)}) {
    EXPECT_EQ(shown.find('\x1b'), std::string::npos);
    EXPECT_EQ(shown.find('\x07'), std::string::npos);
  }
}

TEST_F(EmbodyCtl, AnotherUserIsToldThatHeMayNot) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root can become another user";
  ASSERT_EQ(::chmod(folder_.path().c_str(), 0755), 0);
  const Outcome outcome = run({"stop"}, /*as_nobody=*/true);
  if (outcome.exit_code == 127) GTEST_SKIP() << kProgram << " is in a folder that other users cannot enter";
  EXPECT_EQ(outcome.exit_code, 77);
  EXPECT_NE(outcome.errors.find("you may not use the control socket"), std::string::npos) << outcome.errors;
}

TEST_F(EmbodyCtl, WithoutADaemonItSaysSo) {
  const Outcome outcome = Program({"stop", "--socket", folder_.path() + "/none.sock"}, false).finish();
  EXPECT_EQ(outcome.exit_code, 69);
  EXPECT_NE(outcome.errors.find("embodyd is not running"), std::string::npos);
}

TEST_F(EmbodyCtl, WrongUsageEndsWithTwoAndHelpWithZero) {
  EXPECT_EQ(Program({}, false).finish().exit_code, 2);
  EXPECT_EQ(run({"dance"}).exit_code, 2);
  EXPECT_EQ(run({"status", "--interval-ms", "1"}).exit_code, 2);
  EXPECT_EQ(Program({"--help"}, false).finish().exit_code, 0);
  const Outcome version = Program({"--version"}, false).finish();
  EXPECT_EQ(version.exit_code, 0);
  EXPECT_EQ(version.output.rfind("embodyctl ", 0), 0u);
}

TEST(StatusTable, ShowsEverythingThatTheDaemonSaid) {
  const std::string table = status_table(kStatus);
  for (const char* part :
       {"1.2.3, up 1 h 2 min", "holding (tracker stale), for 2.5 s", "connection refused", "127.0.0.1:22223",
        "tracker 100.0", "frames_received 123456", "80.5", "thumb 5.25",
        "lag thumb 400.0 index 12.5 ms (400 at rest, 10 in motion)", "prediction: fingers off, hand pose 40 ms",
        "no real-time scheduling, memory locked", "warning: no rights", "novelty 42", "frames 777",
        "fault, supply low: too hot", "j_thumb 321 (raw)", "thumb -3/4"}) {
    EXPECT_NE(table.find(part), std::string::npos) << part << " is missing in\n" << table;
  }
}

TEST(StatusTable, KeepsTheOrderOfTheDaemon) {
  const std::string table = status_table(kStatus);
  EXPECT_LT(table.find("tracker "), table.find("arm "));
  EXPECT_LT(table.find("decode"), table.rfind("arm "));
}

TEST(StatusTable, EveryMemberMayBeMissingOrOfAnyType) {
  const json whole = json::parse(kStatus);
  for (const auto& [key, value] : whole.items()) {
    json changed = whole;
    changed.erase(key);
    EXPECT_FALSE(status_table(changed.dump()).empty());
    for (const json& other : {json(nullptr), json(1.5), json("x"), json(true), json::array({1}),
                              json{{"a", {{"b", 1}}}}, json{{"mode", 3}, {"name", json::array()}, {"since_s", "x"}}}) {
      changed[key] = other;
      EXPECT_FALSE(status_table(changed.dump()).empty()) << key << " " << other;
    }
  }
  for (const char* text : {"", "{}", "[]", "null", "{", "\xff"}) EXPECT_FALSE(status_table(text).empty());
}

TEST(StatusTable, TextOfADeviceCannotSteerTheTerminal) {
  const std::string table = status_table(R"({"devices":{"arm\u001b[2J":{"state":"\u001b[31m","peer":"\u0007"}}})");
  EXPECT_EQ(table.find('\x1b'), std::string::npos);
  EXPECT_EQ(table.find('\x07'), std::string::npos);
}

}  // namespace
}  // namespace embody::ctl
