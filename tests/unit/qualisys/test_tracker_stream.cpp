// Frames over TCP and UDP: rates, stalls, silence, clocks, shuffled and foreign datagrams.
#include <gtest/gtest.h>
#include <sys/socket.h>

#include <atomic>
#include <random>

#include "tests/support/heap_counter.hpp"
#include "tests/unit/qualisys/tracker_bench.hpp"

namespace embody::qualisys {
namespace {

using test::Bytes;
using test::FakeQtmSettings;
using test::has;
using test::tell_fault;
using test::TrackerBench;

constexpr Duration kForever = std::chrono::seconds(60);

QualisysConfig over_udp() {
  QualisysConfig config;
  config.transport = Transport::kUdp;
  return config;
}

FakeQtmSettings with_hand() {
  FakeQtmSettings settings;
  settings.bodies_xml = "<Body><Name>hand</Name></Body>";
  return settings;
}

/// Pushes frames at an even pace from a thread of its own, as QTM does.
class PacedSource {
 public:
  PacedSource(TrackerBench& bench, double rate_hz, std::uint64_t frames)
      : thread_([this, &bench, rate_hz, frames] {
          const auto period_us = static_cast<std::uint64_t>(1e6 / rate_hz);
          const auto begin = transport::now();
          for (std::uint64_t k = 1; k <= frames && !stop_; ++k) {
            std::this_thread::sleep_until(begin + std::chrono::microseconds(k * period_us));
            bench.qtm->push_frame(bench.frame(k, period_us));
            pushed_ = k;
          }
        }) {}
  ~PacedSource() {
    stop_ = true;
    thread_.join();
  }
  [[nodiscard]] std::uint64_t pushed() const { return pushed_; }

