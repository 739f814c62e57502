// A hand behind DDS: the other end is played here, in this process or in a second one on the loopback.
#include "daemon/dds/joint_state_hand.hpp"

#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>

#include <array>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <limits>
#include <map>
#include <random>
#include <thread>

#include "daemon/dds/joint_state_match.hpp"
#include "sensor_msgs.h"
#include "tests/support/heap_counter.hpp"
#include "tests/unit/dds/dds_test_support.hpp"
#include "tests/unit/dds/vendor.hpp"

extern char** environ;

namespace embody::dds {
namespace {

using embody::test::counts_heap;
using embody::test::heap_allocations;
using std::chrono::milliseconds;
using test::Vendor;

constexpr unsigned kSeed = 5;
const std::vector<std::string> kBarrett{"finger_2_prox_joint", "finger_1_med_joint", "finger_2_med_joint",
                                        "finger_3_med_joint"};

TimePoint now() {
  return std::chrono::steady_clock::now();
}

void wait_for(int fd, Duration span) {
  pollfd entry{fd, POLLIN, 0};
  const timespec time{0, span.count()};
  ::ppoll(&entry, 1, &time, nullptr);
}

JointStateHandConfig barrett_config() {
  JointStateHandConfig config;
  config.domain = test::private_domain();
  config.joints = kBarrett;
  config.rate_hz = 1000.0;
  config.connect_timeout = milliseconds(1000);
  return config;
}

HandCommand move_to(const std::vector<double>& q_rad) {
  HandCommand command;
  command.action = HandAction::kMove;
  command.joint_count = q_rad.size();
  std::copy(q_rad.begin(), q_rad.end(), command.q_rad.begin());
  command.t_expires = now() + milliseconds(100);
  return command;
}

HandCommand plain(HandAction action) {
  HandCommand command;
  command.action = action;
  return command;
}

/// Our end and the other, in one process; `connect()` finds a vendor that publishes meanwhile.
class JointStateHandTest : public ::testing::Test {
 protected:
  void SetUp() override {
    auto opened = DdsPublisher::create(test::private_config());
    ASSERT_TRUE(opened) << opened.error().detail.view();
    publisher_.emplace(std::move(*opened));
    vendor_.emplace(test::private_domain());
  }
  void TearDown() override {
    hand_.reset();
    vendor_.reset();
  }

  void open(JointStateHandConfig config = barrett_config()) {
    hand_.emplace(std::move(config));
    const auto info = connect();
    ASSERT_TRUE(info) << info.error().detail.view();
    info_ = *info;
  }
  /// A new session while the vendor publishes `q_` again and again.
  Result<HandInfo> connect() {
    std::atomic<bool> leave{false};
    std::thread talker([&] {
      while (!leave) {
        vendor_->publish(names_, q_);
        wait_for(-1, milliseconds(5));
      }
    });
    auto info = hand_->connect();
    leave = true;
    talker.join();
    return info;
  }
  /// Reads until a state with this first angle has come; false after five seconds or at the end of the session.
  bool state_arrives(double first_rad) {
    const TimePoint deadline = now() + std::chrono::seconds(5);
    while (now() < deadline) {
      const IoStatus status = hand_->read(state_);
      if (status == IoStatus::kDisconnected) return false;
      if (status == IoStatus::kDone && state_.q_rad[0] == first_rad) return true;
      wait_for(info_.fd, milliseconds(5));
    }
    return false;
  }
  bool counter_reaches(const std::function<std::uint64_t()>& counter, std::uint64_t value) {
    const TimePoint deadline = now() + std::chrono::seconds(5);
    while (counter() < value && now() < deadline) wait_for(-1, milliseconds(2));
    return counter() == value;
  }

