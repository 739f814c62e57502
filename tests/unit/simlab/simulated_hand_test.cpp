// Laws of the lab's hands, with the driver that the daemon would take for each.
#include "daemon/simlab/simulated_hand.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <span>
#include <thread>

#include "daemon/app/config_io.hpp"
#include "daemon/app/devices.hpp"
#include "drivers/transport/clock.hpp"

namespace embody::sim {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using transport::now;

struct Case {
  const char* name;
  const char* config;  ///< of the hand; %s: a name that belongs to the test
  std::optional<mia::Generation> generation;
};

const std::vector<Case> kCases{
    {"MiaAcknowledging", "[hand]\n", mia::Generation::kAcknowledging},
    {"MiaStreaming", "[hand]\n", mia::Generation::kStreaming},
    {"MiaCompact", "[hand.mia]\nwire = \"can_compact\"\ncan_interface = \"unix:%s\"\n", {}},
    {"MiaSegments", "[hand.mia]\nwire = \"can_segments\"\ncan_interface = \"unix:%s\"\n", {}},
    {"BarrettByDds",
     "[hand]\nfile = \"hands/barrett.toml\"\ndriver = \"joint_state\"\nrate_hz = 50.0\n[dds]\ndomain = %d\n",
     {}},
    {"Robotiq", "[hand]\nfile = \"hands/robotiq_2f140.toml\"\ndriver = \"robotiq\"\n", {}},
};

bool until(const std::function<bool()>& condition) {
  for (const TimePoint deadline = now() + seconds(20); now() < deadline;) {
    if (condition()) return true;
    std::this_thread::sleep_for(milliseconds(2));
  }
  return false;
}

class LabHand : public ::testing::TestWithParam<Case> {
 protected:
  void SetUp() override {
    const std::string path = "/tmp/embody-lab-hand-" + std::to_string(::getpid());
    std::string text = GetParam().config;
    if (const auto at = text.find("%d"); at != std::string::npos) {
      text.replace(at, 2, std::to_string(20 + ::getpid() % 80));
    }
    if (const auto at = text.find("%s"); at != std::string::npos) text.replace(at, 2, path);
    auto config = config::parse_config("schema = 1\n" + text, "test.toml", EMBODY_SOURCE_DIR "/config");
    ASSERT_TRUE(config.ok()) << config.error().detail.view();
    config_ = *config;
    HandOptions options;
    options.mia_generation = GetParam().generation;
    auto hand = make_simulated_hand(config_, options);
    hand_ = std::move(hand);
    const Status started = hand_->start();
    ASSERT_TRUE(started.ok()) << started.error().detail.view();
    config_.hand.device = hand_->device();
  }

  /// Where a motor is sent to.
  [[nodiscard]] double target_rad(std::size_t motor) const {
    const EmbodimentConfig& hand = config_.hand.embodiment;
    return std::clamp(0.4, hand.motor_lower_rad[motor], hand.motor_upper_rad[motor]);
  }

  /// Lets the driver do this again and again until `condition` holds.
  bool drive(HandDriver& driver, HandAction action, const std::function<bool()>& condition) {
    HandCommand command;
    command.action = action;
    command.joint_count = config_.hand.embodiment.motors.size();
    for (std::size_t i = 0; i < command.joint_count; ++i) command.q_rad[i] = target_rad(i);
    HandDeviceState state;
    return until([&] {
      command.t_expires = now() + milliseconds(200);
      static_cast<void>(driver.write(command, now()));
      std::this_thread::sleep_for(milliseconds(20));
      while (driver.read(state) == IoStatus::kDone) {
      }
      return condition();
    });
  }

  config::EmbodyConfig config_;
  std::unique_ptr<SimulatedHand> hand_;
};

TEST_P(LabHand, IsInUseOnlyWhenItsDriverTalksAndShowsInItsLogWhereItWent) {
  EXPECT_FALSE(hand_->device().empty());
  EXPECT_FALSE(hand_->in_use());
  const std::vector<double> before = hand_->joint_angles_rad();
  ASSERT_EQ(before.size(), config_.hand.embodiment.motors.size());
  const auto driver = make_hand(config_);
  const auto info = driver->connect();
  ASSERT_TRUE(info.ok()) << info.error().detail.view();
  EXPECT_TRUE(drive(*driver, HandAction::kHold, [this] { return hand_->in_use(); })) << "also before it moves";
  const auto is_there = [this](std::span<const double> q_rad) {
    for (std::size_t i = 0; i < q_rad.size(); ++i) {
      if (std::abs(q_rad[i] - target_rad(i)) > 0.03) return false;
    }
    return true;
  };
  EXPECT_TRUE(drive(*driver, HandAction::kMove, [&] { return is_there(hand_->joint_angles_rad()); }))
      << hand_->joint_angles_rad().front();
  ASSERT_TRUE(until([&] {
    const auto log = hand_->log();
    return log.size() > 3 && is_there({log.back().q_rad.data(), log.back().count});
  }));
  const auto log = hand_->log();
  EXPECT_NEAR(log.front().q_rad[0], before[0], 0.05) << "the log begins where the hand began";
  for (std::size_t i = 1; i < log.size(); ++i) {
    ASSERT_GE(log[i].t, log[i - 1].t);
    ASSERT_EQ(log[i].count, before.size());
  }
  std::uint64_t motions = 0;
  for (const auto& [name, value] : hand_->counters()) {
    if (std::string_view(name) == "motions") motions = value;
  }
  EXPECT_GT(motions, 0U);
}

TEST_P(LabHand, LosesItsDriverByAFaultAndIsFoundAgain) {
  const bool can = hand_->device().starts_with("unix:");
  const bool dds = hand_->device().starts_with("rt/");
  const char* away = dds ? "silent on" : can ? "down" : "unplug";
  const char* back = dds ? "silent off" : can ? "up" : "plug";
  const auto driver = make_hand(config_);
  ASSERT_TRUE(driver->connect().ok());
  ASSERT_TRUE(hand_->check_fault(away).ok());
  ASSERT_TRUE(hand_->fault(away).ok());
  HandDeviceState state;
  EXPECT_TRUE(until([&] {
    HandCommand hold;
    static_cast<void>(driver->write(hold, now()));
    return driver->read(state) == IoStatus::kDisconnected;
  }));
  ASSERT_TRUE(hand_->fault(back).ok());
  config_.hand.device = hand_->device();  // a new pseudo-terminal, as long as no symlink names it
  EXPECT_TRUE(make_hand(config_)->connect().ok());
}

TEST_P(LabHand, KnowsWhatItListsAndNothingElse) {
  EXPECT_FALSE(hand_->fault_help().empty());
  for (const char* words : {"", "nonsense", "mute", "mute perhaps", "drop -1", "drop 1 2", "delay x"}) {
    EXPECT_FALSE(hand_->check_fault(words).ok()) << words;
    EXPECT_FALSE(hand_->fault(words).ok()) << words;
  }
}

INSTANTIATE_TEST_SUITE_P(Hands, LabHand, ::testing::ValuesIn(kCases),
                         [](const auto& tested) { return std::string(tested.param.name); });

}  // namespace
}  // namespace embody::sim
