// Connections that break on the network, over real TCP in a network of our own: an end (FIN), a peer that has forgotten
// the connection (RST), packets that vanish, a pulled cable. The drivers say kDisconnected within their bounds, and
// connect() works again when the network does. Skipped where network namespaces are not allowed.
#include <gtest/gtest.h>

#include <optional>
#include <thread>

#include "drivers/qualisys/qualisys_tracker.hpp"
#include "drivers/sim/qtm/qtm_server.hpp"
#include "drivers/sim/ur/ur_controller.hpp"
#include "drivers/transport/clock.hpp"
#include "drivers/transport/tcp.hpp"
#include "drivers/ur_rtde/ur_rtde_arm.hpp"
#include "tests/unit/transport/private_network.hpp"

namespace embody::test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

// drivers/qualisys/rt_connection.hpp: "within about 4 s"; drivers/ur_rtde/ur_rtde_arm.hpp: stale_after, 100 ms. The
// rest is for a busy machine.
constexpr Duration kTrackerBound = seconds(4) + seconds(2);
constexpr Duration kArmBound = milliseconds(100) + seconds(1);
constexpr Duration kPatience = seconds(40);

PrivateNetwork& network() {
  static PrivateNetwork network;
  return network;
}

/// Reads until the session is over; how long that took, or nothing.
template <class Reading, class Driver>
std::optional<Duration> end_of_session(Driver& driver, int fd, Duration limit) {
  const TimePoint start = transport::now();
  Reading reading;
  while (transport::now() < start + limit) {
    static_cast<void>(transport::wait_readable(fd, transport::now() + milliseconds(5)));
    IoStatus status = IoStatus::kDone;
    while (status == IoStatus::kDone) status = driver.read(reading);
    if (status == IoStatus::kDisconnected) return transport::now() - start;
  }
  return std::nullopt;
}

template <class Reading, class Driver>
bool reads(Driver& driver, int fd, int count) {
  const TimePoint deadline = transport::now() + kPatience;
  Reading reading;
  while (count > 0 && transport::now() < deadline) {
    static_cast<void>(transport::wait_readable(fd, transport::now() + milliseconds(5)));
    const IoStatus status = driver.read(reading);
    if (status == IoStatus::kDisconnected) return false;
    if (status == IoStatus::kDone) --count;
  }
  return count == 0;
}

/// connect() until it works, as the daemon does; the descriptor, -1 when it never did.
template <class Driver>
int reconnect(Driver& driver) {
  const TimePoint start = transport::now();
  while (transport::now() < start + kPatience) {
    const auto info = driver.connect();
    if (!info) {
      std::printf("[ refused  ] %s\n", info.error().detail.c_str());
      std::this_thread::sleep_for(milliseconds(100));
      continue;
    }
    std::printf("[ figures  ] connected again after %.2f s\n", to_seconds(transport::now() - start));
    return info->fd;
  }
  return -1;
}

/// The session ends within `bound`, with a sentence.
template <class Reading, class Driver>
void expect_end(Driver& driver, int fd, const char* what, Duration bound) {
  const auto took = end_of_session<Reading>(driver, fd, kPatience);
  ASSERT_TRUE(took.has_value()) << what;
  EXPECT_LE(*took, bound) << what;
  EXPECT_FALSE(driver.reason().empty());
  std::printf("[ fault    ] %s: %.0f ms, \"%.*s\"\n", what, 1e3 * to_seconds(*took),
              static_cast<int>(driver.reason().size()), driver.reason().data());
}

class BrokenLink : public testing::Test {
 protected:
  void SetUp() override {
    if (!network().why_not().empty()) GTEST_SKIP() << "no network namespaces here: " << network().why_not();
  }
};

/// A tracker in a session that delivers frames.
struct TrackerRig {
  TrackerRig() {
    network().at_far_end([this] {
      sim::QtmServerConfig config;
      config.address = PrivateNetwork::kFarAddress;
      sim::Motion motion;
      motion.rate_hz = 100.0;
      motion.marker_names = {"a", "b"};
      motion.generate = [](std::size_t, std::span<Marker> markers) {
        for (Marker& marker : markers) marker.visible = true;
      };
      motion.source = "still";
      qtm.emplace(config, motion);
      EXPECT_TRUE(qtm->start().ok());
      qtm->play();
    });
    qualisys::QualisysConfig config;
    config.host = PrivateNetwork::kFarAddress;
    config.port = qtm->port();
    tracker.emplace(config, std::vector<std::string>{"a", "b"});
    const auto info = tracker->connect();
    EXPECT_TRUE(info.ok()) << info.error().detail.view();
    if (info) fd = info->fd;
    EXPECT_TRUE(reads<MarkerFrame>(*tracker, fd, 5));
  }
  ~TrackerRig() { network().mend(); }

  void expect_end(const char* what, Duration bound) {
    embody::test::expect_end<MarkerFrame>(*tracker, fd, what, bound);
  }
  void expect_back() {
    fd = reconnect(*tracker);
    ASSERT_GE(fd, 0);
    EXPECT_TRUE(reads<MarkerFrame>(*tracker, fd, 5)) << tracker->reason();
  }

