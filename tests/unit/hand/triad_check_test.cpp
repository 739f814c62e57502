#include "core/hand/triad_check.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "core/math/pose.hpp"
#include "tests/support/heap_counter.hpp"
#include "tests/unit/hand/real_recording.hpp"
#include "tests/unit/math/random_values.hpp"

namespace embody::hand {
namespace {

using Eigen::Vector3d;

constexpr TriadEdges kEdges{.0552, .0447, .0324};

/// Top, left, right marker with the given edges, somewhere.
Triad triad(const TriadEdges& edges_m, test::RandomValues& random, double noise_m = 0.0) {
  const double z = (edges_m[1] * edges_m[1] + edges_m[2] * edges_m[2] - edges_m[0] * edges_m[0]) / (2.0 * edges_m[1]);
  const Pose X = math::pose_from(random.vector<3>(-1.0, 1.0), random.rotation(3.0));
  Triad p{X * Vector3d(0.0, 0.0, edges_m[1]), X * Vector3d(std::sqrt(edges_m[2] * edges_m[2] - z * z), 0.0, z),
          X * Vector3d(0.0, 0.0, 0.0)};
  for (Vector3d& point : p) point += noise_m * random.vector<3>(-1.0, 1.0);
  return p;
}

/// p[i] becomes the point of label order[i].
Triad relabelled(const Triad& p, const std::array<std::size_t, 3>& order) {
  return {p[order[0]], p[order[1]], p[order[2]]};
}

constexpr std::array<std::array<std::size_t, 3>, 5> kExchanges{{{1, 0, 2}, {2, 1, 0}, {0, 2, 1}, {1, 2, 0}, {2, 0, 1}}};

TEST(TriadCheck, AcceptsTheCalibratedTriadWhereverItIsAndSaysHowWellItFits) {
  test::RandomValues random(101);
  TriadCheck check(kEdges);
  EXPECT_FALSE(check.learning());
  EXPECT_FALSE(check.ambiguous());
  for (int i = 0; i < 1'000; ++i) {
    Triad p = triad(kEdges, random, .0005);
    const Triad before = p;
    ASSERT_EQ(check.step(p), TriadState::kGood) << "triad " << i;
    ASSERT_EQ(p, before);
    ASSERT_LT(check.error_m(), .0018);
    double sum_m2 = 0.0;
    for (std::size_t e = 0; e < 3; ++e) sum_m2 += std::pow(check.edges_m()[e] - kEdges[e], 2);
    ASSERT_NEAR(check.error_m(), std::sqrt(sum_m2 / 3.0), 1e-12);
  }
}

TEST(TriadCheck, PutsExchangedLabelsInOrderWhicheverOfTheFiveWaysTheyAreExchanged) {
  test::RandomValues random(102);
  TriadCheck check(kEdges);
  for (int i = 0; i < 200; ++i) {
    for (const auto& exchange : kExchanges) {
      const Triad truth = triad(kEdges, random, .0005);
      Triad p = relabelled(truth, exchange);
      ASSERT_EQ(check.step(p), TriadState::kRelabelled);
      ASSERT_EQ(p, truth) << "triad " << i;
      ASSERT_LT(check.error_m(), .0018);
    }
  }
}

TEST(TriadCheck, RefusesATriadOfAnotherShape) {
  test::RandomValues random(103);
  TriadCheck check(kEdges);
  for (int i = 0; i < 1'000; ++i) {
    Triad p = triad(kEdges, random);
    p[static_cast<std::size_t>(i) % 3] += random(.02, .3) * random.vector<3>(-1.0, 1.0).normalized();
    TriadEdges edges_m{(p[0] - p[1]).norm(), (p[0] - p[2]).norm(), (p[1] - p[2]).norm()};
    TriadEdges sorted = edges_m;
    std::sort(sorted.begin(), sorted.end());
    const bool fits_somehow = std::abs(sorted[0] - kEdges[2]) <= .004 && std::abs(sorted[1] - kEdges[1]) <= .004 &&
                              std::abs(sorted[2] - kEdges[0]) <= .004;
    if (fits_somehow) continue;
    ASSERT_EQ(check.step(p), TriadState::kWrong) << "triad " << i;
    ASSERT_FALSE(check.usable());
    ASSERT_GT(check.error_m(), 0.0);
  }
}

TEST(TriadCheck, DoesNotExchangeLabelsOfATriadWithTwoNearlyEqualEdges) {
  constexpr TriadEdges kIsosceles{.0500, .0510, .0300};
  test::RandomValues random(104);
  TriadCheck check(kIsosceles);
  EXPECT_TRUE(check.ambiguous());
  for (int i = 0; i < 200; ++i) {
    const Triad truth = triad(kIsosceles, random, .0003);
    Triad p = relabelled(truth, {0, 2, 1});
    const Triad given = p;
    ASSERT_EQ(check.step(p), TriadState::kGood) << "an exchange that edges do not tell";
    ASSERT_EQ(p, given);
    p = relabelled(truth, {1, 0, 2});  // two exchanges would explain this one
    ASSERT_EQ(check.step(p), TriadState::kWrong) << "triad " << i;
  }
}

TEST(TriadCheck, LearnsAnUnknownShapeFromTheFirstFramesThatAgree) {
  test::RandomValues random(105);
  TriadCheck check(TriadEdges{});
  for (int i = 0; i < 5; ++i) {
    Triad odd = triad({.060, .045, .030}, random);
    ASSERT_EQ(check.step(odd), TriadState::kLearning);
  }
  for (int i = 0; i < 19; ++i) {
    Triad p = triad(kEdges, random, .0001);
    ASSERT_EQ(check.step(p), TriadState::kLearning) << i;
    ASSERT_TRUE(check.usable());
    ASSERT_TRUE(check.learning());
    ASSERT_EQ(check.error_m(), 0.0);
    if (i % 4 == 0) check.missing();
  }
  Triad p = triad(kEdges, random, .0001);
  ASSERT_EQ(check.step(p), TriadState::kGood);
  EXPECT_FALSE(check.learning());
  for (std::size_t e = 0; e < 3; ++e) EXPECT_NEAR(check.reference_m()[e], kEdges[e], 2e-4);
}

TEST(TriadCheck, NeverLearnsAgainAndSaysWhenTheShapeChangedForGood) {
  constexpr TriadEdges kMoved{.0640, .0447, .0390};
  test::RandomValues random(106);
  TriadCheck calibrated(kEdges), learnt(TriadEdges{});
  for (int i = 0; i < 30; ++i) {
    Triad p = triad(kEdges, random, .0001);
    learnt.step(p);
  }
  ASSERT_FALSE(learnt.learning());
  for (TriadCheck* check : {&calibrated, &learnt}) {
    const TriadEdges reference = check->reference_m();
    for (int i = 1; i <= 500; ++i) {
      Triad p = triad(kMoved, random, .0001);
      ASSERT_EQ(check->step(p), i < 100 ? TriadState::kWrong : TriadState::kChanged) << i;
      ASSERT_FALSE(check->usable());
    }
    EXPECT_EQ(check->reference_m(), reference);
    Triad wild = triad({.080, .060, .050}, random);
    EXPECT_EQ(check->step(wild), TriadState::kWrong) << "not the shape that it had changed to";
    Triad p = triad(kEdges, random, .0001);
    EXPECT_EQ(check->step(p), TriadState::kGood) << "put back";
  }
}

TEST(TriadCheck, SurvivesWhatIsNoTriad) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  test::RandomValues random(107);
  for (const double value : {kNan, std::numeric_limits<double>::infinity(), 1e200, 1e-300, 0.0}) {
    TriadCheck known(kEdges), learning(TriadEdges{.05, kNan, .03});
    for (int i = 0; i < 200; ++i) {
      Triad p;
      for (Vector3d& point : p) point = value * random.vector<3>(-1.0, 1.0);
      ASSERT_FALSE((known.step(p), known.usable())) << value;
      ASSERT_FALSE((learning.step(p), learning.usable())) << value;
    }
    Triad p = triad(kEdges, random);
    EXPECT_EQ(known.step(p), TriadState::kGood);
    EXPECT_EQ(learning.step(p), TriadState::kLearning);
  }
}

TEST(TriadCheck, DoesNotTouchTheHeap) {
  test::RandomValues random(108);
  TriadCheck check(TriadEdges{});
  std::vector<Triad> triads;
  for (int i = 0; i < 100; ++i) triads.push_back(relabelled(triad(kEdges, random), {0, 1, 2}));
  const std::uint64_t before = test::heap_allocations();
  for (Triad& p : triads) check.step(p);
  EXPECT_EQ(test::heap_allocations(), before);
}

TEST(TriadCheck, LearnsTheRealTriadAndAcceptsAllOfItsFrames) {
  const GloveLayout glove = paper_glove();
  const auto frames = test::read_recording(EMBODY_SOURCE_DIR "/../shared/data/small_pillow.tsv", glove);
  if (frames.empty()) GTEST_SKIP() << "the real recording ../shared/data/small_pillow.tsv is not here";
  TriadCheck check(glove.back_edges_m);
  double worst_m = 0.0;
  for (std::size_t k = 0; k < frames.size(); ++k) {
    Triad p{frames[k].markers[0].p_W, frames[k].markers[1].p_W, frames[k].markers[2].p_W};
    const TriadState state = check.step(p);
    ASSERT_EQ(state, k < 19 ? TriadState::kLearning : TriadState::kGood) << "frame " << k + 1;
    worst_m = std::max(worst_m, check.error_m());
  }
  EXPECT_LT(worst_m, .001) << "the triad breathes by less than a millimetre";
  EXPECT_GT(worst_m, .0001);
  EXPECT_FALSE(check.ambiguous());
}

}  // namespace
}  // namespace embody::hand
