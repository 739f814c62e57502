// The contract of HandTracker.
#include <atomic>
#include <cmath>
#include <optional>
#include <thread>

#include "drivers/transport/clock.hpp"
#include "drivers/transport/tcp.hpp"
#include "tests/contract/tracker_cell.hpp"

namespace embody::test {
namespace {

using std::chrono::milliseconds;
using transport::now;

struct TrackerKind {
  const char* name;
  std::unique_ptr<TrackerCell> (*make)();
};
void PrintTo(const TrackerKind& kind, std::ostream* out) {
  *out << kind.name;
}

class TrackerContract : public ::testing::TestWithParam<TrackerKind> {
 protected:
  void SetUp() override {
    cell_ = GetParam().make();
    tracker_ = cell_->driver();
  }

  void connect() {
    const auto connected = tracker_->connect();
    ASSERT_TRUE(connected.ok()) << connected.error().detail.view();
    info_ = *connected;
  }
  [[nodiscard]] Status try_to_connect() {
    const auto connected = tracker_->connect();
    if (!connected) return connected.error();
    info_ = *connected;
    return {};
  }
  /// Waits for the line, at most 20 ms, then reads.
  IoStatus turn() {
    static_cast<void>(transport::wait_readable(info_.fd, now() + milliseconds(20)));
    return tracker_->read(frame_);
  }
  /// Shows `see` each frame until it is content; false after `limit` or when the session has ended.
  bool watch(const std::function<bool()>& see, Duration limit = kPatience) {
    for (const TimePoint end = now() + limit; now() < end;) {
      const IoStatus status = turn();
      if (status == IoStatus::kDisconnected) return false;
      if (status == IoStatus::kDone && see()) return true;
    }
    return false;
  }
  bool watch_frames(int count) {
    return watch([&] { return --count <= 0; });
  }
  /// Reads, and does the upkeep each second where `serves`, until the session is over; how long that took.
  std::optional<Duration> time_to_loss(bool serves) {
    const TimePoint start = now();
    TimePoint next = start + std::chrono::seconds(1);
    while (now() < start + 3 * kPatience) {
      if (turn() == IoStatus::kDisconnected) return now() - start;
      if (serves && now() >= next) {
        static_cast<void>(tracker_->service());
        next = now() + std::chrono::seconds(1);
      }
    }
    return std::nullopt;
  }

