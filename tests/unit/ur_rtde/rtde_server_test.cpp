#include "drivers/sim/ur/rtde_server.hpp"

#include <gtest/gtest.h>
#include <sys/socket.h>

#include <random>
#include <thread>

#include "drivers/sim/ur/ur_controller.hpp"
#include "tests/unit/ur_rtde/raw_client.hpp"

namespace embody::sim {
namespace {

using test::hex;
using test::RawClient;

class SimulatedController : public testing::Test {
 protected:
  SimulatedController() {
    const Status started = controller_.start();
    EXPECT_TRUE(started.ok()) << started.error().detail.c_str();
  }
  RawClient client() { return RawClient(controller_.port()); }
  RawClient client_v2() {
    RawClient raw(controller_.port());
    EXPECT_EQ(raw.ask(hex("00 05 56 00 02")), hex("00 04 56 01"));
    return raw;
  }
  /// Waits for something that the control thread does; false after five seconds.
  template <class Condition>
  static bool eventually(Condition condition) {
    const TimePoint deadline = transport::now() + std::chrono::seconds(5);
    while (transport::now() < deadline) {
      if (condition()) return true;
      std::this_thread::yield();
    }
    return false;
  }
  UrController controller_{UrControllerConfig{}};
};

const auto kOutputs = rtde::encode_outputs_request(500.0, "timestamp,actual_q");
const auto kInputs = rtde::encode_inputs_request("input_int_register_24,input_double_register_24");
const auto kStart = rtde::encode_request(rtde::PackageType::kStart);
const auto kPause = rtde::encode_request(rtde::PackageType::kPause);

TEST_F(SimulatedController, AnswersTheGoldenSetUpByteForByte) {
  RawClient raw = client();
  EXPECT_EQ(raw.ask(hex("00 05 56 00 02")), hex("00 04 56 01"));
  const auto version = raw.ask(hex("00 03 76"));
  ASSERT_TRUE(version);
  EXPECT_EQ(version->size(), 19U);
  EXPECT_EQ(raw.ask(hex("00 1d 4f 407f400000000000 'timestamp,actual_q'")), hex("00 13 4f 01 'DOUBLE,VECTOR6D'"));
  EXPECT_EQ(raw.ask(hex("00 31 49 'input_int_register_24,input_double_register_24'")),
            hex("00 10 49 01 'INT32,DOUBLE'"));
  EXPECT_EQ(raw.ask(hex("00 03 53")), hex("00 04 53 01"));
  const auto data = raw.receive('U');
  ASSERT_TRUE(data);
  EXPECT_EQ(data->size(), 60U);
  EXPECT_EQ(raw.ask(hex("00 03 50")), hex("00 04 50 01"));
}

TEST_F(SimulatedController, UnderstandsTheGoldenSetUpHoweverItIsCut) {
  using test::operator+;
  const auto session = hex("00 05 56 00 02") + kOutputs + kInputs + kStart;
  for (std::size_t cut = 1; cut < session.size(); ++cut) {
    RawClient raw = client();
    raw.send({session.begin(), session.begin() + static_cast<std::ptrdiff_t>(cut)});
    raw.send({session.begin() + static_cast<std::ptrdiff_t>(cut), session.end()});
    ASSERT_EQ(raw.receive('S'), hex("00 04 53 01")) << "cut at " << cut;
    raw.close();
    ASSERT_TRUE(eventually([&] { return client_v2().ask(kInputs) == hex("00 10 49 01 'INT32,DOUBLE'"); }));
  }
}

TEST_F(SimulatedController, SpeaksVersionOneWithoutRecipeIds) {
  RawClient raw = client();
  EXPECT_EQ(raw.ask(hex("00 05 56 00 01")), hex("00 04 56 01"));
  EXPECT_EQ(raw.ask(rtde::encode_outputs_request_v1("timestamp,actual_q")), hex("00 12 4f 'DOUBLE,VECTOR6D'"));
  EXPECT_EQ(raw.ask(kStart), hex("00 04 53 01"));
  const auto data = raw.receive('U');
  ASSERT_TRUE(data);
  EXPECT_EQ(data->size(), 59U);
  EXPECT_EQ(client().ask(hex("00 05 56 00 03")), hex("00 04 56 00"));
}

TEST_F(SimulatedController, RefusesUnknownVariablesAndToStartWithoutOutputs) {
  RawClient raw = client_v2();
  EXPECT_EQ(raw.ask(kStart), hex("00 04 53 00"));
  EXPECT_EQ(raw.ask(rtde::encode_outputs_request(500.0, "timestamp,nonsense")), hex("00 14 4f 00 'DOUBLE,NOT_FOUND'"));
  EXPECT_EQ(raw.ask(kStart), hex("00 04 53 00"));
  EXPECT_EQ(raw.ask(rtde::encode_inputs_request("actual_q")), hex("00 0d 49 00 'NOT_FOUND'"));
  EXPECT_EQ(raw.ask(rtde::encode_outputs_request(500.0, "speed_slider_mask")), hex("00 0d 4f 00 'NOT_FOUND'"));
}

TEST_F(SimulatedController, ToleratesATrailingComma) {
  RawClient raw = client_v2();
  EXPECT_EQ(raw.ask(rtde::encode_outputs_request(500.0, "timestamp,actual_q,")), hex("00 13 4f 01 'DOUBLE,VECTOR6D'"));
  EXPECT_EQ(raw.ask(rtde::encode_inputs_request("input_int_register_24,")), hex("00 09 49 01 'INT32'"));
}

TEST_F(SimulatedController, AnInputBelongsToOneClientUntilItLeaves) {
  RawClient owner = client_v2();
  RawClient other = client_v2();
  ASSERT_EQ(owner.ask(kInputs), hex("00 10 49 01 'INT32,DOUBLE'"));
  EXPECT_EQ(owner.ask(kInputs), hex("00 10 49 02 'INT32,DOUBLE'")) << "the owner may list it again";
  EXPECT_EQ(other.ask(kInputs), hex("00 11 49 00 'IN_USE,IN_USE'"));
  EXPECT_EQ(other.ask(rtde::encode_inputs_request("input_int_register_30")), hex("00 09 49 01 'INT32'"));
  owner.close();
  EXPECT_TRUE(eventually([&] { return other.ask(kInputs) == hex("00 10 49 02 'INT32,DOUBLE'"); }));
}

TEST_F(SimulatedController, RegistersKeepTheirValuesAfterTheClientLeft) {
  {
    RawClient writer = client_v2();
    ASSERT_EQ(writer.ask(kInputs), hex("00 10 49 01 'INT32,DOUBLE'"));
    writer.send(hex("00 10 55 01 00000007 bff8000000000000"));
    ASSERT_TRUE(eventually([&] { return controller_.counters().command_packages == 1; }));
  }
  RawClient reader = client_v2();
  ASSERT_TRUE(reader.ask(rtde::encode_outputs_request(500.0, "input_int_register_24,input_double_register_24")));
  ASSERT_TRUE(reader.ask(kStart));
  EXPECT_EQ(reader.receive('U'), hex("00 10 55 01 00000007 bff8000000000000"));
}

TEST_F(SimulatedController, AnswersBadPackagesWithATextAndKeepsTheConnection) {
  RawClient raw = client_v2();
  ASSERT_TRUE(raw.ask(kInputs));
  for (const char* bad : {"00 10 55 09 00000007 bff8000000000000", "00 08 55 01 00000007", "00 03 55", "00 03 7a",
                          "00 0b 4f 7ff8000000000000", "00 03 4d"}) {
    raw.send(hex(bad));
    const auto answer = raw.receive('M');
    ASSERT_TRUE(answer) << bad;
    const auto text = rtde::decode_text(rtde::Bytes(*answer).subspan(rtde::kHeaderSize));
    ASSERT_TRUE(text) << bad;
    EXPECT_EQ(text->level, static_cast<std::uint8_t>(rtde::TextLevel::kError));
  }
  EXPECT_EQ(controller_.counters().command_packages, 0U);
  EXPECT_EQ(raw.ask(kOutputs), hex("00 13 4f 01 'DOUBLE,VECTOR6D'"));
}

TEST_F(SimulatedController, SendsOnePackagePerWholeNumberOfCycles) {
  RawClient raw = client_v2();
  ASSERT_TRUE(raw.ask(rtde::encode_outputs_request(120.0, "timestamp")));  // floor(500 / 120) = 4 cycles
  ASSERT_TRUE(raw.ask(kStart));
  for (int i = 0; i < 20; ++i) {
    const auto data = raw.receive('U');
    ASSERT_TRUE(data);
    const double cycle = rtde::load<double>(*data, rtde::kFieldsStart) * 500.0;
    EXPECT_EQ(cycle, std::round(cycle)) << "time stamps lie on the control grid";
  }
  const auto a = raw.receive('U'), b = raw.receive('U');
  ASSERT_TRUE(a && b);
  EXPECT_GE(rtde::load<double>(*b, 4) - rtde::load<double>(*a, 4), 0.008 - 1e-9);
}

TEST_F(SimulatedController, ClosesAClientThatDoesNotRead) {
  RawClient raw = client_v2();
  const int bytes = 4096;
  ::setsockopt(raw.fd(), SOL_SOCKET, SO_RCVBUF, &bytes, sizeof bytes);
  std::string names;
  for (int i = 0; i < 300; ++i) names += "actual_q,";  // 14 kB per package fill the buffers sooner
  ASSERT_TRUE(raw.ask(rtde::encode_outputs_request(500.0, names)));
  raw.send(kStart);
  EXPECT_TRUE(eventually([&] { return controller_.counters().slow_clients_closed == 1; }));
}

TEST_F(SimulatedController, CountsGapsAndRepetitionsOfTheSequence) {
  RawClient raw = client_v2();
  ASSERT_TRUE(raw.ask(rtde::encode_inputs_request("input_int_register_24")));
  for (const char* package : {"00 08 55 01 00000009", "00 08 55 01 00000001", "00 08 55 01 00000002",
                              "00 08 55 01 00000002", "00 08 55 01 00000006", "00 08 55 01 00000007"}) {
    raw.send(hex(package));
  }
  ASSERT_TRUE(eventually([&] { return controller_.counters().command_packages == 6; }));
  const UrCounters counters = controller_.counters();
  EXPECT_EQ(counters.sequence_gaps, 1U) << "the jump from the greeting does not count";
  EXPECT_EQ(counters.sequence_duplicates, 1U);
  EXPECT_EQ(counters.max_missing, 3U);
}

TEST_F(SimulatedController, BrokenFramingEndsTheConnectionOnly) {
  RawClient raw = client_v2();
  raw.send(hex("00 02 56"));
  EXPECT_FALSE(raw.receive());
  EXPECT_TRUE(client_v2().ask(kOutputs));
}

TEST(UrControllerConfiguration, ValuesThatCannotWorkAreRefused) {
  UrControllerConfig config;
  config.frequency_hz = 0.0;
  EXPECT_FALSE(UrController(config).start());
  config = {};
  config.address = "no address";
  EXPECT_FALSE(UrController(config).start());
  config = {};
  config.robot.q_start_rad[2] = std::nan("");
  EXPECT_FALSE(UrController(config).start());
}

/// A session over a socket pair, without a controller around it.
struct PairedSession {
  explicit PairedSession(RtdeShared& shared, std::uint64_t id) {
    std::array<int, 2> pair{};
    EXPECT_EQ(::socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK, 0, pair.data()), 0);
    peer.reset(pair[0]);
    session.emplace(shared, transport::UniqueFd(pair[1]), id);
  }
  bool send(const std::vector<std::byte>& package) {
    EXPECT_EQ(transport::send_message(peer.get(), package), IoStatus::kDone);
    return session->receive();
  }
  std::size_t drain() {
    std::vector<std::byte> sink(1 << 16);
    std::size_t size = 0;
    for (auto got = transport::receive(peer.get(), sink); got.size > 0; got = transport::receive(peer.get(), sink)) {
      size += got.size;
    }
    return size;
  }
  transport::UniqueFd peer;
  std::optional<RtdeSession> session;
};

TEST(RtdeSession, SkipsLatePackagesInsteadOfQueuingThem) {
  RtdeShared shared;
  PairedSession pair(shared, 1);
  ASSERT_TRUE(pair.send(hex("00 05 56 00 02")));
  ASSERT_TRUE(pair.send(rtde::encode_outputs_request(125.0, "timestamp")));  // one package each 4 cycles
  ASSERT_TRUE(pair.send(kStart));
  pair.drain();
  const auto sent = [&](std::uint64_t previous, std::uint64_t cycle) {
    EXPECT_TRUE(pair.session->publish(previous, cycle));
    return pair.drain() / (rtde::kFieldsStart + sizeof(double));
  };
  EXPECT_EQ(sent(2, 3), 0U);
  EXPECT_EQ(sent(3, 4), 1U);
  EXPECT_EQ(sent(4, 7), 0U);
  EXPECT_EQ(sent(7, 100), 1U);
}

TEST(RtdeSession, AVanishingRateSendsNothingAndDoesNoHarm) {
  RtdeShared shared;
  PairedSession pair(shared, 1);
  ASSERT_TRUE(pair.send(hex("00 05 56 00 02")));
  ASSERT_TRUE(pair.send(rtde::encode_outputs_request(1e-300, "timestamp")));
  ASSERT_TRUE(pair.send(kStart));
  pair.drain();
  EXPECT_TRUE(pair.session->publish(0, 1'000'000));
  EXPECT_EQ(pair.drain(), 0U);
}

/// Random packages, many of them almost right, straight into a session over a socket pair.
TEST(RtdeSession, SurvivesRandomPackagesWithBoundedMemory) {
  std::mt19937_64 random(11);
  const std::vector<std::vector<std::byte>> seeds{hex("00 05 56 00 02"),
                                                  kOutputs,
                                                  kInputs,
                                                  kStart,
                                                  kPause,
                                                  hex("00 10 55 01 00000007 bff8000000000000"),
                                                  hex("00 09 4d 02 'hi' 01 'd' 03"),
                                                  hex("00 03 76")};
  RtdeShared shared;
  std::uint64_t id = 0;
  std::size_t packages = 0;
  while (packages < 100'000) {
    PairedSession pair(shared, ++id);
    bool open = true;
    for (int i = 0; open && i < 2000; ++i, ++packages) {
      auto package = seeds[random() % seeds.size()];
      if (random() % 4 == 0) package[random() % package.size()] = static_cast<std::byte>(random());
      open = pair.send(package) && pair.session->publish(id, id + 1);
      pair.drain();
    }
  }
  EXPECT_GT(id, 20U) << "the damage must end sessions now and then";
  const auto owned = std::count_if(shared.owners.begin(), shared.owners.end(), [](auto owner) { return owner != 0; });
  EXPECT_EQ(owned, 0) << "ended sessions own nothing";
}

}  // namespace
}  // namespace embody::sim
