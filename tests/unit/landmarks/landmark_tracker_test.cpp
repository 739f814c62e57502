#include "drivers/landmarks/landmark_tracker.hpp"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <ifaddrs.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <cstdio>
#include <cstring>
#include <fstream>
#include <sstream>

#include "drivers/transport/clock.hpp"
#include "drivers/transport/tcp.hpp"
#include "tests/support/heap_counter.hpp"

namespace embody::landmarks {
namespace {

using transport::now;

LandmarkFrame frame_number(std::uint64_t number, std::int64_t t_capture_ns = 0) {
  LandmarkFrame frame;
  frame.frame_number = number;
  frame.t_capture_ns = t_capture_ns;
  for (std::size_t i = 0; i < kLandmarkCount; ++i) {
    const auto x = 0.01F * static_cast<float>(i);
    frame.landmarks[i] = {{x, -x, 0.5F}, 0.8F};
  }
  return frame;
}

/// A tracker on a free port of the loopback and a socket that sends to it.
class Bench {
 public:
  explicit Bench(Side side = Side::kRight) : tracker({"127.0.0.1", 0, 30.0, side}) {
    info = tracker.connect();
    auto sender = transport::udp_connect("127.0.0.1", tracker.port());
    EXPECT_TRUE(info.ok() && sender.ok());
    if (sender) out = std::move(*sender);
  }
  void send(std::span<const std::byte> bytes) {
    ASSERT_EQ(transport::send_message(out.get(), bytes), IoStatus::kDone);
    ++sent;
  }
  void send(const LandmarkFrame& frame) { send(encode(frame)); }
  /// Not all that was sent has been read; waits until there is something to read.
  bool more() {
    return tracker.counters().received < sent && transport::wait_readable(info->fd, now() + std::chrono::seconds(5));
  }
  /// The frames among all that was sent.
  std::vector<MarkerFrame> drain() {
    std::vector<MarkerFrame> frames;
    while (more()) {
      MarkerFrame frame;
      while (tracker.read(frame) == IoStatus::kDone) frames.push_back(frame);
    }
    return frames;
  }

