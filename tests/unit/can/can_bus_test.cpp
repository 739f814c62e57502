#include "drivers/transport/can.hpp"

#include <gtest/gtest.h>
#include <linux/can.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstring>
#include <fstream>

#include "drivers/transport/can_double.hpp"
#include "drivers/transport/can_isotp.hpp"
#include "drivers/transport/clock.hpp"
#include "tests/support/heap_counter.hpp"

namespace embody::transport {
namespace {

const CanId kWanted{0x123, false};
const CanId kLong{0x1abcdef0, true};

struct Pair {
  Pair() {
    auto ends = double_pair();
    EXPECT_TRUE(ends.ok());
    near.emplace(std::move((*ends)[0]), "can7", std::vector<CanId>{kWanted, kLong});
    far = std::move((*ends)[1]);
  }
  void put(std::uint32_t raw_id, std::uint8_t size = 8) const {
    can_frame raw{};
    raw.can_id = raw_id;
    raw.can_dlc = size;
    ASSERT_EQ(::send(far.get(), &raw, sizeof raw, 0), static_cast<ssize_t>(sizeof raw));
  }
  std::optional<CanBus> near;
  UniqueFd far;
};

TEST(CanBus, CarriesEveryLengthAndBothKindsOfIdentifierBothWays) {
  auto ends = double_pair();
  ASSERT_TRUE(ends.ok());
  CanBus a(std::move((*ends)[0]), "a", {kWanted, kLong}), b(std::move((*ends)[1]), "b", {kWanted, kLong});
  for (const CanId id : {kWanted, kLong}) {
    for (std::uint8_t size = 0; size <= 8; ++size) {
      CanFrame sent{id, size, {1, 2, 3, 4, 5, 6, 7, 8}, {}};
      for (auto [from, to] : {std::pair{&a, &b}, std::pair{&b, &a}}) {
        const TimePoint before = now();
        ASSERT_EQ(from->send(sent), IoStatus::kDone);
        CanFrame got;
        ASSERT_EQ(to->receive(got), IoStatus::kDone);
        EXPECT_EQ(got.id, id);
        ASSERT_EQ(got.size, size);
        EXPECT_TRUE(std::equal(got.bytes().begin(), got.bytes().end(), sent.data.begin()));
        EXPECT_GE(got.t_arrival, before);
        EXPECT_LE(got.t_arrival, now());
      }
    }
  }
  CanFrame none;
  EXPECT_EQ(a.receive(none), IoStatus::kEmpty);
}

TEST(CanBus, HandsOverNothingButTheWantedDataFrames) {
  Pair bus;
  bus.put(0x124);                         // another identifier
  bus.put(kWanted.value | CAN_EFF_FLAG);  // the same number with 29 bits
  bus.put(kWanted.value | CAN_RTR_FLAG);  // a request for data
  bus.put(kWanted.value, 9);              // longer than a frame can be
  ASSERT_EQ(::send(bus.far.get(), "short", 5, 0), 5);
  std::array<char, 72> long_frame{};  // as CAN FD has them
  ASSERT_EQ(::send(bus.far.get(), long_frame.data(), long_frame.size(), 0), 72);
  bus.put(kLong.value | CAN_EFF_FLAG);
  CanFrame frame;
  ASSERT_EQ(bus.near->receive(frame), IoStatus::kDone);
  EXPECT_EQ(frame.id, kLong);
  EXPECT_EQ(bus.near->receive(frame), IoStatus::kEmpty);
  EXPECT_EQ(bus.near->counters().ignored, 6u);
  EXPECT_EQ(bus.near->counters().received, 1u);
}

TEST(CanBus, CountsWhatTheControllerReportsAndGoesOn) {
  Pair bus;
  CanErrors errors;
  errors.error_passive = errors.error_warning = errors.no_ack = errors.arbitration_lost = errors.protocol =
      errors.overflow = errors.restarted = true;
  ASSERT_EQ(send_can_errors(bus.far.get(), errors), IoStatus::kDone);
  bus.put(kWanted.value);
  CanFrame frame;
  ASSERT_EQ(bus.near->receive(frame), IoStatus::kDone);
  const CanCounters& counters = bus.near->counters();
  for (const std::uint64_t count :
       {counters.error_frames, counters.error_warnings, counters.error_passives, counters.no_acks,
        counters.arbitrations_lost, counters.protocol_errors, counters.overflows, counters.restarts}) {
    EXPECT_EQ(count, 1u);
  }
}

TEST(CanBus, BusOffEndsItForGoodWithASentence) {
  Pair bus;
  CanErrors errors;
  errors.bus_off = true;
  ASSERT_EQ(send_can_errors(bus.far.get(), errors), IoStatus::kDone);
  bus.put(kWanted.value);
  CanFrame frame;
  EXPECT_EQ(bus.near->receive(frame), IoStatus::kDisconnected);
  EXPECT_EQ(bus.near->receive(frame), IoStatus::kDisconnected) << "also when frames follow";
  EXPECT_EQ(bus.near->send(frame), IoStatus::kDisconnected);
  EXPECT_NE(bus.near->reason().find("can7"), std::string_view::npos);
  EXPECT_NE(bus.near->reason().find("bus-off"), std::string_view::npos) << bus.near->reason();
}

TEST(CanBus, APeerThatHasGoneEndsItForReaderAndWriter) {
  for (const bool writes : {false, true}) {
    Pair bus;
    bus.far.reset();
    CanFrame frame{kWanted, 0, {}, {}};
    EXPECT_EQ(writes ? bus.near->send(frame) : bus.near->receive(frame), IoStatus::kDisconnected);
    EXPECT_FALSE(bus.near->reason().empty());
  }
}

TEST(CanBus, AFullQueueIsNoEndAndNothingOfItIsLost) {
  Pair bus;
  CanFrame frame{kWanted, 8, {}, {}};
  std::uint64_t sent = 0;
  while (bus.near->send(frame) == IoStatus::kDone && sent < 100'000) ++sent;
  ASSERT_LT(sent, 100'000u);
  EXPECT_EQ(bus.near->send(frame), IoStatus::kEmpty);
  EXPECT_EQ(bus.near->counters().queue_full, 2u);
  EXPECT_TRUE(bus.near->reason().empty());
  can_frame raw;
  std::uint64_t received = 0;
  while (::recv(bus.far.get(), &raw, sizeof raw, MSG_DONTWAIT) > 0) ++received;
  EXPECT_EQ(received, sent);
  EXPECT_EQ(bus.near->send(frame), IoStatus::kDone);
}

TEST(CanBus, NeitherSendNorReceiveAllocates) {
  Pair bus;
  if (!test::counts_heap()) GTEST_SKIP() << "a sanitizer owns malloc";
  for (int i = 0; i < 20; ++i) bus.put(kWanted.value);
  const std::uint64_t before = test::heap_allocations();
  CanFrame frame;
  while (bus.near->receive(frame) == IoStatus::kDone) static_cast<void>(bus.near->send(frame));
  bus.far.reset();
  static_cast<void>(bus.near->receive(frame));
  EXPECT_EQ(test::heap_allocations(), before);
}

TEST(OpenCan, SaysWhatIsWrongWithFiltersAndNames) {
  const auto code = [](const CanConfig& config) {
    const auto bus = open_can(config);
    EXPECT_FALSE(bus.ok());
    EXPECT_FALSE(bus.error().detail.empty());
    return bus.error().code;
  };
  EXPECT_EQ(code({"can0", {}}), Errc::kInvalidArgument);
  EXPECT_EQ(code({"can0", std::vector<CanId>(kMaxCanFilters + 1)}), Errc::kInvalidArgument);
  EXPECT_EQ(code({"can0", {{0x800, false}}}), Errc::kInvalidArgument);
  EXPECT_EQ(code({"can0", {{0x20000000, true}}}), Errc::kInvalidArgument);
  EXPECT_EQ(code({"unix:", {kWanted}}), Errc::kInvalidArgument);
  EXPECT_EQ(code({"unix:" + std::string(200, 'x'), {kWanted}}), Errc::kInvalidArgument);
  EXPECT_EQ(code({"unix:/nowhere/at/all", {kWanted}}), Errc::kDisconnected);
}

TEST(OpenCan, TellsInterfacesThatAreNoCanFromMissingOnes) {
  EXPECT_EQ(find_can_interface("lo").error().code, Errc::kInvalidArgument);
  EXPECT_NE(find_can_interface("lo").error().detail.view().find("not a CAN"), std::string_view::npos);
  EXPECT_EQ(find_can_interface("can_not_there").error().code, Errc::kNotFound);
  EXPECT_EQ(find_can_interface("sixteen_bytes_xx").error().code, Errc::kInvalidArgument);
  EXPECT_EQ(find_can_interface("").error().code, Errc::kInvalidArgument);
  // What a kernel without CAN says, and one with it.
  const auto bus = open_can({"can_not_there", {kWanted}});
  ASSERT_FALSE(bus.ok());
  EXPECT_TRUE(bus.error().code == Errc::kUnsupported || bus.error().code == Errc::kNotFound);
  const auto isotp = open_isotp({"can_not_there", {1, false}, {2, false}});
  ASSERT_FALSE(isotp.ok());
  EXPECT_TRUE(isotp.error().code == Errc::kUnsupported || isotp.error().code == Errc::kNotFound);
}

TEST(CanDouble, TakesTheAddressOfADeadListenerButNotOfALivingOneOrAFile) {
  const std::string path = ::testing::TempDir() + "embody_can_" + std::to_string(::getpid());
  {
    auto first = double_listen(path);
    ASSERT_TRUE(first.ok()) << first.error().detail.view();
    EXPECT_EQ(double_listen(path).error().code, Errc::kRefused);
  }
  EXPECT_TRUE(double_listen(path).ok()) << "the socket that the dead one left";
  ::unlink(path.c_str());
  std::ofstream(path) << "precious";
  EXPECT_EQ(double_listen(path).error().code, Errc::kRefused);
  ::unlink(path.c_str());
}

TEST(IsoTp, RefusesIdentifiersThatCannotWork) {
  EXPECT_EQ(open_isotp({"unix:/x", {1, false}, {1, false}}).error().code, Errc::kInvalidArgument);
  EXPECT_EQ(open_isotp({"unix:/x", {0x800, false}, {1, false}}).error().code, Errc::kInvalidArgument);
}

TEST(IsoTp, WritesTheLeastTimeBetweenFramesAsTheStandardDoes) {
  using std::chrono::microseconds;
  EXPECT_EQ(encode_st_min(microseconds(0)), 0x00);
  EXPECT_EQ(encode_st_min(microseconds(1)), 0xF1);
  EXPECT_EQ(encode_st_min(microseconds(100)), 0xF1);
  EXPECT_EQ(encode_st_min(microseconds(900)), 0xF9);
  EXPECT_EQ(encode_st_min(microseconds(901)), 0x01);
  EXPECT_EQ(encode_st_min(microseconds(1001)), 0x02);
  EXPECT_EQ(encode_st_min(microseconds(127'000)), 0x7F);
  EXPECT_EQ(encode_st_min(std::chrono::seconds(9)), 0x7F);
  EXPECT_EQ(encode_st_min(-microseconds(5)), 0x00);
}

}  // namespace
}  // namespace embody::transport
