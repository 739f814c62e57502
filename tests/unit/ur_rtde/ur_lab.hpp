#pragma once
// A simulated controller and an arm driver that is told its ports, for tests.
#include <gtest/gtest.h>

#include <thread>

#include "drivers/sim/ur/ur_controller.hpp"
#include "drivers/ur_rtde/dashboard.hpp"
#include "tests/unit/ur_rtde/arm_loop.hpp"

namespace embody::test {

inline sim::UrControllerConfig fast_controller() {
  sim::UrControllerConfig config;
  config.times.boot = config.times.power = config.times.brakes = std::chrono::milliseconds(60);
  config.times.unlock = std::chrono::milliseconds(200);
  return config;
}

struct UrLab {
  explicit UrLab(sim::UrControllerConfig config = fast_controller()) : controller(std::move(config)) {
    const Status started = controller.start();
    EXPECT_TRUE(started.ok()) << started.error().detail.c_str();
  }
  [[nodiscard]] UrRtdeConfig driver() const {
    UrRtdeConfig config = ArmLoop::without_upload(controller.port(), std::chrono::seconds(4));
    config.upload = true;
    config.primary_port = controller.primary_port();
    config.upload_retry = std::chrono::milliseconds(100);
    return config;
  }
  [[nodiscard]] ur::Dashboard dashboard() const {
    ur::DashboardConfig config;
    config.port = controller.dashboard_port();
    return ur::Dashboard(config);
  }
  void fault(std::string_view text) {
    const Status done = controller.fault(text);
    EXPECT_TRUE(done.ok()) << done.error().detail.c_str();
  }
  sim::UrController controller;
};

/// Holds the arm with one command per package while a second thread does the upkeep, as a daemon would.
class ServicedLoop {
 public:
  explicit ServicedLoop(const UrRtdeConfig& config) : loop(config) {
    EXPECT_TRUE(loop.connected) << loop.error.detail.c_str();
  }
  ~ServicedLoop() { halt(); }
  ServicedLoop(const ServicedLoop&) = delete;
  ServicedLoop& operator=(const ServicedLoop&) = delete;

  /// Runs until `done(newest state, newest sentence of service())`; false after five seconds or a lost session.
  template <class Done>
  bool hold_until(Done done) {
    start();
    const bool reached = loop.send_until(ArmAction::kHold, Vector6::Zero(), [&](const ArmState& state) {
      const std::scoped_lock lock(mutex_);
      return done(state, sentence_);
    });
    halt();
    return reached;
  }
  bool ready() {
    return hold_until([](const ArmState& s, const std::string&) { return s.condition == ArmCondition::kReady; });
  }
  /// Until service() complains with all these words in its sentence.
  bool says(std::initializer_list<std::string_view> words) {
    return hold_until([&](const ArmState&, const std::string& sentence) {
      return std::all_of(words.begin(), words.end(),
                         [&](std::string_view w) { return sentence.find(w) != std::string::npos; });
    });
  }
  [[nodiscard]] const std::string& sentence() const { return sentence_; }

  ArmLoop loop;

 private:
  void start() {
    sentence_.clear();
    thread_ = std::jthread([this](const std::stop_token& stop) {
      while (!stop.stop_requested()) {
        const Status status = loop.arm->service();
        {
          const std::scoped_lock lock(mutex_);
          sentence_ = status ? "" : status.error().detail.c_str();
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(20));  // the pace of the upkeep, 50 times the real one
      }
    });
  }
  void halt() { thread_ = {}; }

  std::mutex mutex_;
  std::string sentence_;
  std::jthread thread_;
};

}  // namespace embody::test