  std::uint64_t sent{0};
  LandmarkTracker tracker;
  Result<TrackerInfo> info{make_error(Errc::kIo, "not connected")};
  transport::UniqueFd out;
};

TEST(LandmarkTracker, GivesTheLandmarksInTheirSlots) {
  Bench bench;
  EXPECT_EQ(bench.info->rate_hz, 30.0);
  EXPECT_FALSE(bench.info->playback);
  LandmarkFrame sent = frame_number(5);
  sent.landmarks[3].confidence = 0.0F;
  const TimePoint before = now();
  bench.send(sent);
  const auto frames = bench.drain();
  ASSERT_EQ(frames.size(), 1U);
  const MarkerFrame& frame = frames[0];
  EXPECT_EQ(frame.frame_number, 5U);
  EXPECT_EQ(frame.count, kLandmarkCount);
  EXPECT_GE(frame.t_arrival, before);
  EXPECT_EQ(frame.t_capture, frame.t_arrival) << "the sender tells no time";
  for (std::size_t i = 0; i < kLandmarkCount; ++i) {
    EXPECT_EQ(frame.markers[i].visible, i != 3) << i;
    EXPECT_EQ(frame.markers[i].confidence, i == 3 ? 0.0F : 0.8F) << i;
    EXPECT_EQ(frame.markers[i].p_W.x(), static_cast<double>(sent.landmarks[i].p_W[0])) << i;
  }
}

TEST(LandmarkTracker, CountsAndDropsWhatIsMalformedAndGoesOn) {
  Bench bench;
  auto bad = encode(frame_number(1));
  bad[0] = std::byte{0};
  bench.send(bad);
  bench.send(std::span(bad).first(0));
  bench.send(std::span(bad).first(100));
  std::array<std::byte, 2000> large{};
  const auto good = encode(frame_number(2));
  std::copy(good.begin(), good.end(), large.begin());
  bench.send(large);  // a valid datagram with a tail
  bench.send(good);
  const auto frames = bench.drain();
  ASSERT_EQ(frames.size(), 1U);
  EXPECT_EQ(frames[0].frame_number, 2U);
  const LandmarkCounters counters = bench.tracker.counters();
  EXPECT_EQ(counters.received, 5U);
  EXPECT_EQ(counters.malformed, 4U);
  EXPECT_TRUE(bench.tracker.service().ok());
  EXPECT_TRUE(bench.tracker.reason().empty());
}

TEST(LandmarkTracker, BoundsTheWorkOfOneReadAndLosesNothingByIt) {
  Bench bench;
  const std::array<std::byte, 8> junk{};
  for (int i = 0; i < 20; ++i) bench.send(junk);
  bench.send(frame_number(1));
  std::uint64_t before = 0;
  int frames = 0;
  while (bench.more()) {
    MarkerFrame frame;
    frames += bench.tracker.read(frame) == IoStatus::kDone ? 1 : 0;
    EXPECT_LE(bench.tracker.counters().received - before, 16U);
    before = bench.tracker.counters().received;
  }
  EXPECT_EQ(frames, 1);
  EXPECT_EQ(bench.tracker.counters().malformed, 20U);
}

TEST(LandmarkTracker, DropsDuplicatesAndTakesARestartedSender) {
  Bench bench;
  for (const std::uint64_t number : {100, 100, 101, 103, 103, 1, 1, 2}) bench.send(frame_number(number));
  std::vector<std::uint64_t> numbers;
  for (const MarkerFrame& frame : bench.drain()) numbers.push_back(frame.frame_number);
  EXPECT_EQ(numbers, (std::vector<std::uint64_t>{100, 101, 103, 1, 2}));
  EXPECT_EQ(bench.tracker.counters().duplicates, 3U);
  EXPECT_EQ(bench.tracker.counters().restarts, 1U);
}

TEST(LandmarkTracker, UsesOneHandOnly) {
  Bench bench(Side::kLeft);
  LandmarkFrame left = frame_number(1);
  left.side = Side::kLeft;
  bench.send(frame_number(1));
  bench.send(left);
  EXPECT_EQ(bench.drain().size(), 1U);
  EXPECT_EQ(bench.tracker.counters().other_hand, 1U);
  EXPECT_EQ(bench.tracker.counters().duplicates, 0U) << "each hand has its own numbers";
}

TEST(LandmarkTracker, MapsTheSendersTimesNeverIntoTheFuture) {
  Bench bench;
  const std::int64_t t0_ns = 1'700'000'000'000'000'000;
  const std::int64_t period_ns = 33'333'333;
  std::vector<MarkerFrame> frames;
  for (int k = 0; k < 20; ++k) {
    bench.send(frame_number(static_cast<std::uint64_t>(k + 1), t0_ns + k * period_ns));
    for (const MarkerFrame& frame : bench.drain()) frames.push_back(frame);
  }
  ASSERT_EQ(frames.size(), 20U);
  for (std::size_t k = 1; k < frames.size(); ++k) {
    EXPECT_LE(frames[k].t_capture, frames[k].t_arrival);
  }
}

TEST(LandmarkTracker, BearsAnyTimeThatASenderMayClaim) {
  Bench bench;
  std::uint64_t number = 0;
  for (const std::int64_t t_ns : {std::int64_t{1}, std::numeric_limits<std::int64_t>::max(), std::int64_t{1},
                                  std::numeric_limits<std::int64_t>::max() - 1, std::int64_t{0}}) {
    bench.send(frame_number(++number, t_ns));
  }
  const auto frames = bench.drain();
  ASSERT_EQ(frames.size(), 5U);
  for (const MarkerFrame& frame : frames) EXPECT_LE(frame.t_capture, frame.t_arrival);
}

TEST(LandmarkTracker, StartsAfreshOnConnect) {
  Bench bench;
  bench.send(frame_number(9));
  EXPECT_EQ(bench.drain().size(), 1U);
  bench.info = bench.tracker.connect();
  ASSERT_TRUE(bench.info.ok());
  auto sender = transport::udp_connect("127.0.0.1", bench.tracker.port());
  ASSERT_TRUE(sender.ok());
  bench.out = std::move(*sender);
  bench.send(frame_number(9));
  EXPECT_EQ(bench.drain().size(), 1U);
  EXPECT_EQ(bench.tracker.counters().duplicates, 0U);
  EXPECT_EQ(bench.tracker.counters().restarts, 0U);
}

TEST(LandmarkTracker, SaysWhyItCannotListen) {
  Bench bench;
  LandmarkTracker second({"127.0.0.1", bench.tracker.port(), 30.0, Side::kRight});
  const auto taken = second.connect();
  ASSERT_FALSE(taken.ok());
  EXPECT_NE(taken.error().detail.view().find("in use"), std::string_view::npos) << taken.error().detail.view();
  EXPECT_FALSE(second.service().ok());
  MarkerFrame frame;
  EXPECT_EQ(second.read(frame), IoStatus::kDisconnected);
  for (const auto& [address, code] : {std::pair{"0.0.0.0", Errc::kInvalidArgument},
                                      {"localhost", Errc::kInvalidArgument},
                                      {"192.0.2.77", Errc::kNotFound}}) {  // RFC 5737: nobody's address
    const auto refused = LandmarkTracker({address, 0, 30.0, Side::kRight}).connect();
    ASSERT_FALSE(refused.ok()) << address;
    EXPECT_EQ(refused.error().code, code) << refused.error().detail.view();
  }
}

/// An IPv4 address of this computer that is not on the loopback; empty without one.
std::string other_address() {
  ifaddrs* list = nullptr;
  if (::getifaddrs(&list) != 0) return {};
  std::string found;
  for (const ifaddrs* entry = list; entry != nullptr; entry = entry->ifa_next) {
    if (entry->ifa_addr == nullptr || entry->ifa_addr->sa_family != AF_INET) continue;
    char text[INET_ADDRSTRLEN] = {};
    ::inet_ntop(AF_INET, &reinterpret_cast<const sockaddr_in*>(entry->ifa_addr)->sin_addr, text, sizeof text);
    if (std::strncmp(text, "127.", 4) != 0) found = text;
  }
  ::freeifaddrs(list);
  return found;
}

TEST(LandmarkTracker, DropsDatagramsFromOutsideOfItsNetwork) {
  const std::string address = other_address();
  if (address.empty()) GTEST_SKIP() << "this computer has the loopback only";
  Bench bench;
  auto from = transport::udp_bind(address, 0, 4096);
  ASSERT_TRUE(from.ok()) << from.error().detail.view();
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(bench.tracker.port());
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const auto bytes = encode(frame_number(1));
  if (::sendto(from->get(), bytes.data(), bytes.size(), 0, reinterpret_cast<const sockaddr*>(&to), sizeof to) < 0) {
    GTEST_SKIP() << "this computer does not route " << address << " to the loopback";
  }
  ++bench.sent;
  EXPECT_TRUE(bench.drain().empty());
  EXPECT_EQ(bench.tracker.counters().foreign, 1U);
}

TEST(Network, ContainsItsHostsOnly) {
  const auto loopback = transport::network_of("127.0.0.1");
  ASSERT_TRUE(loopback.ok());
  EXPECT_TRUE(loopback->contains(0x7f000001));
  EXPECT_TRUE(loopback->contains(0x7fffffff));
  EXPECT_FALSE(loopback->contains(0x80000001));
  EXPECT_FALSE(loopback->contains(0));
  EXPECT_TRUE((transport::Network{0xc0a80105, 0xffffff00}).contains(0xc0a801fe));
  EXPECT_FALSE((transport::Network{0xc0a80105, 0xffffff00}).contains(0xc0a80201));
}

TEST(LandmarkTracker, ReadsWithoutHeap) {
  if (!test::counts_heap()) GTEST_SKIP() << "the sanitizer owns the heap";
  Bench bench;
  for (std::uint64_t k = 0; k < 20; ++k) bench.send(frame_number(k / 2, 1000));
  const std::array<std::byte, 3> junk{};
  bench.send(junk);
  MarkerFrame frame;
  const std::uint64_t before = test::heap_allocations();
  int frames = 0;
  while (bench.more()) {
    while (bench.tracker.read(frame) == IoStatus::kDone) ++frames;
  }
  EXPECT_EQ(test::heap_allocations(), before);
  EXPECT_EQ(frames, 10);
}

/// The first Python block of docs/landmarks.md.
std::string documented_sender() {
  std::ifstream page(EMBODY_SOURCE_DIR "/docs/landmarks.md");
  std::stringstream text;
  text << page.rdbuf();
  const std::string content = text.str();
  const std::size_t begin = content.find("```python\n");
  const std::size_t end = content.find("```\n", begin + 10);
  return begin == std::string::npos || end == std::string::npos ? "" : content.substr(begin + 10, end - begin - 10);
}

TEST(LandmarkTracker, UnderstandsTheSenderOfTheDocumentation) {
  if (std::system("python3 -c 'import struct' 2>/dev/null") != 0) GTEST_SKIP() << "there is no python3";
  const std::string sender = documented_sender();
  ASSERT_FALSE(sender.empty());
  Bench bench;
  FILE* python = ::popen("python3 -", "w");
  ASSERT_NE(python, nullptr);
  std::fputs(sender.c_str(), python);
  std::fprintf(python, "PORT = %u\n", unsigned{bench.tracker.port()});
  std::fputs("for n in range(1, 4):\n    send(n, [(0.01 * i, 0.2, -0.3) for i in range(21)], [0.5] * 21)\n", python);
  ASSERT_EQ(::pclose(python), 0);
  bench.sent = 3;
  const auto frames = bench.drain();
  ASSERT_EQ(frames.size(), 3U) << bench.tracker.counters().malformed << " malformed";
  EXPECT_EQ(frames[2].frame_number, 3U);
  EXPECT_FLOAT_EQ(static_cast<float>(frames[2].markers[20].p_W.x()), 0.2F);
  EXPECT_EQ(frames[2].markers[20].confidence, 0.5F);
}

}  // namespace
}  // namespace embody::landmarks
