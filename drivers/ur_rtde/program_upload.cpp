#include "drivers/ur_rtde/program_upload.hpp"

#include <algorithm>
#include <utility>

#include "drivers/transport/clock.hpp"
#include "drivers/ur_rtde/status_text.hpp"
#include "drivers/ur_rtde/stop_codes.hpp"

namespace embody::ur {
namespace {

using transport::now;

constexpr int kReadOnly = 210;
constexpr int kMostScriptErrors = 3;  // a program that keeps failing is not started for ever

/// Line `number` (from 1) of `text`, without blanks in front; empty when there is none.
std::string_view line_of(std::string_view text, int number) noexcept {
  for (int line = 1; line < number; ++line) {
    const std::size_t end = text.find('\n');
    if (end == std::string_view::npos) return {};
    text.remove_prefix(end + 1);
  }
  text = text.substr(0, text.find('\n'));
  return text.substr(std::min(text.size(), text.find_first_not_of(" \t")));
}

ProgramAdvice wait_for(const char* sentence) noexcept {
  return {ProgramNeed::kWait, make_error(Errc::kRefused, "%s", sentence)};
}

ProgramAdvice wait_for_program(std::uint32_t runtime_state, bool ours) noexcept {
  switch (runtime_state) {
    case 1:
      return {ProgramNeed::kUpload, {}};
    case 2:
      if (ours) return {ProgramNeed::kNone, {}};
      return wait_for(
          "another program plays on the robot (or ours does not answer): stop it on the teach pendant, then the "
          "control program is loaded");
    case 3:
    case 4:
      return wait_for(
          "the robot's program is paused: stop it on the teach pendant, then the control program is loaded anew");
    default:
      return {};  // stopping, resuming: in a moment
  }
}

}  // namespace

ProgramAdvice advise(const rtde::ControllerStatus& status, bool answers) noexcept {
  const ArmCondition condition = arm_condition(status);
  if (condition == ArmCondition::kNotRunning) {
    return {ProgramNeed::kWait,
            make_error(Errc::kRefused, "the robot is not running (%s): power it on and release the brakes",
                       rtde::robot_mode_text(status.robot_mode))};
  }
  if (condition != ArmCondition::kReady && condition != ArmCondition::kProgramStopped) {
    return {ProgramNeed::kWait,
            make_error(Errc::kRefused, "the robot is stopped (%s): %s", rtde::safety_text(status.safety_status),
                       rtde::safety_advice(status.safety_status))};
  }
  return wait_for_program(status.runtime_state, status.program_version == rtde::kProgramVersion && answers);
}

ProgramUpload::ProgramUpload(ProgramUploadConfig config)
    : config_(std::move(config)), link_(config_.host, config_.port) {}

Status ProgramUpload::service(const SharedArmStatus& status) {
  const ArmSnapshot snapshot = status.snapshot();
  const bool fed = std::exchange(commands_seen_, snapshot.commands) != snapshot.commands;
  if (snapshot.packages == 0) return {};
  const Status heard = listen();
  const ProgramAdvice advice = advise(snapshot.controller, snapshot.answers);
  if (advice.need == ProgramNeed::kNone) {
    last_stop_ = {};
    confirm_by_ = {};
    return {};
  }
  if (advice.need == ProgramNeed::kWait) {
    if (advice.sentence.detail.empty()) return {};
    confirm_by_ = {};
    if (last_stop_.empty()) return advice.sentence;
    return make_error(Errc::kRefused, "%s [%s]", advice.sentence.detail.c_str(), last_stop_.c_str());
  }
  if (awaited()) return wait_for_start();
  // The program ends when no commands arrive: they have to flow before it starts.
  if (!fed) return {};
  if (script_errors_ >= kMostScriptErrors || now() < retry_at_) return last_error_;
  return heard ? upload() : heard;
}

Status ProgramUpload::open() {
  constexpr Duration kConnectTimeout = std::chrono::milliseconds(300);
  if (now() < reopen_at_) return unreachable_;
  const Status opened = link_.open(now() + kConnectTimeout);
  if (opened) return opened;
  reopen_at_ = now() + config_.retry_after;
  unreachable_ =
      make_error(opened.error().code, "the control program cannot be loaded: %s", opened.error().detail.c_str());
  return unreachable_;
}

/// Keeps the connection and takes what it brought. While a program is awaited, errors are about that program.
Status ProgramUpload::listen() {
  constexpr int kMostEvents = 100;  // a flood of reports must not hold up the round
  if (!link_.is_open() && !awaited()) {
    if (const Status opened = open(); !opened) return opened;
  }
  for (int i = 0; i < kMostEvents; ++i) {
    const auto event = link_.next_event(now());
    if (!event) break;
    if (!awaited()) {
      note(*event);
    } else if (const Status verdict = judge(*event); !verdict) {
      return verdict;
    }
  }
  return {};
}

Status ProgramUpload::upload() {
  constexpr Duration kSendTimeout = std::chrono::milliseconds(50);  // the kernel takes a program of a few kB at once
  ++uploads_;
  if (const Status sent = link_.send(config_.program, now() + kSendTimeout); !sent) return refuse(sent.error());
  confirm_by_ = now() + config_.confirm_timeout;
  return {};
}

/// What the controller reports about the program that was sent, on the same connection.
Status ProgramUpload::judge(const PrimaryEvent& event) {
  if (event.kind == MessageKind::kRuntimeException) {
    script_errors_ = kMostScriptErrors;  // it will not be better the next time
    return refuse(script_error(event));
  }
  if (event.code == kReadOnly) {
    return refuse(make_error(Errc::kRefused,
                             "the robot is in local control and takes no program (C210): switch it to Remote "
                             "Control on the teach pendant"));
  }
  note(event);
  return {};
}

Status ProgramUpload::wait_for_start() {
  if (!link_.is_open()) return refuse(make_error(Errc::kDisconnected, "the controller closed its program port"));
  if (now() < confirm_by_) return {};
  return refuse(make_error(Errc::kTimeout,
                           "the robot does not start the control program: see the log on the teach pendant%s%s",
                           last_stop_.empty() ? "" : "; it reported ", last_stop_.c_str()));
}

void ProgramUpload::note(const PrimaryEvent& event) {
  if (event.kind == MessageKind::kRuntimeException) {
    ++script_errors_;
    last_error_ = script_error(event);
    last_stop_ = last_error_.detail.view();
    return;
  }
  const char* meaning = stop_code_text(event.code, event.argument);
  last_stop_ =
      make_error(Errc::kIo, "C%dA%d: %s", event.code, event.argument, *meaning == '\0' ? event.text.c_str() : meaning)
          .detail.view();
}

/// A connection that was refused stays read-only even after the switch to remote control: open a new one next time.
Error ProgramUpload::refuse(const Error& error) {
  link_.close();
  ++failures_;
  confirm_by_ = {};
  retry_at_ = now() + config_.retry_after;
  last_error_ = error;
  return error;
}

Error ProgramUpload::script_error(const PrimaryEvent& event) const {
  const std::string_view line = line_of(config_.program, event.line);
  return make_error(Errc::kMalformed, "the robot rejects the control program in line %d ('%.*s'): %s", event.line,
                    static_cast<int>(std::min<std::size_t>(line.size(), 80)), line.data(), event.text.c_str());
}

}  // namespace embody::ur