 private:
  std::atomic<std::uint64_t> pushed_{0};
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

TEST(TrackerStream, LosesNoFrameOf64MarkersAtAnyRate) {
  for (const double rate_hz : {100.0, 300.0, 1000.0}) {
    FakeQtmSettings settings;
    settings.rate_hz = rate_hz;
    QualisysConfig config;
    config.backlog_limit = kForever;  // whatever a busy machine does to this test, no frame may be missing
    TrackerBench bench(64, settings, config);
    ASSERT_TRUE(bench.connect().ok());
    const auto frames = static_cast<std::uint64_t>(1.5 * rate_hz);
    const PacedSource source(bench, rate_hz, frames);
    Duration latest{0};
    for (std::uint64_t k = 1; k <= frames; ++k) {
      bench.expect(k);
      latest = std::max(latest, bench.last.t_arrival - bench.last.t_capture);
    }
    const auto counters = bench.tracker->counters();
    EXPECT_EQ(counters.frames, frames);
    EXPECT_EQ(counters.skipped + counters.useless + counters.incomplete, 0U);
    EXPECT_EQ(counters.missing + counters.drains, 0U) << "every frame number came";
    EXPECT_EQ(counters.label_epochs, 1U);
    std::printf("%.0f Hz, 64 markers: %llu frames, none lost, latest %.2f ms behind the fastest\n", rate_hz,
                static_cast<unsigned long long>(frames), 1e3 * to_seconds(latest));
  }
}

TEST(TrackerStream, IsBackAtTheNewestFrameWithinTwoAfterAStall) {
  FakeQtmSettings settings;
  settings.rate_hz = 1000.0;
  TrackerBench bench(64, settings);
  ASSERT_TRUE(bench.connect().ok());
  const PacedSource source(bench, 1000.0, 100'000);
  while (bench.last.frame_number < 100) ASSERT_EQ(bench.next(bench.last), IoStatus::kDone);
  std::uint64_t before = bench.last.frame_number;
  for (const int stall_ms : {400, 800, 1200}) {
    ASSERT_TRUE(test::eventually([&] { return source.pushed() >= before + static_cast<std::uint64_t>(stall_ms); }));
    const std::uint64_t newest = source.pushed();
    const auto begin = transport::now();
    MarkerFrame frame;
    ASSERT_EQ(bench.tracker->read(frame), IoStatus::kDone);
    const auto took = transport::now() - begin;
    EXPECT_GE(frame.frame_number + 2, newest) << "the first frame after the stall";
    std::printf(
        "stall of %d ms: %llu frames waited, the first one read is %lld behind the newest, read() took %.2f ms\n",
        stall_ms, static_cast<unsigned long long>(newest - before),
        static_cast<long long>(newest) - static_cast<long long>(frame.frame_number), 1e3 * to_seconds(took));
    tell_fault("reader stalls while frames queue up", took, "skips to the newest frame", "by itself");
    before = frame.frame_number;
  }
  EXPECT_GT(bench.tracker->counters().skipped, 2000U);
  EXPECT_GE(bench.tracker->counters().drains, 1U);
}

TEST(TrackerStream, KeepsEveryFrameOfAShortStall) {
  TrackerBench bench;
  bench.config.backlog_limit = kForever;
  bench.tracker.emplace(bench.config, bench.names);
  ASSERT_TRUE(bench.connect().ok());
  for (std::uint64_t k = 1; k <= 300; ++k) bench.qtm->push_frame(bench.frame(k));
  for (std::uint64_t k = 1; k <= 300; ++k) bench.expect(k);
  EXPECT_EQ(bench.tracker->counters().skipped, 0U);
}

TEST(TrackerStream, ReadsWithoutHeapInEveryMode) {
  for (const auto transport : {Transport::kTcp, Transport::kUdp}) {
    QualisysConfig config;
    config.transport = transport;
    config.rigid_body = "hand";
    TrackerBench bench(64, with_hand(), config);
    ASSERT_TRUE(bench.connect().ok());
    for (std::uint64_t k = 1; k <= 60; ++k) {
      auto wire = bench.frame(k);
      auto second = wire;
      second.parts.erase(second.parts.begin());
      if (k % 3 == 0) wire.parts.pop_back();
      bench.qtm->push(test::wire_event(3, ByteOrder::kLittle));
      bench.qtm->push_frame(wire);
      if (k % 3 == 0) bench.qtm->push_frame(second);
      MarkerFrame frame;
      IoStatus status = IoStatus::kEmpty;
      while (status == IoStatus::kEmpty) {
        ASSERT_TRUE(transport::wait_readable(bench.fd, transport::now() + std::chrono::seconds(10)));
        const auto before = test::heap_allocations();
        status = bench.tracker->read(frame);
        ASSERT_EQ(test::heap_allocations(), before);
      }
      ASSERT_EQ(status, IoStatus::kDone) << bench.tracker->reason();
    }
  }
}

TEST(TrackerStream, StartsTheClockAnewWhenQtmsTimeGoesBack) {
  TrackerBench bench;
  ASSERT_TRUE(bench.connect().ok());
  for (std::uint64_t k = 1000; k <= 1010; ++k) {
    bench.qtm->push_frame(bench.frame(k));
    bench.expect(k);
  }
  const auto before = bench.last;
  const auto begin = transport::now();
  bench.qtm->push_frame(bench.frame(1));
  bench.expect(1);
  tell_fault("time stamps start anew", transport::now() - begin, "new label epoch, clock map starts anew", "by itself");
  EXPECT_NE(bench.last.label_epoch, before.label_epoch);
  EXPECT_GE(bench.last.t_capture, before.t_capture);
  EXPECT_LE(bench.last.t_capture, bench.last.t_arrival);
  EXPECT_EQ(bench.tracker->counters().clock_restarts, 1U);
}

TEST(TrackerStream, DoesNotNeedFrameNumbers) {
  TrackerBench bench;
  ASSERT_TRUE(bench.connect().ok());
  for (std::uint64_t k = 1; k <= 50; ++k) {
    auto wire = bench.frame(k);
    wire.number = 1;
    bench.qtm->push_frame(wire);
    bench.expect(k);
    EXPECT_EQ(bench.last.frame_number, 1U);
  }
}

TEST(TrackerStream, TakesNoMoreDataAsAPause) {
  QualisysConfig config;
  config.reply_timeout = std::chrono::seconds(5);
  TrackerBench bench(3, {}, config);
  ASSERT_TRUE(bench.connect().ok());
  bench.qtm->push(test::wire_no_more_data(ByteOrder::kLittle));
  MarkerFrame frame;
  const auto end = transport::now() + std::chrono::milliseconds(3500);
  while (transport::now() < end) {  // longer than the silence that a measuring QTM is allowed
    ASSERT_EQ(bench.tracker->read(frame), IoStatus::kEmpty);
    ASSERT_TRUE(bench.tracker->service().ok());
  }
  bench.qtm->push_frame(bench.frame(1));
  bench.expect(1);
}

TEST(TrackerStream, GivesUpAStreamThatIsSilentThoughQtmMeasures) {
  TrackerBench bench;
  ASSERT_TRUE(bench.connect().ok());
  bench.qtm->push_frame(bench.frame(1));
  bench.expect(1);
  const auto begin = transport::now();
  const auto status = bench.service_until_it_fails();
  const auto took = transport::now() - begin;
  ASSERT_FALSE(status.ok());
  EXPECT_TRUE(has(status.error().detail.view(), "has sent no frame for 3 s")) << status.error().detail.view();
  EXPECT_GE(took, std::chrono::milliseconds(2900));
  EXPECT_LT(took, std::chrono::seconds(6));
  tell_fault("stream silent while QTM measures", took, status.error().detail.view(), "session ends; connects again");
  MarkerFrame frame;
  EXPECT_EQ(bench.next(frame), IoStatus::kDisconnected);
  EXPECT_TRUE(bench.connect().ok());
}

TEST(TrackerStream, GivesUpAMeasurementWhoseFramesRepeatThemselves) {
  TrackerBench bench;
  ASSERT_TRUE(bench.connect().ok());
  bench.qtm->push_frame(bench.frame(1));
  bench.expect(1);
  const auto begin = transport::now();
  Status status;
  MarkerFrame frame;
  while (status && transport::now() - begin < std::chrono::seconds(10)) {
    bench.qtm->push_frame(bench.frame(1));
    ASSERT_EQ(bench.tracker->read(frame), IoStatus::kEmpty) << "an old frame is not a measurement";
    status = bench.tracker->service();
  }
  ASSERT_FALSE(status.ok());
  EXPECT_GT(bench.tracker->counters().useless, 0U);
  tell_fault("frozen time stamp", transport::now() - begin, status.error().detail.view(),
             "no frame meanwhile: the arm holds; session ends; connects again");
}

TEST(TrackerStream, GivesUpAStreamThatNeverCatchesUp) {
  TrackerBench bench;
  ASSERT_TRUE(bench.connect().ok());
  const auto begin = transport::now();
  MarkerFrame frame;
  IoStatus status = IoStatus::kDone;
  for (std::uint64_t k = 1; status == IoStatus::kDone && transport::now() - begin < std::chrono::seconds(10); ++k) {
    bench.qtm->push_frame(bench.frame(k, 1));  // QTM's time hardly moves: each frame is older than the one before
    status = bench.next(frame);
  }
  EXPECT_EQ(status, IoStatus::kDisconnected);
  EXPECT_TRUE(has(bench.tracker->reason(), "more than 1 s late")) << bench.tracker->reason();
  tell_fault("frames come ever later", transport::now() - begin, bench.tracker->reason(),
             "frames are late and so refused by the freshness check meanwhile; connects again");
}

TEST(TrackerStream, GivesUpAPeerThatNoLongerAnswers) {
  QualisysConfig config;
  config.reply_timeout = std::chrono::milliseconds(300);
  TrackerBench bench(3, {}, config);
  ASSERT_TRUE(bench.connect().ok());
  bench.qtm->change([](FakeQtmSettings& now) { now.answers = false; });
  const auto begin = transport::now();
  const auto status = bench.service_until_it_fails();
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, Errc::kTimeout);
  tell_fault("half-open: QTM takes commands and says nothing", transport::now() - begin, status.error().detail.view(),
             "session ends (reply time-out, 2 s unless set); connects again");
  MarkerFrame frame;
  EXPECT_EQ(bench.next(frame), IoStatus::kDisconnected);
}

/// A port where nobody ever answers: its queue of connections is full, so that the kernel drops further requests, as if
/// the host were off.
class DeadPort {
 public:
  DeadPort() : listener_(transport::tcp_listen("127.0.0.1", 0).value()) {
    ::listen(listener_.get(), 0);
    for (int i = 0; i < 4; ++i) {
      auto filler = transport::tcp_connect("127.0.0.1", port(), transport::now() + std::chrono::milliseconds(100));
      if (filler) fillers_.push_back(std::move(*filler));
    }
  }
  [[nodiscard]] std::uint16_t port() const { return transport::local_port(listener_.get()); }