  std::optional<DdsPublisher> publisher_;
  std::optional<Vendor> vendor_;
  std::optional<JointStateHand> hand_;
  HandInfo info_;
  HandDeviceState state_;
  std::vector<std::string> names_{kBarrett};
  std::vector<double> q_{0.1, -0.2, -0.3, -0.4};
};

TEST(MatchJoints, FindsEveryJointWhateverTheOrderAndTheCompany) {
  SCOPED_TRACE(kSeed);
  std::mt19937 generator(kSeed);
  for (int round = 0; round < 500; ++round) {
    std::vector<std::string> joints, others;
    const std::size_t count = 1 + generator() % kMaxHandJoints;
    for (std::size_t i = 0; i < count; ++i) joints.push_back("j" + std::to_string(i));
    std::vector<std::string> names(joints);
    for (std::size_t i = 0; i < generator() % 40; ++i) names.push_back("other" + std::to_string(i));
    std::shuffle(names.begin(), names.end(), generator);
    std::vector<const char*> pointers;
    std::vector<double> positions;
    std::map<std::string, double> truth;
    for (const std::string& name : names) {
      pointers.push_back(name.c_str());
      positions.push_back(truth[name] = static_cast<double>(generator()));
    }
    const auto whole = match_joints(pointers, positions, joints);
    ASSERT_EQ(whole.match, JointStateMatch::kWhole);
    for (std::size_t i = 0; i < count; ++i) ASSERT_EQ(whole.q_rad[i], truth[joints[i]]);

    const std::size_t gone = generator() % count;
    for (const char*& name : pointers) {
      if (joints[gone] == name) name = generator() % 2 == 0 ? "gone" : nullptr;
    }
    const auto partial = match_joints(pointers, positions, joints);
    ASSERT_EQ(partial.match, count == 1 ? JointStateMatch::kOther : JointStateMatch::kPartial);
    ASSERT_EQ(partial.missing, gone);
  }
}

TEST(MatchJoints, ImpossiblePositionsAreBroken) {
  const std::vector<std::string> joints{"a", "b"};
  const std::array<const char*, 2> names{"a", "b"};
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(match_joints(names, std::vector{1.0}, joints).match, JointStateMatch::kBroken);
  EXPECT_EQ(match_joints(names, {}, joints).match, JointStateMatch::kBroken);
  EXPECT_EQ(match_joints(names, std::vector{1.0, nan}, joints).match, JointStateMatch::kBroken);
  EXPECT_EQ(match_joints({}, {}, joints).match, JointStateMatch::kOther);
  EXPECT_EQ(match_joints(names, std::vector{1.0, 2.0, 3.0}, joints).match, JointStateMatch::kWhole);
}

TEST_F(JointStateHandTest, ConnectingAndHoldingPublishNothing) {
  open();
  EXPECT_EQ(info_.joint_count, 4u);
  EXPECT_EQ(info_.joint_names[3].view(), "finger_3_med_joint");
  for (int i = 0; i < 10; ++i) EXPECT_EQ(hand_->write(plain(HandAction::kHold), now()), IoStatus::kDone);
  EXPECT_EQ(hand_->write(plain(HandAction::kStop), now()), IoStatus::kDone);
  ASSERT_TRUE(connect());
  hand_.reset();
  EXPECT_TRUE(vendor_->commands().empty());
}

TEST_F(JointStateHandTest, StatesArriveByNameAndCommandsWithAllNames) {
  open();
  vendor_->publish({"elbow", "finger_3_med_joint", "finger_2_prox_joint", "finger_1_med_joint", "finger_2_med_joint"},
                   {9.0, 0.4, 0.11, 0.2, 0.3});
  ASSERT_TRUE(state_arrives(0.11));
  EXPECT_EQ(state_.joint_count, 4u);
  EXPECT_EQ(state_.q_rad[1], 0.2);
  EXPECT_EQ(state_.q_rad[3], 0.4);
  EXPECT_LT(now() - state_.t_arrival, std::chrono::seconds(5));
  ASSERT_EQ(hand_->write(move_to({0.5, -0.6, -0.7, -0.8}), now()), IoStatus::kDone);
  const auto commands = vendor_->commands();
  ASSERT_EQ(commands.size(), 1u);
  EXPECT_EQ(commands[0].names, kBarrett);
  EXPECT_EQ(commands[0].q_rad, (std::vector{0.5, -0.6, -0.7, -0.8}));
  EXPECT_GE(commands[0].age_s, 0.0);
  EXPECT_LT(commands[0].age_s, 5.0);
}

TEST_F(JointStateHandTest, RefusesWhatHasExpiredOrIsNotFiniteOrHasTheWrongSize) {
  open();
  HandCommand expired = move_to(q_);
  expired.t_expires = now() - milliseconds(1);
  HandCommand never_valid = move_to(q_);
  never_valid.t_expires = {};
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const HandCommand& command :
       {expired, never_valid, move_to({0.1, 0.2, 0.3}), move_to({0.1, nan, 0.3, 0.4}), move_to({})})
    EXPECT_EQ(hand_->write(command, now()), IoStatus::kRefused);
  EXPECT_TRUE(vendor_->commands().empty());
}

TEST_F(JointStateHandTest, StopPublishesTheMeasuredPositionOnceAndLatches) {
  open();
  ASSERT_EQ(hand_->write(move_to({1.0, -1.0, -1.0, -1.0}), now()), IoStatus::kDone);
  vendor_->publish(names_, {0.21, -0.22, -0.23, -0.24});
  ASSERT_TRUE(state_arrives(0.21));
  EXPECT_EQ(vendor_->commands().size(), 1u);
  EXPECT_EQ(hand_->write(plain(HandAction::kStop), now()), IoStatus::kDone);
  EXPECT_EQ(hand_->write(plain(HandAction::kStop), now()), IoStatus::kDone);
  EXPECT_EQ(hand_->write(move_to(q_), now()), IoStatus::kRefused) << "latched";
  const auto stop = vendor_->commands();
  ASSERT_EQ(stop.size(), 1u);
  EXPECT_EQ(stop[0].q_rad, (std::vector{0.21, -0.22, -0.23, -0.24}));
  EXPECT_EQ(hand_->write(plain(HandAction::kHold), now()), IoStatus::kDone);
  EXPECT_TRUE(hand_->stopped());
  const TimePoint deadline = now() + std::chrono::seconds(5);
  IoStatus moved = IoStatus::kEmpty;  // as long as the rate allows no more
  while (moved == IoStatus::kEmpty && now() < deadline) moved = hand_->write(move_to(q_), now());
  EXPECT_EQ(moved, IoStatus::kDone);
  EXPECT_FALSE(hand_->stopped());
  hand_.reset();
  EXPECT_EQ(vendor_->commands().size(), 2u) << "the move, and the position at the end";
}

TEST_F(JointStateHandTest, StopPublishesNothingWhenConfiguredSo) {
  JointStateHandConfig config = barrett_config();
  config.stop_publishes_position = false;
  open(config);
  ASSERT_EQ(hand_->write(move_to(q_), now()), IoStatus::kDone);
  EXPECT_EQ(hand_->write(plain(HandAction::kStop), now()), IoStatus::kDone);
  EXPECT_EQ(hand_->write(move_to(q_), now()), IoStatus::kRefused);
  hand_.reset();
  EXPECT_EQ(vendor_->commands().size(), 1u);
}

TEST_F(JointStateHandTest, CommandsAreLimitedToTheRate) {
  JointStateHandConfig config = barrett_config();
  config.rate_hz = 50.0;
  open(config);
  const TimePoint start = now();
  std::size_t sent = 0;
  for (int ms = 0; ms < 200; ms += 2) {  // made-up time: a call every 2 ms
    HandCommand command = move_to(q_);
    command.t_expires = start + std::chrono::seconds(1);
    const IoStatus status = hand_->write(command, start + milliseconds(ms));
    ASSERT_TRUE(status == IoStatus::kDone || status == IoStatus::kEmpty);
    if (status == IoStatus::kDone) ++sent;
  }
  EXPECT_EQ(sent, 10u);
  EXPECT_EQ(hand_->counters().throttled, 90u);
}

TEST_F(JointStateHandTest, StatesThatStopEndTheSessionAndConnectOpensANewOneWithoutMotion) {
  open();
  vendor_->publish(names_, {0.9, 0.0, 0.0, 0.0});
  ASSERT_TRUE(state_arrives(0.9));
  const TimePoint start = now();
  while (hand_->read(state_) != IoStatus::kDisconnected && now() < start + std::chrono::seconds(5))
    wait_for(info_.fd, milliseconds(5));
  const Duration took = now() - start;
  std::printf("  states stopped: session over after %.0f ms\n", to_seconds(took) * 1e3);
  EXPECT_GT(took, milliseconds(400));
  EXPECT_LT(took, milliseconds(900));
  EXPECT_NE(hand_->reason().find("have stopped"), std::string_view::npos) << hand_->reason();
  EXPECT_EQ(hand_->write(move_to(q_), now()), IoStatus::kDisconnected);
  EXPECT_TRUE(connect());
  EXPECT_EQ(hand_->read(state_), IoStatus::kEmpty) << "the session lives";
  EXPECT_TRUE(vendor_->commands().empty());
}

TEST_F(JointStateHandTest, AFrozenStampIsNoNewState) {
  open();
  const std::uint64_t before = hand_->counters().repeated;
  for (int i = 0; i < 3; ++i) vendor_->publish(names_, {0.7, 0.0, 0.0, 0.0}, 5'000'000'000);
  ASSERT_TRUE(counter_reaches([this] { return hand_->counters().repeated; }, before + 2));
  EXPECT_TRUE(state_arrives(0.7)) << "the first one counts";
}

TEST_F(JointStateHandTest, PartialBrokenAndForeignMessagesChangeNothing) {
  open();
  vendor_->publish(names_, {0.33, 0.0, 0.0, 0.0});
  ASSERT_TRUE(state_arrives(0.33));
  const std::uint64_t states = hand_->counters().states;
  vendor_->publish({"finger_2_prox_joint"}, {1.0});
  vendor_->publish(names_, {1.0, 2.0});
  vendor_->publish(names_, {1.0, 2.0, 3.0, std::numeric_limits<double>::infinity()});
  vendor_->publish({"shoulder"}, {1.0});
  vendor_->publish({}, {});
  ASSERT_TRUE(counter_reaches([this] { return hand_->counters().broken; }, 2));
  EXPECT_EQ(hand_->counters().partial, 1u);
  EXPECT_EQ(hand_->counters().states, states);
  EXPECT_EQ(hand_->read(state_), IoStatus::kEmpty);
}

TEST_F(JointStateHandTest, ConnectSaysWhatIsMissing) {
  JointStateHandConfig config = barrett_config();
  config.connect_timeout = milliseconds(300);
  hand_.emplace(config);
  const auto silent = hand_->connect();
  ASSERT_FALSE(silent);
  EXPECT_EQ(silent.error().code, Errc::kTimeout);
  EXPECT_NE(silent.error().detail.view().find("no joint states"), std::string_view::npos);
  names_.pop_back();
  q_.pop_back();
  const auto partial = connect();
  ASSERT_FALSE(partial);
  EXPECT_NE(partial.error().detail.view().find("'finger_3_med_joint'"), std::string_view::npos)
      << partial.error().detail.view();
  names_ = kBarrett;
  q_ = {0, 0, 0, 0};
  vendor_.reset();
  vendor_.emplace(test::private_domain(), /*listens=*/false);
  const auto deaf = connect();
  ASSERT_FALSE(deaf);
  EXPECT_NE(deaf.error().detail.view().find("nobody reads"), std::string_view::npos) << deaf.error().detail.view();
  EXPECT_EQ(hand_->write(move_to(q_), now()), IoStatus::kDisconnected);
}

TEST_F(JointStateHandTest, ConnectRefusesAnUnusableConfiguration) {
  const auto refused = [](auto change) {
    JointStateHandConfig config = barrett_config();
    change(config);
    const auto info = JointStateHand(config).connect();
    return !info.ok() && info.error().code == Errc::kInvalidArgument;
  };
  EXPECT_TRUE(refused([](JointStateHandConfig& c) { c.joints.clear(); }));
  EXPECT_TRUE(refused([](JointStateHandConfig& c) { c.joints.resize(kMaxHandJoints + 1, "x"); }));
  EXPECT_TRUE(refused([](JointStateHandConfig& c) { c.joints[1] = c.joints[0]; }));
  EXPECT_TRUE(refused([](JointStateHandConfig& c) { c.joints[0] = ""; }));
  EXPECT_TRUE(refused([](JointStateHandConfig& c) { c.joints[0] = std::string(41, 'x'); }));
  EXPECT_TRUE(refused([](JointStateHandConfig& c) { c.command_topic = c.state_topic; }));
  EXPECT_TRUE(refused([](JointStateHandConfig& c) { c.command_topic = "no topic"; }));
  EXPECT_TRUE(refused([](JointStateHandConfig& c) { c.rate_hz = 0.0; }));
  EXPECT_TRUE(refused([](JointStateHandConfig& c) { c.state_timeout = Duration::zero(); }));
}

TEST_F(JointStateHandTest, ADomainThatNobodyHasOpenedWithAFilterIsNotOpened) {
  JointStateHandConfig config = barrett_config();
  config.domain = test::private_domain() == 100 ? 101 : 100;
  const auto before = udp_sockets();
  const auto info = JointStateHand(config).connect();
  ASSERT_FALSE(info);
  EXPECT_EQ(info.error().code, Errc::kRefused);
  EXPECT_EQ(*udp_sockets(), *before);
}

TEST_F(JointStateHandTest, EverySocketOfTheDomainCarriesTheSourceFilter) {
  open();
  std::size_t filtered = 0;
  const auto sockets = udp_sockets();
  ASSERT_TRUE(sockets);
  for (const UdpSocket& s : *sockets) {
    if (test::has_locked_filter(s.fd)) ++filtered;
  }
  EXPECT_EQ(filtered, publisher_->filtered_sockets()) << "the hand brings none of its own";
}

TEST_F(JointStateHandTest, TheEndOfTheDomainEndsTheSession) {
  open();
  publisher_.reset();
  EXPECT_EQ(hand_->write(move_to(q_), now()), IoStatus::kDisconnected);
  EXPECT_FALSE(hand_->reason().empty());
  EXPECT_FALSE(hand_->connect());
}

TEST_F(JointStateHandTest, ReadDoesNotTouchTheHeapAndWriteTellsWhatCycloneDoes) {
  if (!counts_heap()) GTEST_SKIP() << "sanitizers own malloc";
  open();
  std::uint64_t by_read = 0, by_hold = 0, by_move = 0, states = 0, moves = 0;
  Duration longest{0};
  constexpr int kRounds = 200;
  for (int i = 1; i <= kRounds; ++i) {
    vendor_->publish(names_, {0.01 * i, 0.0, 0.0, 0.0});
    wait_for(info_.fd, milliseconds(50));
    std::uint64_t before = heap_allocations();
    if (hand_->read(state_) == IoStatus::kDone) ++states;
    by_read += heap_allocations() - before;
    before = heap_allocations();
    static_cast<void>(hand_->write(plain(HandAction::kHold), now()));
    by_hold += heap_allocations() - before;
    const HandCommand command = move_to(q_);
    before = heap_allocations();
    const TimePoint start = now();
    const IoStatus written = hand_->write(command, start);
    longest = std::max<Duration>(longest, now() - start);
    by_move += heap_allocations() - before;
    ASSERT_NE(written, IoStatus::kDisconnected);
    if (written == IoStatus::kDone) ++moves;
    wait_for(-1, milliseconds(1));
    static_cast<void>(vendor_->commands());
  }
  std::printf("  dds_write with a reader in this process: %.1f allocations per command, at most %.0f us\n",
              static_cast<double>(by_move) / static_cast<double>(moves), to_seconds(longest) * 1e6);
  EXPECT_GT(states, 100u);
  EXPECT_GT(moves, 100u);
  EXPECT_EQ(by_read, 0u);
  EXPECT_EQ(by_hold, 0u);
}

// --- The other end as a process of its own, on the loopback ---

constexpr const char* kDomainVariable = "EMBODY_TEST_VENDOR_DOMAIN";

/// Not a test: what the second process runs until it is killed. Repeats every command as the next state.
TEST(JointStateHandProcess, DISABLED_Vendor) {
  const char* text = std::getenv(kDomainVariable);
  if (text == nullptr) GTEST_SKIP();
  DdsConfig config;
  config.domain = std::atoi(text);
  auto publisher = DdsPublisher::create(config);
  ASSERT_TRUE(publisher) << publisher.error().detail.view();
  Vendor vendor(config.domain);
  std::vector<double> q_rad{0.0, 0.0, 0.0, 0.0};
  const TimePoint end = now() + std::chrono::seconds(60);
  while (now() < end) {
    for (const auto& command : vendor.commands()) q_rad = command.q_rad;
    vendor.publish(kBarrett, q_rad);
    wait_for(-1, milliseconds(10));
  }
}

pid_t spawn_vendor() {
  std::string filter = "--gtest_filter=JointStateHandProcess.DISABLED_Vendor";
  std::string disabled = "--gtest_also_run_disabled_tests";
  std::string self = "/proc/self/exe";
  std::array<char*, 4> arguments{self.data(), filter.data(), disabled.data(), nullptr};
  ::setenv(kDomainVariable, std::to_string(test::private_domain()).c_str(), 1);
  pid_t child = -1;
  const int failed = ::posix_spawn(&child, self.c_str(), nullptr, nullptr, arguments.data(), environ);
  ::unsetenv(kDomainVariable);
  return failed == 0 ? child : -1;
}

TEST(JointStateHandProcess, CommandsReachAnotherProcessAndItsDeathEndsTheSession) {
  auto publisher = DdsPublisher::create(test::private_config());
  ASSERT_TRUE(publisher) << publisher.error().detail.view();
  const pid_t vendor = spawn_vendor();
  ASSERT_GT(vendor, 0);
  JointStateHandConfig config = barrett_config();
  config.connect_timeout = std::chrono::seconds(20);
  JointStateHand hand(config);
  const auto info = hand.connect();
  EXPECT_TRUE(info) << info.error().detail.view();
  HandDeviceState state;
  std::uint64_t allocations = 0, moves = 0;
  const TimePoint deadline = now() + std::chrono::seconds(20);
  for (double q = 0.01; info && q < 0.505 && now() < deadline; q += 0.01) {
    const std::uint64_t before = heap_allocations();
    ASSERT_EQ(hand.write(move_to({q, -q, -q, -q}), now()), IoStatus::kDone);
    allocations += heap_allocations() - before;
    ++moves;
    while (state.q_rad[0] != q && hand.read(state) != IoStatus::kDisconnected && now() < deadline)
      wait_for(info->fd, milliseconds(5));
    EXPECT_EQ(state.q_rad[3], -q);
  }
  if (counts_heap() && moves > 0)
    std::printf("  dds_write over the loopback: %.1f allocations per command\n",
                static_cast<double>(allocations) / static_cast<double>(moves));
  EXPECT_EQ(moves, 50u);
  ::kill(vendor, SIGKILL);
  const TimePoint killed = now();
  ::waitpid(vendor, nullptr, 0);
  while (info && hand.read(state) != IoStatus::kDisconnected && now() < killed + std::chrono::seconds(5))
    wait_for(info->fd, milliseconds(5));
  std::printf("  the other end was killed: session over after %.0f ms\n", to_seconds(now() - killed) * 1e3);
  EXPECT_LT(now() - killed, milliseconds(1500));
  EXPECT_FALSE(hand.reason().empty());
}

}  // namespace
}  // namespace embody::dds