  std::optional<sim::QtmServer> qtm;
  std::optional<qualisys::QualisysTracker> tracker;
  int fd{-1};
};

struct ArmRig {
  ArmRig() {
    network().at_far_end([this] {
      sim::UrControllerConfig config;
      config.address = PrivateNetwork::kFarAddress;
      controller.emplace(config);
      EXPECT_TRUE(controller->start().ok());
    });
    UrRtdeConfig config;
    config.host = PrivateNetwork::kFarAddress;
    config.port = controller->port();
    config.upload = false;
    config.stale_after = milliseconds(100);
    arm.emplace(config);
    const auto info = arm->connect();
    EXPECT_TRUE(info.ok()) << info.error().detail.view();
    if (info) fd = info->fd;
    EXPECT_TRUE(reads<ArmState>(*arm, fd, 5));
  }
  ~ArmRig() { network().mend(); }

  void expect_end(const char* what, Duration bound) { embody::test::expect_end<ArmState>(*arm, fd, what, bound); }
  void expect_back() {
    const Vector6 q_rad = controller->latest().q_rad;
    fd = reconnect(*arm);
    ASSERT_GE(fd, 0);
    EXPECT_TRUE(reads<ArmState>(*arm, fd, 5)) << arm->reason();
    EXPECT_EQ(controller->latest().q_rad, q_rad) << "connecting moves nothing";
  }

  std::optional<sim::UrController> controller;
  std::optional<UrRtdeArm> arm;
  int fd{-1};
};

TEST_F(BrokenLink, ATrackerThatClosesEndsTheSessionAtOnce) {
  TrackerRig rig;
  rig.qtm->disconnect_clients();
  rig.expect_end("FIN", seconds(2));
  EXPECT_NE(rig.tracker->reason().find("closed"), std::string_view::npos);
  rig.expect_back();
}

TEST_F(BrokenLink, PacketsOfTheTrackerThatVanishEndTheSessionWithinItsBound) {
  TrackerRig rig;
  network().lose_packets();
  rig.expect_end("packets vanish", kTrackerBound);
  EXPECT_NE(rig.tracker->reason().find("no longer answers"), std::string_view::npos);
  const TimePoint start = transport::now();
  EXPECT_FALSE(rig.tracker->connect().ok());
  EXPECT_LE(transport::now() - start, seconds(5) + seconds(2)) << "connect() takes at most 5 s";
  network().mend();
  rig.expect_back();
}

TEST_F(BrokenLink, APulledCableOfTheTrackerEndsTheSessionWithinItsBound) {
  TrackerRig rig;
  network().pull_cable();
  rig.expect_end("cable pulled", kTrackerBound);
  EXPECT_NE(rig.tracker->reason().find("no longer answers"), std::string_view::npos);
  network().mend();
  rig.expect_back();
}

TEST_F(BrokenLink, ATrackerThatHasForgottenTheConnectionEndsTheSessionWithinItsBound) {
  TrackerRig rig;
  network().replace_far_end();
  rig.expect_end("RST of a computer that was restarted", kTrackerBound);
  EXPECT_NE(rig.tracker->reason().find("was it restarted"), std::string_view::npos);
  const auto nobody = rig.tracker->connect();
  ASSERT_FALSE(nobody.ok());
  EXPECT_EQ(nobody.error().code, Errc::kDisconnected) << nobody.error().detail.view();
}

TEST_F(BrokenLink, AShortGapIsNoEnd) {
  TrackerRig rig;
  network().lose_packets();
  std::this_thread::sleep_for(milliseconds(300));
  network().mend();
  EXPECT_TRUE(reads<MarkerFrame>(*rig.tracker, rig.fd, 50)) << rig.tracker->reason();
}

TEST_F(BrokenLink, AnArmsControllerThatClosesEndsTheSessionAtOnce) {
  ArmRig rig;
  rig.controller->stop();
  rig.expect_end("FIN or RST", seconds(2));
  network().at_far_end([&] { ASSERT_TRUE(rig.controller->start().ok()); });
}

TEST_F(BrokenLink, AnArmThatHasForgottenTheConnectionEndsTheSessionWithinItsBound) {
  ArmRig rig;
  network().replace_far_end();
  rig.expect_end("RST of a controller that was restarted", kArmBound);
}

TEST_F(BrokenLink, PacketsOfTheArmThatVanishEndTheSessionWithinItsBound) {
  ArmRig rig;
  network().lose_packets();
  rig.expect_end("packets vanish", kArmBound);
  const TimePoint start = transport::now();
  EXPECT_FALSE(rig.arm->connect().ok());
  EXPECT_LE(transport::now() - start, seconds(1) + seconds(2)) << "reply_timeout";
  network().mend();
  rig.expect_back();
}

TEST_F(BrokenLink, APulledCableOfTheArmEndsTheSessionWithinItsBound) {
  ArmRig rig;
  network().pull_cable();
  rig.expect_end("cable pulled", kArmBound);
  network().mend();
  rig.expect_back();
}

}  // namespace
}  // namespace embody::test