 private:
  transport::UniqueFd listener_;
  std::vector<transport::UniqueFd> fillers_;
};

TEST(TrackerStream, GivesUpADeadHostInBoundedTime) {
  const DeadPort dead;
  QualisysConfig config;
  config.port = dead.port();
  QualisysTracker tracker(config, {"a"});
  const auto begin = transport::now();
  const auto info = tracker.connect();
  const auto took = transport::now() - begin;
  ASSERT_FALSE(info.ok());
  EXPECT_EQ(info.error().code, Errc::kTimeout) << info.error().detail.view();
  EXPECT_GE(took, std::chrono::milliseconds(1900));
  EXPECT_LT(took, std::chrono::seconds(4));
  tell_fault("host is dead", took, info.error().detail.view(), "connects again, with back-off");
}

TEST(TrackerStream, GivesUpWhatIsNoPacket) {
  for (const std::uint32_t size : {0U, 7U, (16U << 20) + 1, 0xffffffffU}) {
    TrackerBench bench;
    ASSERT_TRUE(bench.connect().ok());
    Bytes bytes;
    append(bytes, size, ByteOrder::kLittle);
    append(bytes, 3U, ByteOrder::kLittle);
    bench.qtm->push(bytes);
    MarkerFrame frame;
    EXPECT_EQ(bench.next(frame), IoStatus::kDisconnected) << size;
    EXPECT_FALSE(bench.tracker->reason().empty());
  }
}

TEST(TrackerUdp, AsksForDatagramsAtItsPortAndReadsThem) {
  TrackerBench bench(64, with_hand(), over_udp());
  ASSERT_TRUE(bench.connect().ok());
  EXPECT_TRUE(bench.qtm->commands().back().starts_with("StreamFrames AllFrames UDP:")) << bench.qtm->commands().back();
  for (std::uint64_t k = 1; k <= 1000; k += 20) {  // the kernel's buffer holds more than 20
    for (std::uint64_t i = k; i < k + 20; ++i) bench.qtm->push_frame(bench.frame(i, 1000));
    for (std::uint64_t i = k; i < k + 20; ++i) bench.expect(i);
  }
  EXPECT_TRUE(bench.tracker->service().ok());
  EXPECT_EQ(bench.tracker->counters().frames, 1000U);
}

TEST(TrackerUdp, MergesSplitFramesAndDropsShuffledAndRepeatedDatagrams) {
  auto config = over_udp();
  config.rigid_body = "hand";
  TrackerBench bench(3, with_hand(), config);
  ASSERT_TRUE(bench.connect().ok());
  const auto part = [&](std::uint64_t k, std::size_t which) {
    auto wire = bench.frame(k);
    wire.parts = {wire.parts[which]};
    return wire;
  };
  bench.qtm->push_frame(part(1, 0));
  bench.qtm->push_frame(part(1, 1));
  bench.expect(1);
  bench.qtm->push_frame(part(2, 1));
  bench.qtm->push_frame(part(2, 0));
  bench.expect(2);
  bench.qtm->push_frame(bench.frame(4));
  bench.qtm->push_frame(bench.frame(3));  // overtaken
  bench.qtm->push_frame(bench.frame(4));  // twice
  bench.qtm->push_frame(part(5, 0));      // its body is lost
  bench.qtm->push_frame(bench.frame(6));
  bench.expect(4);
  bench.expect(6);
  const auto counters = bench.tracker->counters();
  EXPECT_EQ(counters.useless, 2U);
  EXPECT_EQ(counters.incomplete, 1U);
}

TEST(TrackerUdp, TakesNothingFromOtherHostsNorWhatIsNoPacket) {
  TrackerBench bench(3, {}, over_udp());
  ASSERT_TRUE(bench.connect().ok());
  bench.qtm->push_datagram(test::wire_data(bench.frame(1), ByteOrder::kLittle), "127.0.0.2");
  bench.qtm->push_datagram({});
  bench.qtm->push_datagram(Bytes(7));
  bench.qtm->push_datagram(Bytes(200));
  auto lying = test::wire_data(bench.frame(2), ByteOrder::kLittle);
  lying[32] = std::byte{0xFF};  // count of markers
  bench.qtm->push_datagram(lying);
  bench.qtm->push_frame(bench.frame(3));
  bench.expect(3);
  const auto counters = bench.tracker->counters();
  EXPECT_EQ(counters.foreign, 1U);
  EXPECT_EQ(counters.malformed, 4U);
}

TEST(TrackerUdp, TakesEventsAndTheEndFromTheConnection) {
  TrackerBench bench(3, {}, over_udp());
  ASSERT_TRUE(bench.connect().ok());
  bench.qtm->push_frame(bench.frame(1));
  bench.expect(1);
  bench.qtm->push(test::wire_no_more_data(ByteOrder::kLittle));
  bench.qtm->push_datagram(test::wire_no_more_data(ByteOrder::kLittle));
  bench.qtm->push(test::wire_event(12, ByteOrder::kLittle));
  MarkerFrame frame;
  EXPECT_EQ(bench.next(frame), IoStatus::kDisconnected);
  EXPECT_TRUE(has(bench.tracker->reason(), "shutting down"));
  ASSERT_TRUE(bench.connect().ok());
  bench.qtm.reset();
  EXPECT_EQ(bench.next(frame), IoStatus::kDisconnected);
}

TEST(TrackerUdp, SaysThatNoDatagramComesWithinASecond) {
  TrackerBench bench(3, {}, over_udp());
  ASSERT_TRUE(bench.connect().ok());
  const auto begin = transport::now();
  const auto status = bench.service_until_it_fails();
  const auto took = transport::now() - begin;
  ASSERT_FALSE(status.ok());
  EXPECT_TRUE(has(status.error().detail.view(), "no datagram of QTM came to UDP 127.0.0.1:"))
      << status.error().detail.view();
  EXPECT_LT(took, std::chrono::seconds(4));
  tell_fault("firewall swallows the datagrams", took, status.error().detail.view(), "operator: firewall, or TCP");
}

TEST(TrackerUdp, BindsOnlyToOneInterface) {
  for (const char* address : {"0.0.0.0", "localhost", "203.0.113.7", "::1"}) {
    auto config = over_udp();
    config.udp_address = address;
    TrackerBench bench(3, {}, config);
    const auto info = bench.tracker->connect();
    ASSERT_FALSE(info.ok()) << address;
    EXPECT_FALSE(info.error().detail.empty());
  }
  auto config = over_udp();
  config.udp_address = "127.0.0.3";  // another one of ours than the connection's
  TrackerBench bench(3, {}, config);
  ASSERT_TRUE(bench.connect().ok());
  EXPECT_TRUE(has(bench.qtm->commands().back(), "UDP:127.0.0.3:")) << bench.qtm->commands().back();
}

}  // namespace
}  // namespace embody::qualisys
