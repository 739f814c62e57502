#include "daemon/loops/marker_watch.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace embody {
namespace {

using hand::MarkerVerdict;
using hand::TriadState;
using std::chrono::milliseconds;

constexpr std::size_t kThumbTip = 3;  // slots of the paper's glove
constexpr std::size_t kIndexTip = 5;
constexpr std::size_t kMiddleTip = 7;
constexpr std::size_t kLittleTip = 11;

/// A glove whose markers are all seen and used, 100 frames a second; each test spoils something.
class Watched {
 public:
  Watched() : glove(hand::paper_glove()), watch(glove) {
    report.tracked.frame.count = glove.names.size();
    for (std::size_t i = 0; i < glove.names.size(); ++i) {
      report.tracked.frame.markers[i] = {{0.01 * static_cast<double>(i), 0.0, 0.0}, true, 1.0F};
    }
    for (const auto& marker : glove.finger_markers) set(marker.slot, MarkerVerdict::kUsed);
    report.state.valid = true;
    report.tracked.back.checked = true;
    report.tracked.back.state = TriadState::kGood;
  }
  void set(std::size_t slot, MarkerVerdict verdict, std::size_t source = 0) {
    report.markers.verdict[slot] = verdict;
    report.markers.source[slot] = static_cast<std::uint8_t>(source);
  }
  void see(std::size_t slot, bool seen) { report.tracked.frame.markers[slot].visible = seen; }
  void swap(std::size_t a, std::size_t b) {
    set(a, MarkerVerdict::kRelabelled, b);
    set(b, MarkerVerdict::kRelabelled, a);
  }
  /// `frames` frames, of which the watch sees every second one, as the telemetry thread does.
  void run(int frames) {
    for (int i = 0; i < frames; ++i) {
      t += milliseconds(10);
      report.state.frame_number = ++report.tracked.frame.frame_number;
      report.tally.add(report.tracked, report.markers);
      if (i % 2 == 1) watch.add(report, t);
    }
  }
  /// Time goes on and no frame comes.
  void wait(Duration time) {
    for (const TimePoint end = t + time; t < end; t += milliseconds(20)) watch.add(report, t);
  }
  [[nodiscard]] std::vector<std::string> findings() const { return watch.view().findings; }

