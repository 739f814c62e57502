#include "tests/integration/faults/run_row.hpp"

#include <algorithm>
#include <thread>

#include "drivers/transport/clock.hpp"

namespace embody::faults {
namespace {

using control::Command;
using std::chrono::milliseconds;
using std::chrono::seconds;
using transport::now;

constexpr Duration kLook = milliseconds(5);  ///< between two looks at the hand; at the daemon every second time
constexpr double kExcursion_rad = 0.15;
constexpr double kRestTravel_rad = 2e-3;
constexpr Duration kTolerance = milliseconds(100);  ///< of this machine, before a row counts as failed

/// The run of one row.
class Run {
 public:
  Run(Cell& cell, const Row& row) : cell_(cell), row_(row) {}

  RowResult run() {
    const std::uint64_t late = cell_.arm().counters().late_cycles;
    if (!prepare()) {
      result_.modes = {"not run"};
      fail("before the fault: " + state_);
      return result_;
    }
    break_it();
    mend_it();
    line_.arm = cell_.arm().samples();
    std::erase_if(line_.arm, [&](const auto& s) { return s.t < line_.t_fault - milliseconds(20); });
    if (mode_at_end_ != kNoAnswer) result_.modes = modes_;  // what came later is the operator's
    result_.longest_gap = line_.longest_gap;
    result_.late_cycles = cell_.arm().counters().late_cycles - late;
    judge();
    return result_;
  }

 private:
  void fail(const std::string& what) { result_.failures.push_back(what); }

  /// One look at hand and daemon; then waits for the next.
  void look() {
    const TimePoint t = now();
    if (t_look_ != TimePoint{}) line_.longest_gap = std::max(line_.longest_gap, t - t_look_);
    t_look_ = t;
    HandSample hand{t, cell_.hand().joint_angles_rad(), cell_.hand_motions()};
    line_.hand.push_back(std::move(hand));
    if (line_.hand.size() % 2 == 0) look_at_daemon();
    std::this_thread::sleep_until(t + kLook);
  }

  void look_at_daemon() {
    const auto status = cell_.status();
    Shown shown;
    shown.t = now();
    if (status) {
      const json& mode = (*status)["mode"];
      shown.mode = mode["name"];
      shown.cause = mode["cause"];
      shown.since_s = mode["since_s"];
      for (const auto& device : (*status)["devices"]) {
        shown.evidence += device["state"].get<std::string>() + device["sessions"].dump();
      }
      shown.evidence += evidence(*status);
      moves_ = (*status)["robot_hand"]["action"] == "moves";
      status_ = *status;
    } else if (!cell_.daemon_runs()) {
      shown.mode = kNoAnswer;
    } else {
      return;
    }
    state_ = shown.mode + (shown.cause.empty() ? "" : ": " + shown.cause);
    if (result_.modes.empty() || result_.modes.back() != shown.mode) result_.modes.push_back(shown.mode);
    line_.shown.push_back(std::move(shown));
  }

  std::string evidence(const json& status) {
    if (row_.evidence.empty()) return "";
    if (row_.evidence.front() == '/') {
      const json::json_pointer pointer(row_.evidence);
      return status.contains(pointer) ? status[pointer].dump() : "";
    }
    const auto markers = cell_.markers();
    if (!markers) return "";
    if (row_.evidence == "back") return (*markers)["back"]["state"] == "good" ? "" : "not good";
    for (const json& marker : (*markers)["markers"]) {
      if (marker["label"] == row_.evidence.substr(7)) return marker["verdict"] == "used" ? "" : "not used";
    }
    return "";
  }

  template <class Done>
  bool look_until(Duration longest, Done done) {
    for (const TimePoint t_end = now() + longest; now() < t_end;) {
      look();
      if (done()) return true;
    }
    return false;
  }
  void look_for(Duration span) {
    look_until(span, [] { return false; });
  }

  [[nodiscard]] std::string mode() const { return line_.shown.empty() ? "" : line_.shown.back().mode; }

  /// As an operator: reset what is stopped, then engage. Notes what was needed.
  bool engage(Duration longest) {
    std::string needed;
    TimePoint t_asked{};
    const bool engaged = look_until(longest, [&] {
      if (mode() == "engaged") return moves_ && cell_.arm().latest().program_state == sim::ProgramState::kTracking;
      if (line_.shown.empty() || line_.shown.back().t < t_asked) return false;
      const TimePoint t = t_asked = now();
      if (mode() == "stopped" && cell_.ask(Command::kReset)) needed += needed.ends_with("reset, ") ? "" : "reset, ";
      if (mode() != "aligned" && mode() != "holding") return false;
      if (cell_.ask(Command::kEngage)) {
        if (!line_.t_engaged) line_.t_engaged = t;
        needed += needed.ends_with("engage") ? "" : "engage";
      }
      return false;
    });
    result_.recovery = needed;
    return engaged;
  }

