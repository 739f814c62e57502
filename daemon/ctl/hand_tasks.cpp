#include "daemon/ctl/hand_tasks.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <functional>
#include <nlohmann/json.hpp>
#include <vector>

#include "daemon/app/hand_report.hpp"
#include "daemon/ctl/status_table.hpp"
#include "drivers/mia/mia_hand.hpp"
#include "drivers/robotiq/robotiq_hand.hpp"
#include "drivers/transport/clock.hpp"
#include "drivers/transport/tcp.hpp"

namespace embody::ctl {
namespace {

using json = nlohmann::ordered_json;
using transport::now;

std::atomic<bool> ctrl_c{false};

/// A hand loop that commands nothing but holding, at the hand's own rate, until `done` or the end of `limit`.
/// Errors: kDisconnected.
Result<bool> listen(HandDriver& hand, const HandInfo& info, HandDeviceState& state, Duration limit,
                    const std::function<bool()>& done) {
  const Duration period = from_seconds(1.0 / std::clamp(info.rate_hz, 1.0, 100.0));
  const TimePoint t_end = now() + limit;
  TimePoint t_next = now();
  while (now() < t_end && !interrupted()) {
    IoStatus status = IoStatus::kDone;
    if (now() >= t_next) {
      HandCommand hold;
      hold.joint_count = info.joint_count;
      t_next = now() + period;
      hold.t_expires = t_next;
      status = hand.write(hold, now());
    }
    static_cast<void>(transport::wait_readable(info.fd, std::min(t_next, now() + std::chrono::milliseconds(10))));
    if (status != IoStatus::kDisconnected) status = hand.read(state);
    if (status == IoStatus::kDisconnected)
      return make_error(Errc::kDisconnected, "%s", std::string(hand.reason()).c_str());
    if (done()) return true;
  }
  return false;
}

Result<HandAnswer> calibrate(HandDriver& hand, const HandInfo& /*info*/, const HandTaskOptions& /*options*/) {
  auto* mia = dynamic_cast<mia::MiaHand*>(&hand);
  if (mia == nullptr)
    return make_error(Errc::kUnsupported, "only a Mia hand behind its serial protocol is calibrated from here");
  if (const Status done = mia->calibrate(&interrupted); !done) return done.error();
  return HandAnswer{};
}

Result<HandAnswer> activate(HandDriver& hand, const HandInfo& /*info*/, const HandTaskOptions& /*options*/) {
  auto* gripper = dynamic_cast<robotiq::RobotiqHand*>(&hand);
  if (gripper == nullptr)
    return make_error(Errc::kUnsupported, "only a Robotiq gripper is activated; this hand needs no activation");
  if (const Status done = gripper->activate(std::chrono::seconds(10), &interrupted); !done) return done.error();
  return HandAnswer{};
}

Status find_zero(HandDriver& hand, const HandInfo& info) {
  constexpr Duration kLimit = std::chrono::seconds(10);  // eight readings, two or three a second
  auto* mia = dynamic_cast<mia::MiaHand*>(&hand);
  if (mia == nullptr)
    return make_error(Errc::kUnsupported, "only a Mia hand behind its serial protocol has forces to set to zero here");
  const auto before = mia->telemetry().tares;
  mia->tare();
  HandDeviceState state;
  const auto found = listen(hand, info, state, kLimit, [&] { return mia->telemetry().tares > before; });
  if (!found) return found.error();
  if (*found) return {};
  if (interrupted()) return make_error(Errc::kRefused, "interrupted: no zero was found");
  if (mia->telemetry().force_samples == 0)
    return make_error(Errc::kUnsupported, "the firmware of this hand tells no forces: there is nothing to set to zero");
  return make_error(Errc::kTimeout, "too few readings of the forces came within 10 s");
}

/// The hand does not remember its zero, and neither do we: the numbers are for the person.
Result<HandAnswer> tare(HandDriver& hand, const HandInfo& info, const HandTaskOptions& /*options*/) {
  if (const Status done = find_zero(hand, info); !done) return done.error();
  const auto& offset = static_cast<const mia::MiaHand&>(hand).telemetry().offset;
  const mia::Forces zero = mia::forces_of(offset, mia::TelemetryConfig{}.strain_fields);
  json fingers = json::object();
  std::string text = "zero of the forces, raw:";
  for (std::size_t i = 0; i < zero.size(); ++i) {
    fingers[kFingerNames[i]] = {{"normal", zero[i].normal}, {"tangential", zero[i].tangential}};
    text += std::string(i == 0 ? " " : ", ") + kFingerNames[i] + " normal " + std::to_string(zero[i].normal) +
            " tangential " + std::to_string(zero[i].tangential);
  }
  return HandAnswer{json{{"zero_raw", fingers}, {"strain_offset", offset}}.dump(), text + "\n"};
}

json shown(const HandDeviceState& state, const HandInfo& info) {
  std::vector<std::string> joints;
  for (std::size_t i = 0; i < info.joint_count; ++i) joints.emplace_back(info.joint_names[i].view());
  json object = hand_json(state, joints);
  object["peer"] = info.peer.view();
  return object;
}

std::string to_text(const json& object) {
  return object.dump(-1, ' ', false, json::error_handler_t::replace);
}

Result<HandAnswer> show(HandDriver& hand, const HandInfo& info, const HandTaskOptions& options) {
  constexpr Duration kPatience = std::chrono::milliseconds(1500);  // readings come two or three times a second
  constexpr Duration kInterval = std::chrono::milliseconds(500);
  if (options.tare) {
    if (const Status done = find_zero(hand, info); !done) return done.error();
  }
  HandDeviceState state;
  const auto whole = [&] { return state.telemetry.t_current != TimePoint{} && state.telemetry.t_force != TimePoint{}; };
  if (const auto heard = listen(hand, info, state, kPatience, whole); !heard) return heard.error();
  while (options.watch && !interrupted()) {
    const std::string text = to_text(shown(state, info));
    std::fputs(options.json ? (text + "\n").c_str() : (hand_table(text) + "\n").c_str(), stdout);
    std::fflush(stdout);
    const auto heard = listen(hand, info, state, kInterval, [] { return false; });
    if (!heard) return heard.error();
  }
  if (interrupted()) return make_error(Errc::kRefused, "interrupted");
  if (state.t_arrival == TimePoint{}) return make_error(Errc::kTimeout, "the hand is there but tells no positions");
  const std::string text = to_text(shown(state, info));
  return HandAnswer{text, hand_table(text)};
}

constexpr std::array kTasks{
    HandTask{"calibrate", "Mia: let the hand find the zero of its motors; IT MOVES", &calibrate},
    HandTask{"activate", "Robotiq: activate the gripper, once after power-up; IT OPENS AND CLOSES", &activate},
    HandTask{"tare", "Mia: find the zero of the fingers' forces while nothing touches them; nothing moves", &tare},
    HandTask{"show", "Positions, currents, forces and condition of the hand; nothing moves", &show},
};

}  // namespace

std::span<const HandTask> hand_tasks() noexcept {
  return kTasks;
}

void catch_interrupts() {
  for (const int signal : {SIGINT, SIGTERM}) std::signal(signal, [](int) { ctrl_c.store(true); });
}

bool interrupted() noexcept {
  return ctrl_c.load();
}

}  // namespace embody::ctl