  std::unique_ptr<TrackerCell> cell_;
  std::unique_ptr<HandTracker> tracker_;
  TrackerInfo info_;
  MarkerFrame frame_;
};

TEST_P(TrackerContract, ConnectingTellsWhatIsThereAndChangesNothing) {
  ASSERT_NO_FATAL_FAILURE(connect());
  EXPECT_GE(info_.fd, 0);
  EXPECT_NEAR(info_.rate_hz, cell_->rate_hz, 1e-6);
  EXPECT_FALSE(info_.playback);
  expect_sentence(info_.peer.view());
  EXPECT_TRUE(tracker_->reason().empty());
  EXPECT_TRUE(watch_frames(20)) << tracker_->reason();
  EXPECT_TRUE(tracker_->service().ok());
  // Of the commands in Qualisys' protocol, those that ask. No other one was sent.
  for (const char* command : {"TakeControl", "ReleaseControl", "New", "Close", "Start", "Stop", "Load", "Save",
                              "LoadProject", "Calibrate", "SetQTMEvent", "Trig", "Reprocess", "Led", "QTM_Settings"}) {
    EXPECT_EQ(cell_->heard().find(command), std::string::npos) << command;
  }
}

TEST_P(TrackerContract, FramesComeInOrderWithTimesThatGoOn) {
  ASSERT_NO_FATAL_FAILURE(connect());
  MarkerFrame last;
  int frames = 0;
  const auto check = [&] {
    EXPECT_LE(frame_.t_capture, frame_.t_arrival);
    EXPECT_LE(frame_.t_arrival, now());
    EXPECT_EQ(frame_.count, cell_->marker_count);
    EXPECT_EQ(frame_.body.visible, cell_->has_body);
    if (frames > 0) {
      EXPECT_GT(frame_.frame_number, last.frame_number);
      EXPECT_GT(frame_.t_capture, last.t_capture);
      EXPECT_GE(frame_.t_arrival, last.t_arrival);
      EXPECT_EQ(frame_.label_epoch, last.label_epoch);
    }
    last = frame_;
    return ++frames >= 100;
  };
  EXPECT_TRUE(watch(check)) << tracker_->reason();
  std::this_thread::sleep_for(milliseconds(250));  // the loop is late once: frames have piled up
  EXPECT_TRUE(watch([&] { return check() && frames >= 150; })) << tracker_->reason();
}

TEST_P(TrackerContract, AHiddenMarkerIsInvisibleAndNeverAtTheOrigin) {
  ASSERT_NO_FATAL_FAILURE(connect());
  int hidden = 0, shown = 0;
  const auto check = [&] {
    for (std::size_t i = 0; i < frame_.count; ++i) {
      const Marker& marker = frame_.markers[i];
      if (!marker.visible) continue;
      EXPECT_TRUE(marker.p_W.allFinite() && marker.p_W.norm() > 0.1) << marker.p_W.transpose();
    }
    ++(frame_.markers[TrackerCell::kHiddenSlot].visible ? shown : hidden);
    EXPECT_TRUE(frame_.markers[0].visible);
    return true;
  };
  EXPECT_TRUE(watch([&] { return check() && shown >= 20; })) << tracker_->reason();
  EXPECT_EQ(hidden, 0);
  cell_->hide(true);
  EXPECT_TRUE(watch([&] { return check() && hidden >= 20; })) << tracker_->reason();
  shown = 0;
  EXPECT_TRUE(watch([&] { return check() && hidden >= 40; })) << tracker_->reason();
  EXPECT_EQ(shown, 0);
  cell_->hide(false);
  EXPECT_TRUE(watch([&] { return check() && shown >= 20; })) << tracker_->reason();
}

TEST_P(TrackerContract, ANewSessionIsANewEpoch) {
  ASSERT_NO_FATAL_FAILURE(connect());
  ASSERT_TRUE(watch_frames(5)) << tracker_->reason();
  const auto epoch = frame_.label_epoch;
  ASSERT_NO_FATAL_FAILURE(connect());  // ends the present one
  ASSERT_TRUE(watch_frames(5)) << tracker_->reason();
  EXPECT_NE(frame_.label_epoch, epoch);
}

TEST_P(TrackerContract, ReadNeverWaitsNorTakesHeap) {
  ASSERT_NO_FATAL_FAILURE(connect());
  ASSERT_TRUE(watch_frames(5)) << tracker_->reason();
  int frames = 0;
  std::uint64_t allocations = 0;
  for (const TimePoint end = now() + kPatience; frames < 50 && now() < end;) {
    static_cast<void>(transport::wait_readable(info_.fd, now() + milliseconds(20)));
    IoStatus status = IoStatus::kEmpty;
    allocations += effort_of([&] { status = tracker_->read(frame_); }).allocations;
    frames += status == IoStatus::kDone ? 1 : 0;
  }
  EXPECT_EQ(frames, 50) << tracker_->reason();
  EXPECT_EQ(allocations, 0U);

  cell_->hush();
  for (TimePoint quiet = now() + milliseconds(100); now() < quiet;) {
    if (turn() == IoStatus::kDone) quiet = now() + milliseconds(100);
  }
  Effort reads{Duration::max(), 0};
  for (int attempt = 0; attempt < 3 && reads.time > milliseconds(200); ++attempt) {
    int wrong = 0;
    reads = effort_of([&] {
      for (int i = 0; i < 1000; ++i) wrong += tracker_->read(frame_) == IoStatus::kEmpty ? 0 : 1;
    });
    EXPECT_EQ(wrong, 0) << tracker_->reason();
  }
  EXPECT_LE(to_seconds(reads.time), 0.2);
  EXPECT_EQ(reads.allocations, 0U);
}

TEST_P(TrackerContract, AHangUpEndsTheSessionInTimeAndForGood) {
  if (!cell_->no_line.empty()) GTEST_SKIP() << cell_->no_line;
  ASSERT_NO_FATAL_FAILURE(connect());
  ASSERT_TRUE(watch_frames(5)) << tracker_->reason();
  const auto epoch = frame_.label_epoch;
  cell_->cut();
  const auto lost = time_to_loss(false);
  ASSERT_TRUE(lost) << "the loss was never noticed";
  EXPECT_LE(to_seconds(*lost), to_seconds(cell_->hang_up_bound + kSlack));
  expect_sentence(tracker_->reason());
  cell_->restore();
  const std::string reason(tracker_->reason());
  for (int i = 0; i < 50; ++i) EXPECT_EQ(tracker_->read(frame_), IoStatus::kDisconnected);
  EXPECT_EQ(tracker_->reason(), reason);
  ASSERT_NO_FATAL_FAILURE(connect());
  EXPECT_TRUE(tracker_->reason().empty());
  EXPECT_TRUE(watch_frames(20)) << tracker_->reason();
  EXPECT_NE(frame_.label_epoch, epoch);
}

TEST_P(TrackerContract, ASilentSensorEndsTheSessionInTime) {
  if (!cell_->no_line.empty()) GTEST_SKIP() << cell_->no_line;
  ASSERT_NO_FATAL_FAILURE(connect());
  ASSERT_TRUE(watch_frames(5)) << tracker_->reason();
  cell_->hush();
  const auto lost = time_to_loss(true);
  ASSERT_TRUE(lost) << "the loss was never noticed";
  EXPECT_LE(to_seconds(*lost), to_seconds(cell_->silence_bound + kSlack));
  expect_sentence(tracker_->reason());
  cell_->restore();
  ASSERT_NO_FATAL_FAILURE(connect());
  EXPECT_TRUE(watch_frames(20)) << tracker_->reason();
}

TEST_P(TrackerContract, AnAbsentSensorIsAnErrorUntilItIsThere) {
  EXPECT_EQ(tracker_->read(frame_), IoStatus::kDisconnected);
  EXPECT_FALSE(tracker_->service().ok());
  if (!cell_->no_line.empty()) GTEST_SKIP() << cell_->no_line;
  cell_->cut();
  expect_absent([&] { return try_to_connect(); });
  EXPECT_EQ(tracker_->read(frame_), IoStatus::kDisconnected);
  cell_->restore();
  cell_->hush();
  expect_absent([&] { return try_to_connect(); });
  EXPECT_EQ(tracker_->read(frame_), IoStatus::kDisconnected);
  cell_->restore();
  ASSERT_NO_FATAL_FAILURE(connect());
  EXPECT_TRUE(watch_frames(20)) << tracker_->reason();
}

TEST_P(TrackerContract, RubbishAtWorstEndsTheSession) {
  SCOPED_TRACE(kContractSeed);
  std::mt19937 random(kContractSeed);
  ASSERT_NO_FATAL_FAILURE(connect());
  int losses = 0;
  for (int round = 0; round < 40; ++round) {
    cell_->babble(random);
    IoStatus status = IoStatus::kEmpty;
    for (int i = 0; i < 10 && status != IoStatus::kDisconnected; ++i) {
      status = turn();
      if (status != IoStatus::kDone) continue;
      EXPECT_EQ(frame_.count, cell_->marker_count);
      EXPECT_TRUE(frame_.markers[0].visible && frame_.markers[0].p_W.norm() < 10.0);
    }
    if (status != IoStatus::kDisconnected) continue;
    expect_sentence(tracker_->reason());
    ++losses;
    ASSERT_NO_FATAL_FAILURE(expect_recovery([&] { return try_to_connect(); }));
  }
  std::printf("%s: %d sessions ended in 40 rounds of rubbish\n", GetParam().name, losses);
  ASSERT_NO_FATAL_FAILURE(connect());
  EXPECT_TRUE(watch_frames(20)) << tracker_->reason();
}

TEST_P(TrackerContract, ServiceRunsBesideRead) {
  ASSERT_NO_FATAL_FAILURE(connect());
  std::atomic<bool> leave{false};
  std::atomic<int> rounds{0}, failures{0};
  std::thread upkeep([&] {
    while (!leave) {
      failures += tracker_->service().ok() ? 0 : 1;
      ++rounds;
      std::this_thread::sleep_for(milliseconds(1));
    }
  });
  int frames = 0;
  const bool ended = !watch([&] { return ++frames < 0; }, std::chrono::seconds(1)) && !tracker_->reason().empty();
  leave = true;
  upkeep.join();
  EXPECT_FALSE(ended) << tracker_->reason();
  EXPECT_GT(frames, 20);
  EXPECT_GT(rounds, 0);
  EXPECT_EQ(failures, 0);
}

INSTANTIATE_TEST_SUITE_P(Every, TrackerContract,
                         ::testing::Values(TrackerKind{"QtmTcpLittleEndian", qtm_little_endian},
                                           TrackerKind{"QtmTcpBigEndian", qtm_big_endian},
                                           TrackerKind{"QtmUdp", qtm_udp}, TrackerKind{"QtmRigidBody", qtm_rigid_body},
                                           TrackerKind{"LandmarksUdp", landmarks_udp}),
                         [](const auto& kind) { return kind.param.name; });

}  // namespace
}  // namespace embody::test
