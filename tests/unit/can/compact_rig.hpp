#pragma once
// A hand with the profile "compact" behind the double, and its driver in a session.
#include "tests/unit/can/rig.hpp"

namespace embody::test {

inline mia::compact::CompactConfig patient_compact() {
  mia::compact::CompactConfig config;
  config.ack_timeout = milliseconds(150);  // tests of other things must not trip over a busy machine
  config.state_timeout = milliseconds(400);
  return config;
}

struct CompactRig {
  explicit CompactRig(mia::compact::CompactConfig config = patient_compact(), sim::CompactHandConfig simulated = {}) {
    if (config.interface == "can0") config.interface = double_name();
    simulator.emplace(sim::CanSimulatorConfig{.interface = config.interface,
                                              .profile = sim::CanProfile::kCompact,
                                              .tunnel = {},
                                              .serial_hand = {},
                                              .compact_hand = simulated});
    const Status started = simulator->start();
    EXPECT_TRUE(started.ok()) << started.error().detail.view();
    hand.emplace(config);
    connect();
  }
  void connect() {
    const auto connected = hand->connect();
    ASSERT_TRUE(connected.ok()) << connected.error().detail.view();
    info = *connected;
    loop.emplace(HandLoop{*hand, info.fd});
  }
  /// Commands `make()` at 20 Hz until `done`.
  bool drive(const std::function<HandCommand()>& make, const std::function<bool()>& done, Duration limit = seconds(5)) {
    TimePoint next = transport::now();
    return loop->until(
        [&] {
          if (transport::now() >= next) {
            static_cast<void>(hand->write(make(), transport::now()));
            next = transport::now() + milliseconds(50);
          }
          return done();
        },
        limit);
  }
  void fault(const char* text) {
    const Status status = simulator->fault(text);
    ASSERT_TRUE(status.ok()) << status.error().detail.view();
  }
  [[nodiscard]] bool at(const std::array<double, mia::kMotors>& counts) const {
    const auto now = simulator->motor_counts();
    for (std::size_t i = 0; i < mia::kMotors; ++i) {
      if (std::abs(now[i] - counts[i]) > 1.0) return false;
    }
    return true;
  }

  std::optional<sim::MiaCanSimulator> simulator;
  std::optional<mia::compact::MiaCanHand> hand;
  HandInfo info;
  std::optional<HandLoop> loop;
};

}  // namespace embody::test
