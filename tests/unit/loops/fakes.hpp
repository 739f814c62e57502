#pragma once
// Devices that exist only as functions of the test: each read() and write() of a loop is one call, on the loop's own
// thread, so that tests need neither sleeps nor network. Nothing here allocates once a loop runs.
#include <sys/eventfd.h>

#include <atomic>
#include <functional>
#include <thread>
#include <vector>

#include "core/hal/arm_driver.hpp"
#include "core/hal/hand_driver.hpp"
#include "core/hal/hand_tracker.hpp"
#include "daemon/app/heap_guard.hpp"
#include "daemon/app/thread.hpp"
#include "drivers/transport/clock.hpp"
#include "drivers/transport/unique_fd.hpp"

namespace embody::test {

/// A descriptor that is always readable, or never.
class EventFd {
 public:
  explicit EventFd(bool readable) : fd_(::eventfd(readable ? 1U : 0U, EFD_NONBLOCK | EFD_CLOEXEC)) {}
  [[nodiscard]] int get() const noexcept { return fd_.get(); }

 private:
  transport::UniqueFd fd_;
};

class FakeTracker : public HandTracker {
 public:
  Result<TrackerInfo> connect() override { return TrackerInfo{fd, 100.0, false, "fake tracker"}; }
  Status service() override { return {}; }
  IoStatus read(MarkerFrame& frame) noexcept override { return on_read(frame); }

  int fd{-1};
  std::function<IoStatus(MarkerFrame&)> on_read{[](MarkerFrame&) { return IoStatus::kEmpty; }};
};

class FakeHand : public HandDriver {
 public:
  Result<HandInfo> connect() override {
    HandInfo info;
    info.fd = fd;
    info.rate_hz = 500.0;
    info.joint_count = 3;
    return info;
  }
  IoStatus read(HandDeviceState& state) noexcept override { return on_read(state); }
  IoStatus write(const HandCommand& command, TimePoint now) noexcept override { return on_write(command, now); }

  int fd{-1};
  std::function<IoStatus(HandDeviceState&)> on_read{[](HandDeviceState&) { return IoStatus::kEmpty; }};
  std::function<IoStatus(const HandCommand&, TimePoint)> on_write{
      [](const HandCommand&, TimePoint) { return IoStatus::kDone; }};
};

/// A robot arm with packages of 2 ms that goes where it is told at once. The script decides, at each read(), whether
/// there is a package.
class FakeArm : public ArmDriver {
 public:
  struct Answer {
    std::uint64_t package{0};  ///< read just before this command
    std::uint32_t session{0};
    ArmCommand command;
    TimePoint t_arrival{};
    Vector6 q_before_rad{Vector6::Zero()};
    bool accepted{false};
  };

  FakeArm() { answers.reserve(200'000); }

  Result<ArmInfo> connect() override {
    ++session;
    state.tracking = false;
    return ArmInfo{fd, 500.0, "fake arm"};
  }
  Status service() override { return {}; }
  IoStatus read(ArmState& out) noexcept override {
    const IoStatus status = script();
    if (status != IoStatus::kDone) return status;
    ++state.package;
    state.controller_time += period;
    state.t_arrival = transport::now();
    state.q_target_rad = state.q_rad;
    out = state;
    return status;
  }
  IoStatus write(const ArmCommand& command, TimePoint now) noexcept override {
    IoStatus status = now > command.t_expires ? IoStatus::kRefused : IoStatus::kDone;
    if (status == IoStatus::kDone) status = on_write(command);
    if (answers.size() < answers.capacity()) {
      answers.push_back({state.package, session, command, state.t_arrival, state.q_rad, status == IoStatus::kDone});
    }
    if (status != IoStatus::kDone) return status;
    state.tracking = obedient && command.action == ArmAction::kTrack;
    if (state.tracking) state.q_rad = command.q_rad;
    return status;
  }

  int fd{-1};
  Duration period{std::chrono::milliseconds(2)};
  ArmState state;
  bool obedient{true};
  std::uint32_t session{0};
  std::vector<Answer> answers;
  std::function<IoStatus()> script{[] { return IoStatus::kEmpty; }};
  std::function<IoStatus(const ArmCommand&)> on_write{[](const ArmCommand&) { return IoStatus::kDone; }};
};

/// Waits without sleeping until `condition`; false after ten seconds.
template <class Condition>
[[nodiscard]] bool eventually(Condition condition) {
  const TimePoint deadline = transport::now() + std::chrono::seconds(10);
  while (!condition()) {
    if (transport::now() > deadline) return false;
    std::this_thread::yield();
  }
  return true;
}

/// A loop on its own thread whose heap use is counted. The destructor ends it through `stop`.
class WatchedThread {
 public:
  WatchedThread(std::atomic<bool>& stop, std::function<void()> body) : stop_(stop), before_(heap_guard::count()) {
    ThreadOptions options;
    options.name = "loop";
    options.watch_heap = true;
    started_ = thread_.start(options, std::move(body)).ok();
  }
  WatchedThread(const WatchedThread&) = delete;
  WatchedThread& operator=(const WatchedThread&) = delete;
  ~WatchedThread() { stop_ = true; }  // thread_ joins
  /// Waits for the end of the loop and returns its heap uses; 0 where they cannot be counted.
  std::uint64_t join() {
    thread_.join();
    return heap_guard::active() ? heap_guard::count() - before_ : 0;
  }
  [[nodiscard]] bool started() const noexcept { return started_; }

 private:
  std::atomic<bool>& stop_;
  std::uint64_t before_;
  bool started_{false};
  Thread thread_;
};

}  // namespace embody::test
