#include "drivers/sim/qtm/studio.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/sim_qtm/support.hpp"

namespace embody::sim {
namespace {

const std::vector<std::string> kNames{"hand_top", "hand_left", "hand_right", "ring_tip", "middle_tip"};

/// A studio that runs on made-up time: frame k has markers at (i, k / 8, 1) mm, the triad spans a plane.
class Bench {
 public:
  explicit Bench(QtmServerConfig config = {}, std::optional<std::size_t> frames = {}, double rate_hz = 100.0)
      : studio(*Studio::build(config, motion(frames, rate_hz))) {
    (void)studio.measurement().begin();
    studio.start(TimePoint{});
  }
  static Motion motion(std::optional<std::size_t> frames, double rate_hz) {
    Motion made = test::counting_motion(kNames, rate_hz, frames);
    made.generate = [inner = made.generate](std::size_t frame, std::span<Marker> markers) {
      inner(frame, markers);
      markers[0].p_W.z() += 0.05;
    };
    return made;
  }
  void act(std::string_view words) {
    const auto fault = parse_qtm_fault(words);
    ASSERT_TRUE(fault.ok()) << fault.error().detail.c_str();
    const Status status = studio.act(*fault, now());
    ASSERT_TRUE(status.ok()) << status.error().detail.c_str();
  }
  Errc refusal(std::string_view words) { return studio.act(*parse_qtm_fault(words), now()).error().code; }
  TimePoint now() const { return TimePoint{} + from_seconds(static_cast<double>(studio.tick()) / 100.0); }
  /// The next frame that is delivered, in place of which `lost` were lost.
  const FrameData& next(int* lost = nullptr) {
    for (Studio::Step step = studio.step(); step != Studio::Step::kFrame; step = studio.step()) {
      if (step == Studio::Step::kEnded) break;
      if (lost != nullptr) ++*lost;
    }
    return studio.frame();
  }
  /// Which marker label `label` shows, -1 when it is missing.
  int shown(std::size_t label) const {
    const Marker& marker = studio.frame().markers[label];
    return marker.visible ? static_cast<int>(std::lround(1e3 * marker.p_W.x())) : -1;
  }
  Studio studio;
};

TEST(Studio, PlaysTheMotionWithItsClock) {
  Bench bench({}, 50);
  for (std::uint32_t k = 0; k < 50; ++k) {
    EXPECT_EQ(*bench.studio.t_next(), TimePoint{} + std::chrono::milliseconds(10 * k));
    const FrameData& frame = bench.next();
    EXPECT_EQ(frame.frame_number, k + 1);
    EXPECT_EQ(frame.timestamp_us, 10'000U * k);
    for (std::size_t i = 0; i < kNames.size(); ++i) EXPECT_EQ(bench.shown(i), static_cast<int>(i));
    EXPECT_TRUE(frame.unlabelled.empty());
    ASSERT_EQ(frame.bodies.size(), 1U);
    EXPECT_TRUE(frame.bodies[0].tracked);
  }
  EXPECT_EQ(bench.studio.step(), Studio::Step::kEnded);
}

TEST(Studio, StartsTimeAndNumbersAgainWhenItLoops) {
  QtmServerConfig config;
  config.loop = true;
  Bench bench(config, 7);
  for (std::uint32_t k = 0; k < 30; ++k) {
    const FrameData& frame = bench.next();
    EXPECT_EQ(frame.frame_number, k % 7 + 1);
    EXPECT_EQ(frame.timestamp_us, 10'000U * (k % 7));
    EXPECT_EQ(bench.studio.frame_index(), k % 7);
  }
}

TEST(Studio, DropsAMarkerForSoManyFrames) {
  Bench bench;
  bench.next();
  bench.act("drop ring_tip 5");
  for (int k = 0; k < 10; ++k) {
    bench.next();
    EXPECT_EQ(bench.shown(3), k < 5 ? -1 : 3) << k;
    EXPECT_EQ(bench.shown(4), 4);
  }
}

TEST(Studio, OpensAGapEveryThreeSeconds) {
  Bench bench;
  bench.act("gap ring_tip 30");
  for (int k = 0; k < 900; ++k) {
    bench.next();
    ASSERT_EQ(bench.shown(3), k % 300 < 30 ? -1 : 3) << k;
  }
  bench.act("gap ring_tip 0");
  bench.next();
  EXPECT_EQ(bench.shown(3), 3);
}

TEST(Studio, LosesTheTriadAndWithItTheBody) {
  Bench bench;
  bench.act("triad_loss 20");
  for (int k = 0; k < 25; ++k) {
    const FrameData& frame = bench.next();
    EXPECT_EQ(frame.bodies[0].tracked, k >= 20);
    for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(frame.markers[i].visible, k >= 20);
    EXPECT_EQ(bench.shown(3), 3);
  }
}

TEST(Studio, LosesTheBodyWhenOneOfItsMarkersIsMissing) {
  Bench bench;
  bench.act("hide hand_left");
  EXPECT_FALSE(bench.next().bodies[0].tracked);
  bench.act("show hand_left");
  EXPECT_TRUE(bench.next().bodies[0].tracked);
}

TEST(Studio, DisplacesAMarkerUntilItIsShownAgain) {
  Bench bench;
  bench.act("step ring_tip 9");
  for (int k = 0; k < 5; ++k) {
    bench.next();
    EXPECT_EQ(bench.shown(3), 3 + 9);
  }
  bench.act("step ring_tip 0");
  bench.next();
  EXPECT_EQ(bench.shown(3), 3);
}

TEST(Studio, SwapsReordersAddsRemovesAndRenamesLabels) {
  Bench bench;
  bench.act("swap ring_tip middle_tip");
  bench.next();
  EXPECT_EQ(bench.shown(3), 4);
  EXPECT_EQ(bench.shown(4), 3);
  EXPECT_EQ(bench.studio.setup().labels, kNames) << "a swap is not in the label list";
  bench.act("swap middle_tip ring_tip");
  bench.act("reorder");
  bench.next();
  EXPECT_EQ(bench.studio.setup().labels, std::vector<std::string>(kNames.rbegin(), kNames.rend()));
  for (std::size_t i = 0; i < 5; ++i) EXPECT_EQ(bench.shown(i), 4 - static_cast<int>(i));
  bench.act("add_label new");
  EXPECT_EQ(bench.next().markers.size(), 6U);
  EXPECT_EQ(bench.shown(5), -1);
  bench.act("remove_label middle_tip");
  EXPECT_EQ(bench.next().markers.size(), 5U);
  EXPECT_EQ(bench.shown(0), 3);
  bench.act("rename_label ring_tip finger");
  EXPECT_EQ(bench.studio.setup().labels[0], "finger");
  bench.act("drop finger 1");
  bench.next();
  EXPECT_EQ(bench.shown(0), -1) << "also known by its new name";
}

TEST(Studio, RefusesFaultsOfWhatIsNotThere) {
  Bench bench;
  for (const char* words :
       {"hide nobody", "drop nobody 1", "ghost nobody", "swap ring_tip nobody", "swap nobody ring_tip",
        "remove_label nobody", "rename_label nobody x", "unlabel nobody 3"}) {
    EXPECT_EQ(bench.refusal(words), Errc::kNotFound) << words;
  }
  EXPECT_EQ(bench.refusal("add_label ring_tip"), Errc::kInvalidArgument);
  for (std::size_t i = 0; i + 1 < kNames.size(); ++i) bench.act("remove_label " + kNames[i]);
  EXPECT_EQ(bench.refusal("remove_label middle_tip"), Errc::kInvalidArgument);
  Studio bodiless = *Studio::build({}, test::counting_motion({"a"}, 100.0, {}));
  EXPECT_EQ(bodiless.act(*parse_qtm_fault("triad_loss 3"), TimePoint{}).error().code, Errc::kNotFound);
}

TEST(Studio, KeepsAnUnidentifiedMarkerInViewUnderOneNumber) {
  Bench bench;
  bench.act("unlabel ring_tip 3");
  std::uint32_t id = 0;
  for (int k = 0; k < 3; ++k) {
    const FrameData& frame = bench.next();
    EXPECT_EQ(bench.shown(3), -1);
    ASSERT_EQ(frame.unlabelled.size(), 1U);
    if (k > 0) {
      EXPECT_EQ(frame.unlabelled[0].id, id);
    }
    id = frame.unlabelled[0].id;
    EXPECT_NEAR(frame.unlabelled[0].p_W.x(), 3e-3, 1e-12);
  }
  EXPECT_TRUE(bench.next().unlabelled.empty());
  bench.act("unlabel ring_tip 3");
  EXPECT_NE(bench.next().unlabelled[0].id, id) << "a new trajectory has a new number";
}

TEST(Studio, LosesAllMarkersScalesAndStates) {
  Bench bench;
  bench.act("nan 2");
  for (int k = 0; k < 4; ++k) {
    const FrameData& frame = bench.next();
    EXPECT_EQ(frame.markers[0].visible, k >= 2);
    EXPECT_EQ(frame.bodies[0].tracked, k >= 2);
  }
  const Eigen::Vector3d p_W = bench.next().bodies[0].X_WB.translation();
  bench.act("scale 0.001");
  const FrameData& small = bench.next();
  EXPECT_NEAR(small.markers[4].p_W.x(), 4e-6, 1e-12);
  EXPECT_NEAR(small.bodies[0].X_WB.translation().x(), 1e-3 * p_W.x(), 1e-9);
  EXPECT_NEAR(small.bodies[0].X_WB.translation().z(), 1e-3 * p_W.z(), 1e-9);
  bench.act("residual 2.5");
  bench.act("camera_link 20 30");
  EXPECT_NEAR(bench.next().residual_m, 0.0025, 1e-12);
  EXPECT_EQ(bench.studio.frame().drop_rate_permille, 20);
  EXPECT_EQ(bench.studio.frame().out_of_sync_permille, 30);
  bench.act("uncalibrated");
  bench.act("axis +Y");
  EXPECT_FALSE(bench.studio.setup().calibrated);
  EXPECT_EQ(bench.studio.setup().axis, "+Y");
  bench.act("uncalibrated off");
  EXPECT_TRUE(bench.studio.setup().calibrated);
}

TEST(Studio, ResetsTimeStampsAndFreezesNumbers) {
  Bench bench;
  for (int k = 0; k < 5; ++k) bench.next();
  bench.act("timestamp_reset");
  for (std::uint32_t k = 0; k < 5; ++k) {
    EXPECT_EQ(bench.next().timestamp_us, 10'000U * k);
    EXPECT_EQ(bench.studio.frame().frame_number, k + 1);
  }
  bench.act("frozen_frame_number on");
  for (int k = 0; k < 5; ++k) EXPECT_EQ(bench.next().frame_number, 1U);
  bench.act("frozen_frame_number off");
  EXPECT_EQ(bench.next().frame_number, 11U);
}

TEST(Studio, SkipsFramesAndLowersTheRate) {
  Bench bench;
  bench.act("skip 5");
  for (int k = 0; k < 80; ++k) EXPECT_NE(bench.next().frame_number % 5, 0U);
  EXPECT_EQ(bench.studio.tick(), 99U);
  bench.act("skip 0");
  bench.act("rate 40");
  const std::size_t before = bench.studio.tick();
  for (int k = 0; k < 400; ++k) bench.next();
  EXPECT_NEAR(static_cast<double>(bench.studio.tick() - before), 1000.0, 3.0);
  bench.act("rate 0");
  int lost = 0;
  for (int k = 0; k < 10; ++k) bench.next(&lost);
  EXPECT_LE(lost, 2);
}

TEST(Studio, LosesTheFramesOfAPauseButHoldsBackThoseOfAStall) {
  Bench bench;
  bench.next();
  bench.act("pause 95");
  int lost = 0;
  EXPECT_EQ(bench.next(&lost).frame_number, 12U);
  EXPECT_EQ(lost, 10);
  const TimePoint t_stall = bench.now();
  bench.act("stall 200");
  for (std::uint32_t k = 0; k < 20; ++k) {
    EXPECT_EQ(*bench.studio.t_next(), t_stall + std::chrono::milliseconds(200)) << "all at once";
    EXPECT_EQ(bench.next().frame_number, 13 + k);
  }
}

TEST(Studio, ANewMeasurementStartsAtTheBeginningAndEndsFaultsCountedInFrames) {
  Bench bench;
  for (int k = 0; k < 20; ++k) bench.next();
  bench.act("drop ring_tip 1000");
  bench.act("hide middle_tip");
  bench.studio.start(TimePoint{});
  EXPECT_EQ(bench.next().frame_number, 1U);
  EXPECT_EQ(bench.shown(3), 3);
  EXPECT_EQ(bench.shown(4), -1);
}

TEST(Studio, ChecksAScriptAgainstTheNamesItWillFind) {
  Bench bench;
  const auto check = [&](const char* text) { return bench.studio.check(*parse_fault_script(text, 100.0)); };
  EXPECT_TRUE(check("10 add_label x\n20 swap x ring_tip\n30 rename_label x y\n40 remove_label y").ok());
  const auto late = check("10 hide ring_tip\n5 remove_label x\n7 add_label x");
  ASSERT_FALSE(late.ok());
  EXPECT_NE(late.error().detail.view().find("line 2: "), std::string_view::npos) << late.error().detail.c_str();
  bench.next();
  EXPECT_EQ(bench.shown(3), 3) << "a check has no effect";
}

TEST(Studio, RefusesMotionsAndBodiesThatDoNotHoldTogether) {
  QtmServerConfig config;
  config.bodies = {{"b", {"a", "b", "c"}, {}}};
  EXPECT_FALSE(Studio::build(config, test::counting_motion({"a", "b"}, 100.0, 5)).ok());
  for (const double rate_hz : {0.0, -1.0, std::nan(""), 1e9}) {
    EXPECT_FALSE(Studio::build({}, test::counting_motion({"a"}, rate_hz, 5)).ok()) << rate_hz;
  }
  EXPECT_FALSE(Studio::build({}, test::counting_motion({}, 100.0, 5)).ok());
  EXPECT_FALSE(Studio::build({}, test::counting_motion({"a"}, 100.0, 0)).ok());
  EXPECT_FALSE(Studio::build({}, test::counting_motion({"a", "a"}, 100.0, 5)).ok());
  recording::Recording ragged{100.0, {"a"}, {{{}}, {}}, "ragged", ""};
  EXPECT_FALSE(Studio::build({}, motion_of(ragged)).ok());
}

}  // namespace
}  // namespace embody::sim