  hand::GloveLayout glove;
  FingerReport report;
  MarkerWatch watch;
  TimePoint t{std::chrono::seconds(100)};
};

using Sentences = std::vector<std::string>;

TEST(MarkerWatch, HasNothingToSayOfAGoodGlove) {
  Watched glove;
  glove.run(200);
  EXPECT_EQ(glove.findings(), Sentences{});
  const MarkersView view = glove.watch.view();
  EXPECT_EQ(view.frame_number, 200U);
  EXPECT_NEAR(static_cast<double>(view.frames), 100.0, 12.0) << "about a second";
  ASSERT_EQ(view.rows.size(), 13U);
  for (const MarkerRow& row : view.rows) {
    EXPECT_TRUE(row.seen);
    EXPECT_DOUBLE_EQ(row.seen_fraction, 1.0);
    EXPECT_EQ(row.verdict, MarkerVerdict::kUsed) << row.label;
  }
  EXPECT_EQ(view.rows[1].finger + " " + view.rows[1].point, "back left");
  EXPECT_EQ(view.rows[kIndexTip].finger + " " + view.rows[kIndexTip].point, "index tip");
}

TEST(MarkerWatch, CountsEveryFrameThatAMarkerWasSeenIn) {
  Watched glove;
  glove.run(200);
  for (int i = 0; i < 40; ++i) {  // three of four frames; the watch looks at every second one only
    glove.see(kThumbTip, true);
    glove.run(3);
    glove.see(kThumbTip, false);
    glove.run(1);
  }
  EXPECT_NEAR(glove.watch.view().rows[kThumbTip].seen_fraction, 0.75, 0.02);
  EXPECT_DOUBLE_EQ(glove.watch.view().rows[kIndexTip].seen_fraction, 1.0);
}

TEST(MarkerWatch, NamesTwoSwappedLabelsOnceAndForgetsThemASecondLater) {
  Watched glove;
  glove.run(100);
  glove.swap(kIndexTip, kMiddleTip);
  glove.run(50);
  EXPECT_EQ(glove.findings(), Sentences{"index_tip and middle_tip are probably swapped"});
  EXPECT_EQ(glove.watch.view().rows[kIndexTip].source, "middle_tip");
  glove.set(kIndexTip, MarkerVerdict::kUsed);
  glove.set(kMiddleTip, MarkerVerdict::kUsed);
  glove.run(150);
  EXPECT_EQ(glove.findings(), Sentences{});
}

TEST(MarkerWatch, NamesALabelThatTookTheMarkerOfAnotherOne) {
  Watched glove;
  glove.set(kIndexTip, MarkerVerdict::kRelabelled, kMiddleTip);
  glove.run(100);
  EXPECT_EQ(glove.findings(), Sentences{"the marker index_tip is probably the one labelled middle_tip"});
}

TEST(MarkerWatch, NamesGhostsAndJumps) {
  Watched glove;
  glove.set(kThumbTip, MarkerVerdict::kGhost);
  glove.set(kLittleTip, MarkerVerdict::kJumped);
  glove.run(100);
  EXPECT_EQ(glove.findings(), (Sentences{"thumb_tip follows something that is not the hand",
                                         "little_tip jumps farther than a finger moves and is not believed"}));
}

TEST(MarkerWatch, KeepsQuietAboutASingleOddFrame) {
  Watched glove;
  glove.run(100);
  glove.set(kThumbTip, MarkerVerdict::kGhost);
  glove.run(2);
  glove.set(kThumbTip, MarkerVerdict::kUsed);
  glove.run(50);
  EXPECT_EQ(glove.findings(), Sentences{});
}

TEST(MarkerWatch, NamesMarkersThatAreNotSeen) {
  Watched glove;
  glove.see(kLittleTip, false);
  glove.set(kLittleTip, MarkerVerdict::kMissing);
  glove.run(150);
  EXPECT_EQ(glove.findings(), Sentences{"little_tip is not seen"});
  glove.see(kLittleTip, true);
  glove.set(kLittleTip, MarkerVerdict::kUsed);
  glove.run(2);
  EXPECT_EQ(glove.findings(), Sentences{"little_tip is hardly seen"});
}

TEST(MarkerWatch, MeasuresTheTriangleOnTheBackWhereBothEndsAreSeen) {
  Watched glove;
  glove.run(10);
  const MarkersView view = glove.watch.view();
  EXPECT_NEAR(view.back.edges_m[0].value(), 0.01, 1e-12);
  EXPECT_NEAR(view.back.edges_m[1].value(), 0.02, 1e-12);
  EXPECT_NEAR(view.back.edges_m[2].value(), 0.01, 1e-12);
  glove.see(1, false);
  glove.report.state.valid = false;
  glove.report.tracked.back.state = TriadState::kMissing;
  glove.run(10);
  const MarkersView without_left = glove.watch.view();
  EXPECT_FALSE(without_left.back.edges_m[0].has_value());
  EXPECT_TRUE(without_left.back.edges_m[1].has_value());
  EXPECT_FALSE(without_left.back.edges_m[2].has_value());
  EXPECT_EQ(without_left.back.state, "missing");
}

TEST(MarkerWatch, NamesExchangedLabelsOnTheBack) {
  Watched glove;
  BackReport& back = glove.report.tracked.back;
  back.state = TriadState::kRelabelled;
  back.source = {0, 2, 1};
  glove.run(100);
  EXPECT_EQ(glove.findings(), Sentences{"back markers: hand_left and hand_right are swapped"});
  EXPECT_EQ(glove.watch.view().rows[1].source, "hand_right");
  EXPECT_EQ(glove.watch.view().rows[0].verdict, MarkerVerdict::kUsed);
  back.source = {1, 2, 0};
  glove.run(2);
  EXPECT_EQ(glove.findings(), Sentences{"back markers: the labels of all three are exchanged"});
}

TEST(MarkerWatch, NamesATriangleThatIsNotTheGloves) {
  Watched glove;
  glove.report.tracked.back.state = TriadState::kWrong;
  glove.run(200);
  EXPECT_EQ(glove.findings(),
            Sentences{"back markers: they do not form the glove's triangle, one of them is something else"});
  glove.report.tracked.back.state = TriadState::kChanged;
  glove.run(200);
  EXPECT_EQ(glove.findings(),
            Sentences{"back markers: their triangle has changed, a marker moved on the glove: calibrate again"});
  EXPECT_EQ(glove.watch.view().back.state, "changed");
}

TEST(MarkerWatch, ASensorWithoutBackMarkersHasNoTriangleToJudge) {
  Watched glove;
  glove.report.tracked.back = {};
  glove.run(200);
  EXPECT_EQ(glove.findings(), Sentences{});
  EXPECT_EQ(glove.watch.view().back.state, "fits");
}

TEST(MarkerWatch, SaysThatNoFrameComes) {
  const MarkerWatch fresh(hand::paper_glove());
  EXPECT_EQ(fresh.view().findings, Sentences{"no frame came from the tracker within the last second"});
  Watched glove;
  glove.run(200);
  glove.wait(milliseconds(1500));
  EXPECT_EQ(glove.findings(), Sentences{"no frame came from the tracker within the last second"});
  EXPECT_EQ(glove.watch.view().frames, 0U);
}

}  // namespace
}  // namespace embody
