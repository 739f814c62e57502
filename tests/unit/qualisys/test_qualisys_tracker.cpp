#include <gtest/gtest.h>

#include <optional>

#include "drivers/qualisys/qualisys_tracker.hpp"
#include "drivers/sim/qtm/qtm_server.hpp"
#include "drivers/transport/clock.hpp"
#include "drivers/transport/tcp.hpp"
#include "tests/support/heap_counter.hpp"
#include "tests/unit/qualisys/support.hpp"

namespace embody::qualisys {
namespace {

using sim::QtmServer;
using sim::QtmServerConfig;
using test::Bytes;
using test::eventually;
using test::next_frame;
using test::ScriptedPeer;

// The server's order differs from the slots' and has markers that nobody asked for.
const std::vector<std::string> kLabels{"back_top", "index_tip", "hand_top", "thumb & <tip>", "hand_left", "pillow"};
const std::vector<std::string> kSlots{"hand_top", "hand_left", "thumb & <tip>", "index_tip"};
const std::vector<std::size_t> kLabelOfSlot{2, 4, 3, 1};

QualisysConfig config_for(std::uint16_t port) {
  QualisysConfig config;
  config.port = port;
  return config;
}

bool contains(std::string_view text, std::string_view part) {
  return text.find(part) != std::string_view::npos;
}

/// A simulated QTM and a tracker for it.
struct Lab {
  explicit Lab(std::size_t frames = 200, double rate_hz = 1000.0, QtmServerConfig server_config = {})
      : recording(test::random_recording(kLabels, frames, rate_hz, /*seed=*/3)), server(server_config, recording) {
    const auto status = server.start();
    EXPECT_TRUE(status.ok()) << status.error().detail.c_str();
    tracker.emplace(config_for(server.port()), kSlots);
  }
  /// Connects, waits until the server streams to us, and plays.
  int connect_and_play() {
    const auto info = tracker->connect();
    EXPECT_TRUE(info.ok()) << info.error().detail.c_str();
    EXPECT_TRUE(eventually([&] { return server.has_streaming_client(); }));
    server.play();
    return info.ok() ? info->fd : -1;
  }
  recording::Recording recording;
  QtmServer server;
  std::optional<QualisysTracker> tracker;
};

void expect_frame(const MarkerFrame& frame, const recording::Recording& recording, std::size_t index) {
  ASSERT_EQ(frame.frame_number, index + 1);
  ASSERT_EQ(frame.count, kSlots.size());
  for (std::size_t slot = 0; slot < kSlots.size(); ++slot) {
    const auto& sent = recording.frames[index][kLabelOfSlot[slot]];
    ASSERT_EQ(frame.markers[slot].visible, sent.visible) << "frame " << index << ", " << kSlots[slot];
    if (!sent.visible) continue;
    ASSERT_LE((frame.markers[slot].p_W - sent.p_W).norm(), 1e-9) << "frame " << index << ", " << kSlots[slot];
  }
}

TEST(QualisysTracker, DeliversEveryFrameInOrderWithPositionsBySlotAndMissingMarkers) {
  Lab lab;
  const int fd = lab.connect_and_play();
  std::vector<MarkerFrame> frames;
  for (std::size_t k = 0; k < lab.recording.frames.size(); ++k) {
    MarkerFrame frame;
    ASSERT_EQ(next_frame(*lab.tracker, fd, frame), IoStatus::kDone) << k;
    expect_frame(frame, lab.recording, k);
    EXPECT_EQ(frame.label_epoch, 2U) << "one for the session, one for the start of the capture";
    frames.push_back(frame);
  }
  const auto log = lab.server.log();
  ASSERT_EQ(log.size(), frames.size());
  for (std::size_t k = 0; k < frames.size(); ++k) {
    EXPECT_EQ(log[k].index, k);
    EXPECT_GE(frames[k].t_arrival, log[k].t_sent) << k;
    EXPECT_LE(frames[k].t_capture, frames[k].t_arrival) << k;
  }
}

TEST(QualisysTracker, MapsTheSensorClockWithTheSpacingOfTheSensorWhateverTheArrivals) {
  Lab lab(300, 1000.0);
  const auto t_before_play = transport::now();
  const int fd = lab.connect_and_play();
  MarkerFrame first;
  ASSERT_EQ(next_frame(*lab.tracker, fd, first), IoStatus::kDone);
  for (std::size_t k = 1; k < lab.recording.frames.size(); ++k) {
    MarkerFrame frame;
    ASSERT_EQ(next_frame(*lab.tracker, fd, frame), IoStatus::kDone);
    const auto sensor_time = std::chrono::milliseconds(k);
    EXPECT_LE(frame.t_capture, first.t_capture + sensor_time + std::chrono::microseconds(100)) << "frame " << k;
    EXPECT_GE(frame.t_capture, t_before_play + sensor_time) << "not before its exposure, frame " << k;
  }
}

TEST(QualisysTracker, TellsRateDescriptorAndPeer) {
  Lab lab(10, 100.0);
  const auto info = lab.tracker->connect();
  ASSERT_TRUE(info.ok()) << info.error().detail.c_str();
  EXPECT_EQ(info->rate_hz, 100.0);
  EXPECT_GE(info->fd, 0);
  EXPECT_FALSE(info->playback);
  EXPECT_EQ(info->peer.view(), "QTM at 127.0.0.1:" + std::to_string(lab.server.port()));
}

TEST(QualisysTracker, NamesAllMissingMarkersAndTheMostSimilarLabel) {
  Lab lab;
  QualisysTracker tracker(config_for(lab.server.port()), {"hand_top", "hand_lefd", "little_tip"});
  const auto info = tracker.connect();
  ASSERT_FALSE(info.ok());
  EXPECT_EQ(info.error().code, Errc::kNotFound);
  const auto text = info.error().detail.view();
  EXPECT_TRUE(contains(text, "'hand_lefd' (similar: 'hand_left')")) << text;
  EXPECT_TRUE(contains(text, "'little_tip'")) << text;
  EXPECT_FALSE(contains(text, "'hand_top'")) << text;
}

TEST(QualisysTracker, RefusesAnUncalibratedSystem) {
  QtmServerConfig config;
  config.calibrated = false;
  Lab lab(10, 100.0, config);
  const auto info = lab.tracker->connect();
  ASSERT_FALSE(info.ok());
  EXPECT_EQ(info.error().code, Errc::kRefused);
  EXPECT_TRUE(contains(info.error().detail.view(), "not calibrated"));
}

TEST(QualisysTracker, RefusesAnyUpwardAxisButZ) {
  for (const char* axis : {"+X", "-X", "+Y", "-Y", "-Z", ""}) {
    QtmServerConfig config;
    config.axis = axis;
    Lab lab(10, 100.0, config);
    const auto info = lab.tracker->connect();
    ASSERT_FALSE(info.ok()) << axis;
    EXPECT_EQ(info.error().code, Errc::kRefused);
    EXPECT_TRUE(contains(info.error().detail.view(), "'" + std::string(axis) + "'")) << axis;
  }
}

TEST(QualisysTracker, RefusesPlaybackUnlessAllowed) {
  QtmServerConfig server_config;
  server_config.present_as_playback = true;
  Lab lab(50, 1000.0, server_config);
  const auto refused = lab.tracker->connect();
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, Errc::kRefused);
  EXPECT_TRUE(contains(refused.error().detail.view(), "plays back"));

