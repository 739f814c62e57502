#include "daemon/loops/links_loop.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <optional>
#include <thread>

#include "drivers/transport/clock.hpp"

namespace embody {
namespace {

using transport::now;

/// A device whose upkeep fails, and the loop that sees to it.
struct LinksBench {
  explicit LinksBench(bool service_ends_session) {
    Link link;
    link.name = "device";
    link.with_links = [this] { return !connected.load(); };
    link.connect = [this]() -> Result<std::string> {
      connected = true;
      return std::string("a fake");
    };
    link.service = [this]() -> Status {
      ++serviced;
      if (failing) return make_error(Errc::kRefused, "switch it to remote control");
      return {};
    };
    link.service_ends_session = service_ends_session;
    link.revoke = [this] { revoked = true; };
    link.reason = [] { return std::string(); };
    std::vector<Link> links;
    links.push_back(std::move(link));
    loop.emplace(std::move(links), LinksConfig{}, edges);
    thread = std::thread([this] { loop->run(); });
  }
  ~LinksBench() {
    edges.stop = true;
    thread.join();
  }
  /// Until the upkeep ran once more, and its outcome is told; false after ten seconds.
  bool serviced_again() {
    const int target = serviced + 2;  // the one before the last is over
    for (const TimePoint end = now() + std::chrono::seconds(10); now() < end; std::this_thread::yield()) {
      if (serviced >= target) return true;
    }
    return false;
  }

  Edges edges;
  std::atomic<bool> connected{false}, failing{true}, revoked{false};
  std::atomic<int> serviced{0};
  std::optional<LinksLoop> loop;
  std::thread thread;
};

TEST(LinksLoop, TellsOfFailedUpkeepAndKeepsASessionThatOutlivesIt) {
  LinksBench bench(false);
  ASSERT_TRUE(bench.serviced_again());
  DeviceReport report = bench.loop->reports().front();
  EXPECT_EQ(report.detail, "switch it to remote control");
  EXPECT_TRUE(report.connected);
  EXPECT_FALSE(bench.revoked);
  bench.failing = false;
  ASSERT_TRUE(bench.serviced_again());
  report = bench.loop->reports().front();
  EXPECT_EQ(report.detail, "");
  EXPECT_EQ(report.sessions, 1U);
}

TEST(LinksLoop, EndsASessionWhoseUpkeepFailedWhereThatIsTheRule) {
  LinksBench bench(true);
  ASSERT_TRUE(bench.serviced_again());
  EXPECT_TRUE(bench.revoked);
}

}  // namespace
}  // namespace embody
