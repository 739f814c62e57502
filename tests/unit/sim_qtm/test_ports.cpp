// The ports of the simulated QTM and who may connect to them.
#include <gtest/gtest.h>

#include "drivers/transport/clock.hpp"
#include "drivers/transport/tcp.hpp"
#include "tests/unit/sim_qtm/support.hpp"

namespace embody::sim {
namespace {

using test::counting_motion;
using test::Lab;
using test::RawClient;
using test::UdpReceiver;

QtmServerConfig all_ports() {
  QtmServerConfig config;
  config.big_endian_port = 0;
  config.legacy_port = 0;
  config.discovery_port = 0;
  return config;
}

Motion still() {
  return counting_motion({"a"}, 100.0, 5);
}

TEST(QtmPorts, OnlyTheLittleEndianOneIsOpenByDefault) {
  const Lab lab(still());
  EXPECT_NE(lab.server.port(), 0);
  EXPECT_EQ(lab.server.big_endian_port(), 0);
  EXPECT_EQ(lab.server.legacy_port(), 0);
  EXPECT_EQ(lab.server.discovery_port(), 0);
}

TEST(QtmPorts, TheLegacyPortSaysWhereToGoAndHangsUp) {
  const Lab lab(still(), all_ports());
  for (int i = 0; i < 15; ++i) {
    RawClient client(lab.server.legacy_port(), ByteOrder::kBig);
    const auto refusal = client.next();
    EXPECT_EQ(refusal.type(), 0U);
    EXPECT_NE(refusal.text().find(std::to_string(lab.server.port())), std::string::npos);
    EXPECT_TRUE(client.next().empty());
  }
}

TEST(QtmPorts, AtMostTenClientsOnBothPortsTogether) {
  Lab lab(still(), all_ports());
  std::vector<RawClient> clients;
  clients.reserve(10);
  for (int i = 0; i < 5; ++i) {
    clients.emplace_back(lab.server.port()).ready();
    clients.emplace_back(lab.server.big_endian_port(), ByteOrder::kBig).ready();
  }
  RawClient eleventh(lab.server.big_endian_port(), ByteOrder::kBig);
  const auto refusal = eleventh.next();
  EXPECT_EQ(refusal.type(), 0U);
  EXPECT_EQ(refusal.text(), "Connection refused. Max number of clients reached.");
  EXPECT_TRUE(eleventh.next().empty());
  clients.pop_back();
  EXPECT_TRUE(test::eventually([&] { return RawClient(lab.server.port()).next().type() == 1; }));
}

TEST(QtmPorts, AMasterThatHangsUpFreesTheControl) {
  Lab lab(still());
  RawClient heir(lab.server.port());
  heir.ready();
  {
    RawClient master(lab.server.port());
    EXPECT_EQ(master.ready().reply("TakeControl"), "You are now master");
    EXPECT_TRUE(heir.reply("TakeControl").ends_with("is already master"));
  }
  EXPECT_TRUE(test::eventually([&] { return heir.reply("TakeControl") == "You are now master"; }));
}

TEST(QtmPorts, DiscoveryAnswersTheSenderWithTheBasePort) {
  const Lab lab(still(), all_ports());
  UdpReceiver asker;
  Bytes request{std::byte{10}, {}, {}, {}, std::byte{7}, {}, {}, {}};
  Writer(request, ByteOrder::kBig).u16(asker.port());
  asker.send_to(lab.server.discovery_port(), {std::byte{1}, std::byte{2}});
  asker.send_to(lab.server.discovery_port(), Bytes(100, std::byte{7}));
  asker.send_to(lab.server.discovery_port(), request);
  const auto reply = asker.next();
  ASSERT_GT(reply.bytes.size(), 11U);
  const test::Reader in(reply.bytes, ByteOrder::kLittle);
  EXPECT_EQ(in.u32(0), reply.bytes.size());
  EXPECT_EQ(in.u32(4), 1U);
  const std::string text(reinterpret_cast<const char*>(reply.bytes.data()) + 8, reply.bytes.size() - 11);
  EXPECT_TRUE(text.ends_with(", QTM 2023.3 (build 13590), 7 cameras")) << text;
  EXPECT_EQ(reply.bytes[reply.bytes.size() - 3], std::byte{0});
  EXPECT_EQ(test::Reader(reply.bytes, ByteOrder::kBig).u16(reply.bytes.size() - 2) + 1, lab.server.port());
  EXPECT_TRUE(asker.next(std::chrono::milliseconds(50)).empty()) << "one reply; the others were no requests";
}

TEST(QtmPorts, KilledItRefusesConnectionsAndRestartedItHasTheSamePorts) {
  Lab lab(still(), all_ports());
  const auto refused = [](std::uint16_t port) { return !transport::tcp_connect("127.0.0.1", port, test::soon()).ok(); };
  for (int round = 0; round < 5; ++round) {
    RawClient client(lab.server.port());
    client.ready();
    ASSERT_TRUE(lab.server.fault("kill").ok());
    EXPECT_TRUE(client.next().empty());
    EXPECT_TRUE(test::eventually([&] {
      return refused(lab.server.port()) && refused(lab.server.big_endian_port()) && refused(lab.server.legacy_port());
    }));
    ASSERT_TRUE(lab.server.fault("restart").ok());
    RawClient(lab.server.big_endian_port(), ByteOrder::kBig).ready();
  }
}

TEST(QtmPorts, RefusesPortsThatAreTakenAndStartsOnce) {
  Lab lab(still(), all_ports());
  EXPECT_TRUE(lab.server.start().ok()) << "it runs already";
  for (const auto taken : {&QtmServerConfig::big_endian_port, &QtmServerConfig::legacy_port}) {
    QtmServerConfig config;
    config.*taken = lab.server.port();
    QtmServer second(config, still());
    EXPECT_EQ(second.start().error().code, Errc::kIo);
  }
  QtmServerConfig nowhere;
  nowhere.address = "no address";
  EXPECT_EQ(QtmServer(nowhere, still()).start().error().code, Errc::kInvalidArgument);
  QtmServer idle({}, still());
  EXPECT_FALSE(idle.fault("kill").ok()) << "not started";
  idle.play();
  EXPECT_FALSE(idle.finished());
}

TEST(QtmPorts, AClientThatBreaksTheProtocolIsDroppedInEitherByteOrder) {
  Lab lab(still(), all_ports());
  RawClient big(lab.server.big_endian_port(), ByteOrder::kBig);
  big.ready().send_bytes(string_packet(Packet::kCommand, "ByteOrder", ByteOrder::kLittle));
  EXPECT_TRUE(big.next().empty()) << "little endian at the big endian port";
  RawClient little(lab.server.port());
  little.ready().send_bytes(Bytes(64, std::byte{0xEE}));
  EXPECT_TRUE(little.next().empty());
  RawClient(lab.server.port()).ready();
}

}  // namespace
}  // namespace embody::sim
