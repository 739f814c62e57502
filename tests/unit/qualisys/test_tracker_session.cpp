// Versions, byte orders, rigid bodies, settings: what a session begins with, and what ends it.
#include <gtest/gtest.h>

#include "tests/unit/qualisys/tracker_bench.hpp"

namespace embody::qualisys {
namespace {

using test::Bytes;
using test::FakeQtmSettings;
using test::has;
using test::tell_fault;
using test::TrackerBench;

const char* kHandBody =
    "<Body><Name>table</Name><Enabled>false</Enabled></Body>"
    "<Body><Name> hand </Name><Enabled>true</Enabled><Data_origin X=\"0\">0</Data_origin></Body>";

QualisysConfig with_body(const char* name = "hand") {
  QualisysConfig config;
  config.rigid_body = name;
  return config;
}

FakeQtmSettings with_bodies(const char* xml = kHandBody) {
  FakeQtmSettings settings;
  settings.bodies_xml = xml;
  return settings;
}

TEST(TrackerSession, TakesTheNewestVersionThatQtmSpeaks) {
  for (int newest = 8; newest <= 28; ++newest) {
    FakeQtmSettings settings;
    settings.newest_minor = newest;
    TrackerBench bench(3, settings);
    ASSERT_TRUE(bench.connect().ok());
    const auto commands = bench.qtm->commands();
    EXPECT_EQ(commands.front(), "Version 1.25");
    const std::string agreed = "Version 1." + std::to_string(std::min(newest, 25));
    EXPECT_GE(std::count(commands.begin(), commands.end(), agreed), newest == 25 ? 2 : 1);
    bench.qtm->push_frame(bench.frame(1));
    bench.expect(1);
  }
}

TEST(TrackerSession, RefusesAQtmThatSpeaksNoVersionOfOurs) {
  FakeQtmSettings settings;
  settings.newest_minor = 7;
  TrackerBench bench(3, settings);
  const auto info = bench.tracker->connect();
  ASSERT_FALSE(info.ok());
  EXPECT_EQ(info.error().code, Errc::kUnsupported);
  EXPECT_TRUE(has(info.error().detail.view(), "from 1.25 down to 1.8")) << info.error().detail.view();
}

TEST(TrackerSession, SpeaksBothByteOrdersWholeAndByteByByte) {
  for (const auto order : {ByteOrder::kLittle, ByteOrder::kBig}) {
    for (const bool dribble : {false, true}) {
      FakeQtmSettings settings = with_bodies("<Body><Name>hand</Name></Body>");
      settings.order = order;
      settings.dribble = dribble;
      TrackerBench bench(3, settings, with_body());
      ASSERT_TRUE(bench.connect().ok());
      for (std::uint64_t k = 1; k <= 20; ++k) {
        bench.qtm->push_frame(bench.frame(k));
        bench.expect(k);
      }
      EXPECT_TRUE(bench.tracker->service().ok());
    }
  }
}

TEST(TrackerSession, NamesTheOtherByteOrderWhenItMeetsIt) {
  for (const auto order : {ByteOrder::kLittle, ByteOrder::kBig}) {
    FakeQtmSettings settings;
    settings.order = order;
    TrackerBench bench(3, settings);
    bench.config.byte_order = order == ByteOrder::kLittle ? ByteOrder::kBig : ByteOrder::kLittle;
    bench.tracker.emplace(bench.config, bench.names);
    const auto info = bench.tracker->connect();
    ASSERT_FALSE(info.ok());
    EXPECT_EQ(info.error().code, Errc::kMalformed);
    EXPECT_TRUE(has(info.error().detail.view(), "-endian port?")) << info.error().detail.view();
  }
}

TEST(TrackerSession, YieldsTheSameFramesWhereverTheStreamIsSplit) {
  for (const auto order : {ByteOrder::kLittle, ByteOrder::kBig}) {
    FakeQtmSettings settings;
    settings.order = order;
    TrackerBench bench(2, settings);
    ASSERT_TRUE(bench.connect().ok());
    std::uint64_t k = 0;
    const auto recorded = [&] {
      Bytes stream = test::wire_event(3, order);
      for (const auto& piece : {test::wire_data(bench.frame(++k), order), test::wire_no_more_data(order),
                                test::wire_text(1, "surprise", order), test::wire_data(bench.frame(++k), order)}) {
        stream.insert(stream.end(), piece.begin(), piece.end());
      }
      return stream;
    };
    const std::size_t size = recorded().size();
    for (std::size_t split = 0; split <= size; ++split) {
      const Bytes stream = recorded();
      const auto middle = stream.begin() + static_cast<std::ptrdiff_t>(split);
      MarkerFrame frame;
      bench.qtm->push({stream.begin(), middle});
      const auto patience = transport::now() + std::chrono::seconds(10);
      ASSERT_TRUE(split == 0 || transport::wait_readable(bench.fd, patience));
      std::vector<std::uint64_t> numbers;
      while (bench.tracker->read(frame) == IoStatus::kDone) numbers.push_back(frame.frame_number);
      bench.qtm->push({middle, stream.end()});
      while (numbers.size() < 2) {
        ASSERT_EQ(bench.next(frame), IoStatus::kDone) << "split behind byte " << split;
        numbers.push_back(frame.frame_number);
      }
      ASSERT_EQ(numbers, (std::vector<std::uint64_t>{k - 1, k})) << "split behind byte " << split;
    }
  }
}

TEST(TrackerSession, FollowsTheNamedBodyWhetherOrNotDisabledBodiesKeepTheirPlace) {
  for (const bool keep_place : {false, true}) {
    TrackerBench bench(3, with_bodies(), with_body());
    ASSERT_TRUE(bench.connect().ok());
    EXPECT_EQ(bench.qtm->commands().back(), "StreamFrames AllFrames 3DRes 6DRes");
    auto frame = bench.frame(5);
    if (keep_place) frame.parts[1].items.insert(frame.parts[1].items.begin(), test::wire_missing(13));
    bench.qtm->push_frame(frame);
    bench.expect(5);
    EXPECT_NEAR(bench.last.body.residual_m, 0.0005, 1e-9);
  }
}

TEST(TrackerSession, ReportsABodyThatIsNotTrackedAsNotVisible) {
  TrackerBench bench(3, with_bodies("<Body><Name>hand</Name></Body>"), with_body());
  ASSERT_TRUE(bench.connect().ok());
  auto wire = bench.frame(1);
  wire.parts[1].items = {test::wire_missing(13)};
  bench.qtm->push_frame(wire);
  MarkerFrame frame;
  ASSERT_EQ(bench.next(frame), IoStatus::kDone);
  EXPECT_FALSE(frame.body.visible);
  EXPECT_TRUE(frame.markers[0].visible);
}

TEST(TrackerSession, RefusesABodyThatCannotBeFollowed) {
  struct Case {
    const char* xml;
    const char* sentence;
  };
  for (const auto& [xml, sentence] :
       {Case{"", "no rigid body 'hand'"}, Case{"<Body><Name>hands</Name></Body>", "'hand' (similar: 'hands')"},
        Case{"<Body><Name>hand</Name><Enabled>false</Enabled></Body>", "is disabled"},
        Case{"<Body><Name>hand</Name><Data_origin>1</Data_origin></Body>", "relative to another body"},
        Case{"<Body><Name>hand</Name><Data_orientation>1</Data_orientation></Body>", "relative to another body"},
        Case{"<Body><Name>hand</Name></Body><Body><Name>hand</Name></Body>", "two rigid bodies"}}) {
    TrackerBench bench(3, with_bodies(xml), with_body());
    const auto info = bench.tracker->connect();
    ASSERT_FALSE(info.ok()) << xml;
    EXPECT_TRUE(has(info.error().detail.view(), sentence)) << info.error().detail.view();
  }
}

TEST(TrackerSession, LetsOptionalMarkersBeMissing) {
  TrackerBench bench;
  bench.names.push_back("hand_top");
  bench.tracker.emplace(bench.config, bench.names);
  EXPECT_FALSE(bench.tracker->connect().ok());
  bench.config.optional_markers = {"hand_top", "m0"};
  bench.tracker.emplace(bench.config, bench.names);
  ASSERT_TRUE(bench.connect().ok());
  bench.names.pop_back();
  bench.qtm->push_frame(bench.frame(1));
  MarkerFrame frame;
  ASSERT_EQ(bench.next(frame), IoStatus::kDone);
  ASSERT_EQ(frame.count, 4U);
  EXPECT_TRUE(frame.markers[0].visible);
  EXPECT_FALSE(frame.markers[3].visible);
}

TEST(TrackerSession, WarnsWhereQtmIsSetNotToSendWhatIsNeeded) {
  struct Case {
    const char* processing;
    const char* warning;
  };
  for (const auto& [processing, warning] :
       {Case{"<Tracking>2D</Tracking>", "3D tracking is off"}, Case{"<Tracking>False</Tracking>", "3D tracking is off"},
        Case{"<Tracking>3D</Tracking><AIM>false</AIM>", "AIM is off"},
        Case{"<Tracking>3D</Tracking><AIM>true</AIM><Track6DOF>false</Track6DOF>", "6DOF tracking is off"}}) {
    auto settings = with_bodies();
    settings.processing = processing;
    TrackerBench bench(3, settings, with_body());
    const auto info = bench.connect();
    ASSERT_TRUE(info.ok());
    EXPECT_TRUE(has(info->peer.view(), warning)) << info->peer.view();
  }
}

TEST(TrackerSession, RefusesToBeginWhileQtmCalibratesOrReprocesses) {
  for (const unsigned state : {6, 8, 14}) {
    FakeQtmSettings settings;
    settings.state = state;
    TrackerBench bench(3, settings);
    const auto info = bench.tracker->connect();
    ASSERT_FALSE(info.ok()) << state;
    EXPECT_EQ(info.error().code, Errc::kRefused);
    bench.qtm->change([](FakeQtmSettings& now) { now.state = 1; });
    EXPECT_TRUE(bench.connect().ok());
  }
}

TEST(TrackerSession, EndsAtEveryEventAfterWhichNothingIsCertain) {
  struct Case {
    unsigned event;
    const char* sentence;
  };
  for (const auto& [event, sentence] :
       {Case{2, "closed the connection to its cameras"}, Case{6, "calibrating"}, Case{7, "finished a calibration"},
        Case{8, "plays back"}, Case{12, "shutting down"}, Case{14, "reprocesses"}, Case{15, "finished reprocessing"}}) {
    TrackerBench bench;
    ASSERT_TRUE(bench.connect().ok());
    bench.qtm->push_frame(bench.frame(1));
    bench.expect(1);
    const auto begin = transport::now();
    bench.qtm->push(test::wire_event(event, ByteOrder::kLittle));
    bench.qtm->push_frame(bench.frame(2));
    MarkerFrame frame;
    EXPECT_EQ(bench.next(frame), IoStatus::kDisconnected) << "not one more frame after event " << event;
    EXPECT_TRUE(has(bench.tracker->reason(), sentence)) << bench.tracker->reason();
    tell_fault(("event " + std::to_string(event)).c_str(), transport::now() - begin, bench.tracker->reason(),
               "session ends; connects again and validates anew");
    EXPECT_TRUE(bench.connect().ok());
  }
}

TEST(TrackerSession, BeginsANewLabelEpochAtEventsThatMayChangeLabels) {
  QualisysConfig config;
  config.allow_playback = true;
  TrackerBench bench(3, {}, config);
  ASSERT_TRUE(bench.connect().ok());
  std::uint64_t k = 0;
  std::uint32_t epoch = 1;
  for (const unsigned event : {3, 4, 8, 9, 11}) {
    bench.qtm->push(test::wire_event(event, ByteOrder::kLittle));
    bench.qtm->push_frame(bench.frame(++k));
    bench.expect(k);
    EXPECT_EQ(bench.last.label_epoch, ++epoch) << "event " << event;
  }
  for (const unsigned event : {1, 5, 10, 13, 16, 99}) {
    bench.qtm->push(test::wire_event(event, ByteOrder::kLittle));
    bench.qtm->push_frame(bench.frame(++k));
    bench.expect(k);
    EXPECT_EQ(bench.last.label_epoch, epoch) << "event " << event;
  }
  EXPECT_EQ(bench.tracker->counters().doubtful_events, 5U);
}

TEST(TrackerSession, NoticesEveryChangeOfSettingsAtTheNextUpkeep) {
  using Change = std::function<void(FakeQtmSettings&)>;
  const std::pair<const char*, Change> changes[] = {
      {"label order", [](auto& now) { std::swap(now.labels[0], now.labels[1]); }},
      {"label added", [](auto& now) { now.labels.push_back("extra"); }},
      {"label removed", [](auto& now) { now.labels.pop_back(); }},
      {"label twice", [](auto& now) { now.labels[0] = now.labels[1]; }},
      {"upward axis", [](auto& now) { now.axis = "+Y"; }},
      {"not calibrated", [](auto& now) { now.calibration_time.clear(); }},
      {"calibrated again", [](auto& now) { now.calibration_time = "2021-08-27 09:00:00"; }},
      {"capture rate", [](auto& now) { now.rate_hz = 50.0; }},
      {"processing", [](auto& now) { now.processing = "<Tracking>3D</Tracking><AIM>false</AIM>"; }},
      {"rigid bodies", [](auto& now) { now.bodies_xml = "<Body><Name>hand</Name></Body>"; }},
      {"playback", [](auto& now) { now.state = 8; }},
      {"calibrating", [](auto& now) { now.state = 6; }},
  };
  for (const auto& [what, change] : changes) {
    auto config = with_body();
    config.reply_timeout = std::chrono::seconds(5);
    TrackerBench bench(3, with_bodies(), config);
    ASSERT_TRUE(bench.connect().ok());
    ASSERT_TRUE(bench.tracker->service().ok());
    bench.qtm->change(change);
    const auto begin = transport::now();
    const auto status = bench.tracker->service();
    ASSERT_FALSE(status.ok()) << what;
    MarkerFrame frame;
    bench.qtm->push_frame(bench.frame(1));
    EXPECT_EQ(bench.next(frame), IoStatus::kDisconnected) << what;
    tell_fault(
        what, transport::now() - begin, status.error().detail.view(),
        "time is from the upkeep that follows, which the daemon does once a second; session ends; connects again and "
        "validates anew");
  }
}

TEST(TrackerSession, EndsWhenTheNumberOfBodiesIsNotTheKnownOne) {
  TrackerBench bench(3, with_bodies(), with_body());
  ASSERT_TRUE(bench.connect().ok());
  auto wire = bench.frame(1);
  for (int i = 0; i < 2; ++i) wire.parts[1].items.push_back(test::wire_missing(13));
  bench.qtm->push_frame(wire);
  MarkerFrame frame;
  EXPECT_EQ(bench.next(frame), IoStatus::kDisconnected);
  EXPECT_TRUE(has(bench.tracker->reason(), "3 rigid bodies but lists 2")) << bench.tracker->reason();
}

TEST(TrackerSession, EndsWhenAComponentNeverComes) {
  TrackerBench bench(3, with_bodies(), with_body());
  ASSERT_TRUE(bench.connect().ok());
  for (std::uint64_t k = 1; k <= 250; ++k) {
    auto wire = bench.frame(k);
    wire.parts.pop_back();
    bench.qtm->push_frame(wire);
  }
  MarkerFrame frame;
  EXPECT_EQ(bench.next(frame), IoStatus::kDisconnected);
  EXPECT_TRUE(has(bench.tracker->reason(), "without 3D markers or 6D bodies")) << bench.tracker->reason();
}

}  // namespace
}  // namespace embody::qualisys