  auto config = config_for(lab.server.port());
  config.allow_playback = true;
  lab.tracker.emplace(config, kSlots);
  const auto info = lab.tracker->connect();
  ASSERT_TRUE(info.ok()) << info.error().detail.c_str();
  EXPECT_TRUE(info->playback);
  EXPECT_TRUE(eventually([&] { return lab.server.has_streaming_client(); }));
  lab.server.play();
  MarkerFrame frame;
  ASSERT_EQ(next_frame(*lab.tracker, info->fd, frame), IoStatus::kDone);
  expect_frame(frame, lab.recording, 0);
}

TEST(QualisysTracker, EndsTheSessionWhenPlaybackStartsUninvited) {
  const ScriptedPeer peer(test::welcome(), test::sound_script(kLabels, [](std::string_view command) {
                            std::vector<Bytes> replies;
                            if (command.starts_with("StreamFrames")) replies = {encode_event(Event::kPlaybackStarted)};
                            return replies;
                          }));
  QualisysTracker tracker(config_for(peer.port()), kSlots);
  const auto info = tracker.connect();
  ASSERT_TRUE(info.ok()) << info.error().detail.c_str();
  MarkerFrame frame;
  EXPECT_EQ(next_frame(tracker, info->fd, frame), IoStatus::kDisconnected);
  EXPECT_TRUE(contains(tracker.reason(), "plays back"));
}

TEST(QualisysTracker, ReportsALostServerAndConnectsAgain) {
  Lab lab(100'000, 1000.0);
  const int fd = lab.connect_and_play();
  MarkerFrame frame;
  ASSERT_EQ(next_frame(*lab.tracker, fd, frame), IoStatus::kDone);
  lab.server.disconnect_clients();
  IoStatus status = IoStatus::kDone;
  while (status == IoStatus::kDone) status = next_frame(*lab.tracker, fd, frame);
  EXPECT_EQ(status, IoStatus::kDisconnected);
  EXPECT_EQ(lab.tracker->read(frame), IoStatus::kDisconnected) << "it stays so";
  EXPECT_FALSE(lab.tracker->reason().empty());

  const auto again = lab.tracker->connect();
  ASSERT_TRUE(again.ok()) << again.error().detail.c_str();
  ASSERT_EQ(next_frame(*lab.tracker, again->fd, frame), IoStatus::kDone);
  EXPECT_EQ(frame.label_epoch, 3U) << "another session";
  expect_frame(frame, lab.recording, frame.frame_number - 1);
}

TEST(QualisysTracker, FindsARestartedServer) {
  const auto recording = test::random_recording(kLabels, 10, 100.0, /*seed=*/3);
  QtmServerConfig config;
  std::optional<QtmServer> server(std::in_place, config, recording);
  ASSERT_TRUE(server->start().ok());
  config.port = server->port();
  QualisysTracker tracker(config_for(config.port), kSlots);
  const auto info = tracker.connect();
  ASSERT_TRUE(info.ok()) << info.error().detail.c_str();
  server.reset();
  MarkerFrame frame;
  EXPECT_EQ(next_frame(tracker, info->fd, frame), IoStatus::kDisconnected);
  EXPECT_FALSE(tracker.service().ok());
  const auto nobody = tracker.connect();
  ASSERT_FALSE(nobody.ok());
  EXPECT_EQ(nobody.error().code, Errc::kDisconnected);
  EXPECT_TRUE(contains(nobody.error().detail.view(), "cannot reach QTM")) << nobody.error().detail.view();
  server.emplace(config, recording);
  ASSERT_TRUE(server->start().ok());
  EXPECT_TRUE(tracker.connect().ok());
}

TEST(QualisysTracker, ReadsWithoutHeap) {
  Lab lab;
  const int fd = lab.connect_and_play();
  ASSERT_TRUE(test::heap_allocations() > 0 || !test::counts_heap()) << "connecting allocates, the counter must show it";
  for (std::size_t k = 0; k < lab.recording.frames.size(); ++k) {
    MarkerFrame frame;
    IoStatus status = IoStatus::kEmpty;
    while (status == IoStatus::kEmpty) {
      const auto before = test::heap_allocations();
      status = lab.tracker->read(frame);
      ASSERT_EQ(test::heap_allocations(), before) << k;
      if (status == IoStatus::kEmpty) {
        ASSERT_TRUE(transport::wait_readable(fd, transport::now() + std::chrono::seconds(10)));
      }
    }
    ASSERT_EQ(status, IoStatus::kDone);
  }
  lab.server.disconnect_clients();
  IoStatus status = IoStatus::kDone;
  while (status != IoStatus::kDisconnected) {
    MarkerFrame frame;
    const auto before = test::heap_allocations();
    status = lab.tracker->read(frame);
    ASSERT_EQ(test::heap_allocations(), before) << "while the session ends";
  }
}

TEST(QualisysTracker, ServiceNoticesARenamedLabelAndEndsTheSession) {
  Lab lab(100'000, 1000.0);
  const int fd = lab.connect_and_play();
  EXPECT_TRUE(lab.tracker->service().ok());
  ASSERT_TRUE(lab.server.rename_label("index_tip", "middle_tip"));
  const auto status = lab.tracker->service();
  ASSERT_FALSE(status.ok());
  EXPECT_TRUE(contains(status.error().detail.view(), "'index_tip' to 'middle_tip'")) << status.error().detail.view();
  MarkerFrame frame;
  EXPECT_EQ(next_frame(*lab.tracker, fd, frame), IoStatus::kDisconnected) << "not one more frame";

  const auto info = lab.tracker->connect();
  ASSERT_FALSE(info.ok());
  EXPECT_TRUE(contains(info.error().detail.view(), "'index_tip'")) << info.error().detail.view();
}

TEST(QualisysTracker, ServiceAndReadMayOverlap) {
  Lab lab(300, 1000.0);
  const int fd = lab.connect_and_play();
  std::thread upkeep([&] {
    for (int i = 0; i < 20; ++i) EXPECT_TRUE(lab.tracker->service().ok());
  });
  for (std::size_t k = 0; k < lab.recording.frames.size(); ++k) {
    MarkerFrame frame;
    ASSERT_EQ(next_frame(*lab.tracker, fd, frame), IoStatus::kDone);
    expect_frame(frame, lab.recording, k);
  }
  upkeep.join();
}

TEST(QualisysTracker, HasNothingToReadWhileNothingIsMeasured) {
  Lab lab;
  ASSERT_TRUE(lab.tracker->connect().ok());
  ASSERT_TRUE(eventually([&] { return lab.server.has_streaming_client(); }));
  MarkerFrame frame;
  for (int i = 0; i < 100; ++i) ASSERT_EQ(lab.tracker->read(frame), IoStatus::kEmpty);
}

TEST(QualisysTracker, EndsTheSessionWhenTheNumberOfMarkersDiffersFromTheLabels) {
  const ScriptedPeer peer(test::welcome(), test::sound_script(kLabels, [](std::string_view command) {
                            std::vector<Bytes> replies;
                            if (!command.starts_with("StreamFrames")) return replies;
                            constexpr Component kComponents[] = {Component::k3d};
                            DataPacket data;
                            data.markers.resize(kLabels.size() - 1);
                            replies = {encode_data(data, kComponents)};
                            return replies;
                          }));
  QualisysTracker tracker(config_for(peer.port()), kSlots);
  const auto info = tracker.connect();
  ASSERT_TRUE(info.ok()) << info.error().detail.c_str();
  MarkerFrame frame;
  EXPECT_EQ(next_frame(tracker, info->fd, frame), IoStatus::kDisconnected);
  EXPECT_TRUE(contains(tracker.reason(), "5 markers but lists 6 labels")) << tracker.reason();
}

TEST(QualisysTracker, SkipsEventsAndStaleDataDuringTheHandshake) {
  constexpr Component kComponents[] = {Component::k3d};
  const auto noise = [&](std::string_view command) {
    std::vector<Bytes> replies{encode_event(Event::kCameraSettingsChanged), encode_no_more_data(),
                               encode_data(DataPacket{}, kComponents)};
    const auto sound = test::sound_script(kLabels, [](std::string_view) { return std::vector<Bytes>{}; })(command);
    replies.insert(replies.end(), sound.begin(), sound.end());
    if (command.starts_with("StreamFrames")) replies.clear();
    return replies;
  };
  const ScriptedPeer peer(test::welcome(), noise);
  QualisysTracker tracker(config_for(peer.port()), kSlots);
  const auto info = tracker.connect();
  EXPECT_TRUE(info.ok()) << info.error().detail.c_str();
}

TEST(QualisysTracker, SaysWhichProtocolVersionIsMissing) {
  const ScriptedPeer peer(test::welcome(), [](std::string_view) {
    return std::vector<Bytes>{encode_text(PacketType::kError, "Version NOT supported")};
  });
  QualisysTracker tracker(config_for(peer.port()), kSlots);
  const auto info = tracker.connect();
  ASSERT_FALSE(info.ok());
  EXPECT_EQ(info.error().code, Errc::kUnsupported);
  EXPECT_TRUE(contains(info.error().detail.view(), "1.25"));
}

TEST(QualisysTracker, RecognisesAPeerThatIsNotQtm) {
  struct Stranger {
    const char* what;
    Bytes greeting;
  };
  Bytes big_endian = test::welcome();
  std::reverse(big_endian.begin(), big_endian.begin() + 4);
  for (const auto& [what, greeting] : {Stranger{"another text", encode_text(PacketType::kCommand, "HELLO")},
                                       Stranger{"the big-endian port", big_endian},
                                       Stranger{"full", encode_text(PacketType::kError, "Connection refused.")}}) {
    const ScriptedPeer peer(greeting, [](std::string_view) { return std::vector<Bytes>{}; });
    QualisysTracker tracker(config_for(peer.port()), kSlots);
    const auto info = tracker.connect();
    ASSERT_FALSE(info.ok()) << what;
    EXPECT_NE(info.error().code, Errc::kTimeout) << what;
  }
}

TEST(QualisysTracker, GivesUpOnASilentPeerWithinItsReplyTimeout) {
  struct Silence {
    const char* at;
    Bytes greeting;
  };
  for (const auto& [at, greeting] : {Silence{"", {}}, Silence{"Version", test::welcome()},
                                     Silence{"GetParameters", test::welcome()}, Silence{"GetState", test::welcome()}}) {
    const auto mute = std::string(at);
    const auto script = [mute](std::string_view command) {
      if (command.starts_with(mute)) return std::vector<Bytes>{encode_no_more_data()};
      return test::sound_script(kLabels, [](std::string_view) { return std::vector<Bytes>{}; })(command);
    };
    const ScriptedPeer peer(greeting, script);
    auto config = config_for(peer.port());
    config.reply_timeout = std::chrono::milliseconds(50);
    QualisysTracker tracker(config, kSlots);
    const auto begin = transport::now();
    const auto info = tracker.connect();
    ASSERT_FALSE(info.ok()) << at;
    EXPECT_EQ(info.error().code, Errc::kTimeout) << at;
    EXPECT_LT(transport::now() - begin, std::chrono::seconds(3)) << at;
  }
}

TEST(QualisysTracker, RefusesLayoutsThatDoNotFit) {
  Lab lab;
  std::vector<std::string> many;
  for (std::size_t i = 0; i <= kMaxMarkers; ++i) many.push_back("m" + std::to_string(i));
  for (const auto& names : {std::vector<std::string>{}, std::vector<std::string>{"hand_top", "hand_top"}, many}) {
    QualisysTracker tracker(config_for(lab.server.port()), names);
    const auto info = tracker.connect();
    ASSERT_FALSE(info.ok());
    EXPECT_EQ(info.error().code, Errc::kInvalidArgument);
  }
}

TEST(QualisysTracker, IsDisconnectedBeforeTheFirstConnect) {
  QualisysTracker tracker(config_for(1), kSlots);
  MarkerFrame frame;
  EXPECT_EQ(tracker.read(frame), IoStatus::kDisconnected);
  EXPECT_FALSE(tracker.service().ok());
}

}  // namespace
}  // namespace embody::qualisys
