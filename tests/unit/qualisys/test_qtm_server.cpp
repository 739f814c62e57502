#include <gtest/gtest.h>
#include <sys/socket.h>

#include <cstring>

#include "drivers/qualisys/parameters.hpp"
#include "drivers/qualisys/rt_connection.hpp"
#include "drivers/sim/qtm/qtm_server.hpp"
#include "drivers/transport/clock.hpp"
#include "drivers/transport/tcp.hpp"
#include "tests/unit/qualisys/support.hpp"

namespace embody::sim {
namespace {

using qualisys::Component;
using qualisys::DataPacket;
using qualisys::Event;
using qualisys::PacketType;
using qualisys::RtConnection;
using test::Bytes;
using test::eventually;

const std::vector<std::string> kLabels{"a", "b & <c>", "Table - 1"};

TimePoint soon() {
  return transport::now() + std::chrono::seconds(10);
}

recording::Recording small_recording(std::size_t frames = 50, double rate_hz = 1000.0) {
  return test::random_recording(kLabels, frames, rate_hz, /*seed=*/5);
}

/// A started server.
struct Lab {
  explicit Lab(recording::Recording recorded = small_recording(), QtmServerConfig config = {})
      : recording(std::move(recorded)), server(config, recording) {
    const auto status = server.start();
    EXPECT_TRUE(status.ok()) << status.error().detail.c_str();
  }
  RtConnection connect() const {
    auto connection = RtConnection::open("127.0.0.1", server.port(), std::size_t{1} << 20, soon());
    EXPECT_TRUE(connection.ok()) << connection.error().detail.c_str();
    return std::move(*connection);
  }
  recording::Recording recording;
  QtmServer server;
};

/// Next packet of a connection, header included; empty when the peer is gone.
Bytes next_packet(RtConnection& connection) {
  while (true) {
    const auto packet = connection.input().next();
    if (!packet) return {};
    if (!packet->empty()) return {packet->begin(), packet->end()};
    if (!transport::wait_readable(connection.fd(), soon())) return {};
    const auto received = transport::receive(connection.fd(), connection.input().free_space());
    if (received.status == IoStatus::kDisconnected) return {};
    connection.input().commit(received.size);
  }
}

PacketType type_of(const Bytes& packet) {
  if (packet.empty()) return PacketType::kDiscover;  // the connection is gone; no test expects this type
  return qualisys::decode_header(packet)->type;
}

/// Data packets until the first packet of type kNoMoreData that follows data.
std::vector<DataPacket> read_stream(RtConnection& connection) {
  std::vector<DataPacket> frames;
  while (true) {
    const auto packet = next_packet(connection);
    if (packet.empty()) return frames;
    if (type_of(packet) == PacketType::kNoMoreData && !frames.empty()) return frames;
    if (type_of(packet) != PacketType::kData) continue;
    frames.emplace_back();
    EXPECT_TRUE(qualisys::decode_data(packet, frames.back()).ok());
  }
}

TEST(QtmServer, GreetsWithoutADotInOnePacketOf35Bytes) {
  const Lab lab;
  const auto fd = transport::tcp_connect("127.0.0.1", lab.server.port(), soon());
  ASSERT_TRUE(fd.ok());
  ASSERT_TRUE(transport::wait_readable(fd->get(), soon()));
  std::byte bytes[64];
  ASSERT_EQ(transport::receive(fd->get(), bytes).size, 35U);
  EXPECT_EQ(std::memcmp(bytes + 8, "QTM RT Interface connected", 27), 0);
}

TEST(QtmServer, AcceptsVersions1_8To1_28AndNoOther) {
  const Lab lab;
  auto connection = lab.connect();
  for (int minor = 0; minor < 40; ++minor) {
    const auto version = "1." + std::to_string(minor);
    const auto reply = connection.ask("version " + version, PacketType::kCommand, soon());
    ASSERT_EQ(reply.ok(), minor >= 8 && minor <= 28) << version;
    if (reply) {
      EXPECT_EQ(*reply, "Version set to " + version);
    }
  }
  for (const char* wrong : {"Version 2.0", "Version 1.", "Version 1.25x", "Version 25"}) {
    const auto reply = connection.ask(wrong, PacketType::kCommand, soon());
    ASSERT_FALSE(reply.ok()) << wrong;
    EXPECT_NE(reply.error().detail.view().find("Version NOT supported"), std::string_view::npos);
  }
  EXPECT_EQ(*connection.ask("Version", PacketType::kCommand, soon()), "Version is 1.28");
}

TEST(QtmServer, AnswersCommandsInAnyCaseAndWithOrWithoutTerminator) {
  const Lab lab;
  auto connection = lab.connect();
  EXPECT_EQ(*connection.ask("bYTEoRDER  ", PacketType::kCommand, soon()), "Byte order is little endian");
  const std::string_view command = "QTMVersion";
  auto bare = qualisys::encode_text(PacketType::kCommand, command);
  bare.pop_back();
  bare[0] = static_cast<std::byte>(bare.size());
  ASSERT_TRUE(transport::send_all(connection.fd(), bare, soon()).ok());
  EXPECT_TRUE(qualisys::decode_text(next_packet(connection))->starts_with("QTM Version is "));
  for (const char* unknown :
       {"Fly", "", "StreamFrames", "StreamFrames AllFrames", "StreamFrames AllFrames 7D", "StreamFrames Frequency:0 3D",
        "StreamFrames AllFrames UDP:1000 3D", "GetParameters", "GetParameters 5D", "GetCurrentFrame"}) {
    const auto reply = connection.ask(unknown, PacketType::kCommand, soon());
    ASSERT_FALSE(reply.ok()) << unknown;
    EXPECT_NE(reply.error().detail.view().find("Parse error"), std::string_view::npos) << unknown;
  }
}

TEST(QtmServer, DescribesItsLabelsAxisCalibrationAndRate) {
  const Lab lab;
  auto connection = lab.connect();
  for (const char* command : {"GetParameters General 3D", "getparameters all", "GetParameters 6D 3D general Analog"}) {
    const auto xml = connection.ask(command, PacketType::kXml, soon());
    ASSERT_TRUE(xml.ok()) << command;
    EXPECT_TRUE(xml->starts_with("<QTM_Parameters_Ver_1.25>"));
    const auto parameters = qualisys::parse_parameters(*xml);
    ASSERT_TRUE(parameters.ok()) << parameters.error().detail.c_str();
    EXPECT_EQ(parameters->labels, kLabels);
    EXPECT_EQ(parameters->axis_upwards, "+Z");
    EXPECT_FALSE(parameters->calibration_time.empty());
    EXPECT_EQ(parameters->frequency_hz, 1000.0);
  }
}

TEST(QtmServer, SendsFrameKNotBeforeItsTimeAndEndsWithNoMoreDataAndAnEvent) {
  Lab lab;
  auto connection = lab.connect();
  ASSERT_TRUE(connection.send("StreamFrames AllFrames 3D", soon()).ok());
  EXPECT_EQ(type_of(next_packet(connection)), PacketType::kNoMoreData) << "idle";
  EXPECT_FALSE(lab.server.finished());
  const auto t_play = transport::now();
  lab.server.play();
  EXPECT_EQ(*qualisys::decode_event(next_packet(connection)), Event::kCaptureStarted);
  const auto frames = read_stream(connection);
  ASSERT_EQ(frames.size(), lab.recording.frames.size());
  EXPECT_EQ(*qualisys::decode_event(next_packet(connection)), Event::kCaptureStopped);
  const auto log = lab.server.log();
  ASSERT_EQ(log.size(), frames.size());
  EXPECT_EQ(lab.server.frames_sent(), frames.size());
  EXPECT_TRUE(lab.server.finished());
  for (std::size_t k = 0; k < frames.size(); ++k) {
    EXPECT_EQ(frames[k].frame_number, k + 1);
    EXPECT_EQ(frames[k].timestamp_us, 1000 * k);
    EXPECT_EQ(log[k].index, k);
    EXPECT_GE(log[k].t_sent, t_play + std::chrono::milliseconds(k));
  }
  lab.server.play();
  EXPECT_TRUE(lab.server.finished()) << "it plays once";
}

TEST(QtmServer, DividesTheRateAndServesSeveralClients) {
  Lab lab;
  auto half = lab.connect();
  auto fifth = lab.connect();
  ASSERT_TRUE(half.send("StreamFrames FrequencyDivisor:2 3D", soon()).ok());
  ASSERT_TRUE(fifth.send("StreamFrames Frequency:200 3DRes 3D", soon()).ok());
  EXPECT_EQ(type_of(next_packet(half)), PacketType::kNoMoreData);
  EXPECT_EQ(type_of(next_packet(fifth)), PacketType::kNoMoreData);
  lab.server.play();
  const auto halves = read_stream(half);
  const auto fifths = read_stream(fifth);
  ASSERT_EQ(halves.size(), 25U);
  ASSERT_EQ(fifths.size(), 10U);
  for (std::size_t i = 0; i < halves.size(); ++i) EXPECT_EQ(halves[i].frame_number, 2 * i + 1);
  for (std::size_t i = 0; i < fifths.size(); ++i) EXPECT_EQ(fifths[i].frame_number, 5 * i + 1);
}

TEST(QtmServer, StopsStreamingOnRequestAndNeverAcknowledges) {
  Lab lab(small_recording(100'000));
  auto connection = lab.connect();
  ASSERT_TRUE(connection.send("StreamFrames AllFrames 3D", soon()).ok());
  ASSERT_TRUE(connection.send("StreamFrames Stop", soon()).ok());
  const auto reply = connection.ask("ByteOrder", PacketType::kCommand, soon());
  ASSERT_TRUE(reply.ok());
  EXPECT_EQ(*reply, "Byte order is little endian");
  EXPECT_FALSE(lab.server.has_streaming_client());
}

TEST(QtmServer, HandsOutTheCurrentFrameOnlyWhilePlaying) {
  Lab lab(small_recording(100'000));
  auto connection = lab.connect();
  ASSERT_TRUE(connection.send("GetCurrentFrame 3D", soon()).ok());
  EXPECT_EQ(type_of(next_packet(connection)), PacketType::kNoMoreData);
  lab.server.play();
  EXPECT_EQ(type_of(next_packet(connection)), PacketType::kEvent);
  Bytes packet;
  ASSERT_TRUE(eventually([&] {
    EXPECT_TRUE(connection.send("GetCurrentFrame 3D", soon()).ok());
    packet = next_packet(connection);
    return type_of(packet) == PacketType::kData;
  }));
  DataPacket data;
  ASSERT_TRUE(qualisys::decode_data(packet, data).ok());
  EXPECT_EQ(data.markers.size(), kLabels.size());
}

TEST(QtmServer, RefusesDataBeforeAVersionIsSet) {
  const Lab lab;
  auto fd = transport::tcp_connect("127.0.0.1", lab.server.port(), soon());
  ASSERT_TRUE(fd.ok());
  const auto command = qualisys::encode_text(PacketType::kCommand, "StreamFrames AllFrames 3D");
  ASSERT_TRUE(transport::send_all(fd->get(), command, soon()).ok());
  qualisys::StreamReassembler input(4096);
  std::vector<PacketType> types;
  while (types.size() < 2) {
    ASSERT_TRUE(transport::wait_readable(fd->get(), soon()));
    const auto received = transport::receive(fd->get(), input.free_space());
    ASSERT_EQ(received.status, IoStatus::kDone);
    input.commit(received.size);
    for (auto packet = input.next(); packet && !packet->empty(); packet = input.next()) {
      types.push_back(qualisys::decode_header(*packet)->type);
    }
  }
  EXPECT_EQ(types[1], PacketType::kError);
}

TEST(QtmServer, RefusesTheEleventhClientAndServesItOnceOneHasLeft) {
  const Lab lab;
  std::vector<RtConnection> clients;
  for (int i = 0; i < 10; ++i) clients.push_back(lab.connect());
  const auto refused = RtConnection::open("127.0.0.1", lab.server.port(), 4096, soon());
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().detail.view().find("Max number of clients"), std::string_view::npos);
  clients.pop_back();
  EXPECT_TRUE(eventually([&] { return RtConnection::open("127.0.0.1", lab.server.port(), 4096, soon()).ok(); }));
}

TEST(QtmServer, SkipsTheFramesThatAreDueDuringAPause) {
  Lab lab(small_recording(1000));
  auto connection = lab.connect();
  ASSERT_TRUE(connection.send("StreamFrames AllFrames 3D", soon()).ok());
  ASSERT_TRUE(eventually([&] { return lab.server.has_streaming_client(); }));
  lab.server.play();
  ASSERT_TRUE(eventually([&] { return lab.server.frames_sent() > 20; }));
  const auto t_before = transport::now();
  lab.server.pause(std::chrono::milliseconds(100));
  const auto t_paused = transport::now();
  const auto frames = read_stream(connection);
  std::uint32_t widest = 0;
  for (std::size_t i = 1; i < frames.size(); ++i) {
    ASSERT_GT(frames[i].frame_number, frames[i - 1].frame_number);
    widest = std::max(widest, frames[i].frame_number - frames[i - 1].frame_number);
  }
  EXPECT_GE(widest, 99U);
  for (const auto& sent : lab.server.log()) {
    const bool inside = sent.t_sent > t_paused && sent.t_sent < t_before + std::chrono::milliseconds(100);
    EXPECT_FALSE(inside) << "frame " << sent.index;
  }
}

TEST(QtmServer, HidesAMarkerUntilItIsShownAgain) {
  Lab lab(small_recording(100'000));
  auto connection = lab.connect();
  EXPECT_FALSE(lab.server.set_marker_hidden("nobody", true));
  ASSERT_TRUE(lab.server.set_marker_hidden("a", true));
  ASSERT_TRUE(connection.send("StreamFrames AllFrames 3D", soon()).ok());
  ASSERT_TRUE(eventually([&] { return lab.server.has_streaming_client(); }));
  lab.server.play();
  const auto next_data = [&] {
    DataPacket data;
    Bytes packet = next_packet(connection);
    while (!packet.empty() && type_of(packet) != PacketType::kData) packet = next_packet(connection);
    EXPECT_TRUE(qualisys::decode_data(packet, data).ok());
    return data;
  };
  for (int i = 0; i < 20; ++i) EXPECT_FALSE(next_data().markers[0].visible);
  ASSERT_TRUE(lab.server.set_marker_hidden("a", false));
  EXPECT_TRUE(eventually([&] { return next_data().markers[0].visible; }));
}

/// A client that reads a stream, and what the recording says of each frame.
class StreamedLab {
 public:
  explicit StreamedLab(recording::Recording r) : recording(std::move(r)), lab(recording), connection(lab.connect()) {
    EXPECT_TRUE(connection.send("StreamFrames AllFrames 3D", soon()).ok());
    EXPECT_TRUE(eventually([&] { return lab.server.has_streaming_client(); }));
  }
  DataPacket next() {
    DataPacket data;
    Bytes packet = next_packet(connection);
    while (!packet.empty() && type_of(packet) != PacketType::kData) packet = next_packet(connection);
    EXPECT_TRUE(qualisys::decode_data(packet, data).ok());
    return data;
  }
  const Marker& recorded(const DataPacket& data, std::size_t marker) const {
    return recording.frames[data.frame_number - 1][marker];
  }

  recording::Recording recording;
  Lab lab;
  RtConnection connection;
};

TEST(QtmServer, SwappedLabelsFollowEachOthersMarkerUntilSwappedAgain) {
  StreamedLab streamed(small_recording(20'000, 2'000.0));
  QtmServer& server = streamed.lab.server;
  EXPECT_FALSE(server.swap_labels("a", "nobody"));
  ASSERT_TRUE(server.swap_labels(kLabels[0], kLabels[1]));
  server.play();
  const auto same = [](const Marker& x, const Marker& y) {
    return x.visible == y.visible && (!x.visible || x.p_W.isApprox(y.p_W, 1e-6));
  };
  for (int i = 0; i < 20; ++i) {
    const DataPacket data = streamed.next();
    EXPECT_TRUE(same(data.markers[0], streamed.recorded(data, 1)));
    EXPECT_TRUE(same(data.markers[1], streamed.recorded(data, 0)));
    EXPECT_TRUE(same(data.markers[2], streamed.recorded(data, 2)));
  }
  ASSERT_TRUE(server.swap_labels(kLabels[1], kLabels[0]));
  EXPECT_TRUE(eventually([&] {
    const DataPacket data = streamed.next();
    return data.markers[0].visible && same(data.markers[0], streamed.recorded(data, 0));
  }));
}

TEST(QtmServer, AGhostStandsStillNearWhereTheMarkerWas) {
  StreamedLab streamed(small_recording(20'000, 2'000.0));
  QtmServer& server = streamed.lab.server;
  EXPECT_FALSE(server.set_ghost("nobody", true));
  ASSERT_TRUE(server.set_ghost("a", true));
  server.play();
  std::optional<Eigen::Vector3d> p_W;
  for (int i = 0; i < 30; ++i) {
    const DataPacket data = streamed.next();
    const Marker& ghost = data.markers[0];
    if (!p_W && !ghost.visible) continue;  // the marker itself is missing in the first frames
    ASSERT_TRUE(ghost.visible) << "a reflection does not go with the marker";
    if (!p_W) {
      p_W = ghost.p_W;
      EXPECT_NEAR((*p_W - streamed.recorded(data, 0).p_W).norm(), 0.1, 1e-4);
    }
    EXPECT_EQ(ghost.p_W, *p_W);
  }
  ASSERT_TRUE(p_W.has_value());
  ASSERT_TRUE(server.set_ghost("a", false));
  EXPECT_TRUE(eventually([&] {
    const DataPacket data = streamed.next();
    return data.markers[0].visible && data.markers[0].p_W.isApprox(streamed.recorded(data, 0).p_W, 1e-6);
  }));
}

TEST(QtmServer, DropsAClientThatDoesNotReadAndGoesOnServingTheOthers) {
  std::vector<std::string> names;
  for (int i = 0; i < 250; ++i) names.push_back("m" + std::to_string(i));
  Lab lab(test::random_recording(names, 4'000, 10'000.0, /*seed=*/9));  // 12 MB on the wire
  auto lazy = lab.connect();
  const int small = 256 << 10;  // bounds what the kernel takes in our place, yet several loopback segments
  ASSERT_EQ(::setsockopt(lazy.fd(), SOL_SOCKET, SO_RCVBUF, &small, sizeof small), 0);
  auto eager = lab.connect();
  ASSERT_TRUE(lazy.send("StreamFrames AllFrames 3D", soon()).ok());
  ASSERT_TRUE(eager.send("StreamFrames FrequencyDivisor:100 3D", soon()).ok());
  EXPECT_EQ(type_of(next_packet(lazy)), PacketType::kNoMoreData);
  EXPECT_EQ(type_of(next_packet(eager)), PacketType::kNoMoreData);
  lab.server.play();
  EXPECT_EQ(read_stream(eager).size(), 40U);
  EXPECT_LT(read_stream(lazy).size(), 4'000U);
}

TEST(QtmServer, RefusesToServeAnEmptyRecordingOrATakenPort) {
  QtmServer empty({}, recording::Recording{});
  EXPECT_EQ(empty.start().error().code, Errc::kInvalidArgument);
  const Lab lab;
  QtmServerConfig config;
  config.port = lab.server.port();
  QtmServer second(config, small_recording());
  EXPECT_EQ(second.start().error().code, Errc::kIo);
}

TEST(QtmServer, DropsAClientThatBreaksTheProtocol) {
  const Lab lab;
  auto connection = lab.connect();
  const Bytes garbage(64, std::byte{0xEE});
  ASSERT_TRUE(transport::send_all(connection.fd(), garbage, soon()).ok());
  EXPECT_TRUE(next_packet(connection).empty());
  EXPECT_EQ(*lab.connect().ask("ByteOrder", PacketType::kCommand, soon()), "Byte order is little endian");
}

}  // namespace
}  // namespace embody::sim
