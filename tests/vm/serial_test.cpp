// In a virtual machine: the Mia driver on a USB serial adapter that is pulled while the hand moves and plugged in
// again. Usage: vm_serial_test DEVICE. Prints READY-UNPLUG and READY-REPLUG when the adapter may be pulled and plugged
// in.
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <functional>

#include "drivers/mia/mia_hand.hpp"
#include "drivers/transport/clock.hpp"
#include "drivers/transport/tcp.hpp"
#include "drivers/transport/tty.hpp"

namespace {

using namespace embody;  // NOLINT(google-build-using-namespace): a program of one function
using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr double kNear_rad = 0.02;

HandCommand command(HandAction action, double q_rad) {
  HandCommand result;
  result.action = action;
  result.joint_count = mia::kMotors;
  result.q_rad = {q_rad, q_rad, q_rad};
  result.t_expires = transport::now() + seconds(1);
  return result;
}

/// One session: commands at 20 Hz until `done`, the end of the session or `limit`.
struct Session {
  mia::MiaHand& hand;
  int fd{-1};
  HandDeviceState state{};
  int replies{0};
  TimePoint last_reply{};

  bool run(HandAction action, double q_rad, const std::function<bool()>& done, Duration limit) {
    const TimePoint end = transport::now() + limit;
    TimePoint next{};
    while (transport::now() < end) {
      if (transport::now() >= next) {
        if (hand.write(command(action, q_rad), transport::now()) == IoStatus::kDisconnected) return false;
        next = transport::now() + milliseconds(50);
      }
      static_cast<void>(transport::wait_readable(fd, transport::now() + milliseconds(5)));
      const IoStatus status = hand.read(state);
      if (status == IoStatus::kDisconnected) return false;
      if (status == IoStatus::kDone) {
        ++replies;
        last_reply = transport::now();
      }
      if (done()) return true;
    }
    return false;
  }
  [[nodiscard]] bool at(double q_rad) const {
    return replies > 0 && std::abs(state.q_rad[0] - q_rad) < kNear_rad && std::abs(state.q_rad[2] - q_rad) < kNear_rad;
  }
};

int failed(const char* what, const mia::MiaHand& hand) {
  std::printf("FAILED: %s (%.*s)\n", what, static_cast<int>(hand.reason().size()), hand.reason().data());
  return 1;
}

bool wait_for_device(const char* device, bool present) {
  const TimePoint end = transport::now() + seconds(60);
  while ((::access(device, F_OK) == 0) != present && transport::now() < end) {
    static_cast<void>(transport::wait_readable(-1, transport::now() + milliseconds(20)));
  }
  return (::access(device, F_OK) == 0) == present;
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 2) return 2;
  const char* device = arguments[1];
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  if (const auto tty = transport::open_tty(device)) std::printf("low latency: %s\n", tty->low_latency ? "yes" : "no");
  mia::MiaConfig config;
  config.device = device;
  config.ack_timeout = milliseconds(150);  // an emulated machine is slow
  mia::MiaHand hand(config);
  auto info = hand.connect();
  if (!info) return std::printf("FAILED: %s\n", info.error().detail.c_str()), 1;
  std::printf("%s\n", info->peer.c_str());
  Session first{hand, info->fd};
  if (!first.run(
          HandAction::kMove, 0.3, [&] { return first.at(0.3); }, seconds(30)))
    return failed("no motion", hand);
  const int before = first.replies;
  std::printf("READY-UNPLUG\n");
  // Pulled on the way to 1 rad: the hand finishes the last command that it heard.
  first.run(
      HandAction::kMove, 1.0, [] { return false; }, seconds(60));
  if (hand.reason().empty()) return failed("the unplugged adapter was not noticed", hand);
  std::printf("unplugged: noticed %.0f ms after the last of %d replies: %.*s\n",
              1e3 * to_seconds(transport::now() - first.last_reply), first.replies - before,
              static_cast<int>(hand.reason().size()), hand.reason().data());
  if (!wait_for_device(device, false)) return failed("the device node stays", hand);
  if (hand.connect()) return failed("connected without an adapter", hand);
  std::printf("READY-REPLUG\n");
  if (!wait_for_device(device, true)) return failed("the device does not come back", hand);
  const TimePoint back = transport::now();
  while (!(info = hand.connect()) && transport::now() < back + seconds(30)) {
  }
  if (!info) return std::printf("FAILED: %s\n", info.error().detail.c_str()), 1;
  std::printf("connected again after %.0f ms\n", 1e3 * to_seconds(transport::now() - back));
  Session second{hand, info->fd};
  if (!second.run(
          HandAction::kHold, 0.0, [&] { return second.replies >= 1; }, seconds(30))) {
    return failed("no state after the reconnect", hand);
  }
  const double resting_rad = second.state.q_rad[2];
  if (!second.run(
          HandAction::kHold, 0.0, [&] { return second.replies >= 20; }, seconds(30))) {
    return failed("the second session ends", hand);
  }
  if (!second.at(resting_rad)) return failed("the hand moved without a command", hand);
  if (!second.run(
          HandAction::kMove, 0.5, [&] { return second.at(0.5); }, seconds(30)))
    return failed("no motion", hand);
  std::printf("replies %llu, time-outs %llu\n", static_cast<unsigned long long>(hand.counters().replies),
              static_cast<unsigned long long>(hand.counters().timeouts));
  return 0;
}