  bool prepare() {
    if (!engage(seconds(10))) return false;
    act(row_.before);
    look_for(milliseconds(row_.before.empty() ? 400 : 700));  // the clutch closes meanwhile
    return wait_for_speed();
  }

  /// Both arm and hand move fast.
  bool wait_for_speed() {
    constexpr double kArm_rad_s = 0.25, kHand_rad_s = 0.25;
    return look_until(seconds(4), [&] {
      const HandSample& a = line_.hand[line_.hand.size() - 8];
      const HandSample& b = line_.hand.back();
      double hand_rad = 0.0;
      for (std::size_t i = 0; i < a.q_rad.size(); ++i) hand_rad = std::max(hand_rad, std::abs(b.q_rad[i] - a.q_rad[i]));
      return mode() == "engaged" && cell_.arm().latest().qd_rad_s.cwiseAbs().maxCoeff() > kArm_rad_s &&
             hand_rad / to_seconds(b.t - a.t) > kHand_rad_s;
    });
  }

  void act(const std::vector<std::string>& actions) {
    for (const std::string& action : actions) {
      const Status done = cell_.act(action);
      if (!done) fail(action + ": " + std::string(done.error().detail.view()));
    }
  }

  void break_it() {
    result_.modes.clear();
    line_.t_engaged.reset();
    line_.longest_gap = Duration{0};
    line_.t_fault = now();
    line_.t_cleared = TimePoint::max();
    act(row_.inject);
    look_for(row_.watch);
    if (!line_.shown.empty()) result_.cause = line_.shown.back().cause;
    mode_at_end_ = mode();
    modes_ = result_.modes;
  }

  void mend_it() {
    line_.t_cleared = now();
    act(row_.clear);
    // Whatever comes back must not move anything by itself.
    look_for(milliseconds(250));
    const bool by_itself = mode() == "engaged";
    if (!engage(seconds(12))) fail("no way back: " + state_);
    result_.recovered_in = by_itself ? Duration{0} : now() - line_.t_cleared;
    look_for(milliseconds(300));
  }

  void judge() {
    result_.detected = time_to_detect(line_);
    result_.arm = judge_arm(line_, cell_.limits(), row_.brake == Brake::kRobot, result_.detected.value_or(Duration{0}));
    const bool stopped = line_.t_engaged.has_value();
    const bool prepared =
        row_.restarts_daemon || row_.hand_rests;  // perhaps calibrated or activated: that moves the hand
    result_.hand = judge_hand(line_, prepared ? line_.t_cleared : line_.t_engaged.value_or(TimePoint::max()));
    if (row_.arm == Arm::kStops && !stopped) fail("the arm went on");
    if (row_.arm == Arm::kGoesOn && stopped) fail("the arm did not go on: " + result_.cause);
    if (!row_.modes.empty() && std::find(row_.modes.begin(), row_.modes.end(), mode_at_end_) == row_.modes.end()) {
      fail("the mode is " + mode_at_end_);
    }
    if (!row_.cause.empty() && stopped && result_.cause != row_.cause) fail("the cause is '" + result_.cause + "'");
    if (stopped) judge_rest();
    if (result_.arm.worst_speed > 1.05) fail("a joint was faster than its limit");
    if (result_.arm.worst_step > 1.05) fail("a joint stepped");
    const bool daemon_fails = row_.inject.front().starts_with("daemon");
    if (((row_.arm == Arm::kStops && !daemon_fails) || !row_.evidence.empty()) && !result_.detected)
      fail("nobody noticed");
    const Duration looked_at = row_.evidence.empty() ? Duration{0} : milliseconds(100);  // the age of such a report
    if (result_.detected && *result_.detected > row_.notice + looked_at + kTolerance) fail("noticed late");
    if (!stopped && result_.hand.commanded == row_.hand_rests) {
      fail(row_.hand_rests ? "the hand went on" : "the hand did not go on");
    }
  }

  void judge_rest() {
    const ArmOutcome& arm = result_.arm;
    result_.over_bound = !arm.to_rest || *arm.to_rest > arm.bound;
    if (!arm.to_rest || *arm.to_rest > arm.bound + kTolerance) fail("the arm came to rest too late");
    if (arm.moved_at_rest_rad > kRestTravel_rad) fail("the arm moved before the operator engaged");
    if (result_.hand.excursion_rad > kExcursion_rad) fail("the hand went too far");
  }

  Cell& cell_;
  const Row& row_;
  RowResult result_;
  Timeline line_;
  TimePoint t_look_{};
  json status_;
  bool moves_{false};
  std::string state_{"no status"}, mode_at_end_;
  std::vector<std::string> modes_;  ///< until the end of the watch
};

}  // namespace

RowResult run_row(Cell& cell, const Row& row) {
  return Run(cell, row).run();
}

}  // namespace embody::faults
