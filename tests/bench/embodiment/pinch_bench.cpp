// Do pinches close? For each hand and finger: a human hand whose thumb and finger tip touch, what the robot's surfaces
// do then with and without pinch preservation, and whether they could touch at all.
//   pinch_bench [PINCH_MM]
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "core/embodiment/segments.hpp"
#include "core/hand/finger_estimator.hpp"
#include "daemon/app/config_io.hpp"
#include "daemon/app/models.hpp"
#include "tests/unit/math/random_values.hpp"

namespace embody {
namespace {

constexpr double kThumbRadius = 0.0095, kFingerRadius = 0.0075;  // as in embodiment_mapping.cpp

/// The human hand with the angles of each finger.
HandState state_of(const hand::HandModel& model, const std::array<hand::Vector9, kFingers>& q_rad) {
  HandState state;
  state.valid = true;
  state.quality.fill(FingerQuality::kOptimal);
  state.confidence.fill(1.0);
  for (std::size_t f = 0; f < kFingers; ++f) {
    const auto finger = static_cast<Finger>(f);
    const hand::FingerChain chain = model.chain(finger, q_rad[f]);
    state.p_M[f] = {model.point(finger, 0, chain), model.point(finger, 1, chain)};
    state.distal_M[f] = model.distal(finger, chain);
  }
  return state;
}

double human_gap_m(const HandState& state, std::size_t finger) {
  const auto near =
      nearest_points(state.distal_M[0][0], state.distal_M[0][1], state.distal_M[finger][0], state.distal_M[finger][1]);
  return (near.on_b - near.on_a).norm() - kThumbRadius - kFingerRadius;
}

/// Angles with which thumb and finger touch with their tips: random descent from a half closed hand.
std::array<hand::Vector9, kFingers> pinch_posture(const hand::HandModel& model, std::size_t finger) {
  const hand::FingerEstimatorConfig config;
  test::RandomValues random(100 + finger);
  std::array<hand::Vector9, kFingers> q;
  for (std::size_t f = 0; f < kFingers; ++f) q[f] << 0, 0, .3, 0, 0, .4, 0, 0, .27;
  q[0] << .1, .2, .1, .1, .1, .1, 0, 0, .2;
  q[finger] << 0, 0, .7, 0, 0, .8, 0, 0, .5;
  const auto cost = [&](const std::array<hand::Vector9, kFingers>& at) {
    const HandState state = state_of(model, at);
    const double gap = human_gap_m(state, finger);
    const double tips = (state.distal_M[0][1] - state.distal_M[finger][1]).norm();  // with the tips, not the shafts
    return 1e6 * gap * gap + 1e3 * tips * tips + 1e-2 * (at[0].squaredNorm() + at[finger].squaredNorm());
  };
  double least = cost(q);
  double reach = 0.3;
  for (int i = 0; i < 40000; ++i) {
    auto trial = q;
    for (const std::size_t f : {std::size_t{0}, finger}) {
      trial[f] += reach * random.vector<9>(-1.0, 1.0);
      if (f != 0) trial[f](0) = trial[f](3) = trial[f](4) = trial[f](6) = trial[f](7) = 0.0;
      trial[f] = trial[f].cwiseMax(config.lower_rad[f]).cwiseMin(config.upper_rad[f]);
    }
    if (const double c = cost(trial); c < least) {
      least = c;
      q = trial;
    } else {
      reach = std::max(0.999 * reach, 1e-4);
    }
  }
  return q;
}

/// Distance of the robot's surfaces where they look at each other: the line between them leaves both pads within 60
/// degrees of where they face. Infinite elsewhere: fingers that cross with their sides do not pinch.
double pinch_gap_m(const EmbodimentMapping& mapping, Finger finger, const std::vector<double>& r) {
  robot::HandKinematics::Workspace links;
  mapping.kinematics().update(r, links);
  std::array<std::array<Eigen::Vector3d, 2>, 2> axis;
  std::array<Eigen::Vector3d, 2> facing;
  for (std::size_t i = 0; i < 2; ++i) {
    const ContactPad& pad = mapping.config().fingers[i == 0 ? 0 : static_cast<std::size_t>(finger)].pads.front();
    const Pose& X_PL = links.X_PL[*mapping.kinematics().model().find_link(pad.link)];
    axis[i] = {X_PL * pad.from_m, X_PL * pad.to_m};
    facing[i] = X_PL.linear() * pad.facing.normalized();
  }
  const auto near = nearest_points(axis[0][0], axis[0][1], axis[1][0], axis[1][1]);
  const Eigen::Vector3d along = (near.on_b - near.on_a).normalized();
  const bool meet = along.dot(facing[0]) > 0.5 && along.dot(facing[1]) < -0.5;
  return meet ? mapping.pad_gap_m(Finger::kThumb, finger, r) : HUGE_VAL;
}

/// Least distance of the robot's pads over all its postures.
double least_gap_m(const EmbodimentMapping& mapping, Finger finger) {
  test::RandomValues random(7);
  double least = HUGE_VAL;
  std::vector<double> best;
  for (int i = 0; i < 20000; ++i) {
    std::vector<double> r;
    for (std::size_t m = 0; m < mapping.motor_count(); ++m) {
      r.push_back(random(mapping.lower_rad(m), mapping.upper_rad(m)));
    }
    const double gap = pinch_gap_m(mapping, finger, r);
    if (!(gap < least)) continue;
    least = gap;
    best = r;
  }
  for (int i = 0; i < 4000 && !best.empty(); ++i) {
    std::vector<double> r = best;
    for (std::size_t m = 0; m < r.size(); ++m) {
      const double width = 0.05 * (mapping.upper_rad(m) - mapping.lower_rad(m));
      r[m] = std::clamp(r[m] + random(-width, width), mapping.lower_rad(m), mapping.upper_rad(m));
    }
    const double gap = pinch_gap_m(mapping, finger, r);
    if (gap < least) least = gap, best = r;
  }
  return least;
}

struct Sweep {
  double gap_mm{0.0};      // when the human's gap is 0
  double deepest_mm{0.0};  // least gap on the way
  double step_deg{0.0};    // largest step of a motor on the way, per 1/100 of it
};

/// From the open hand to the pinch.
Sweep sweep(EmbodimentMapping mapping, const hand::HandModel& model, const std::array<hand::Vector9, kFingers>& pinch,
            Finger finger) {
  constexpr int kSteps = 100;
  Sweep out{0.0, HUGE_VAL, 0.0};
  FingerTarget target, last;
  for (int k = 0; k <= kSteps; ++k) {
    auto q = pinch;
    for (auto& angles : q) angles *= static_cast<double>(k) / kSteps;
    HandState state = state_of(model, q);
    state.t_capture = TimePoint{std::chrono::milliseconds(10 * (k + 1))};
    mapping.step(state, target);
    const double gap_mm = 1e3 * mapping.pad_gap_m(Finger::kThumb, finger, target.q_rad);
    out.deepest_mm = std::min(out.deepest_mm, gap_mm);
    out.gap_mm = gap_mm;
    for (std::size_t m = 0; k > 0 && m < target.joint_count; ++m) {
      out.step_deg = std::max(out.step_deg, std::abs(target.q_rad[m] - last.q_rad[m]) * 57.29577951308232);
    }
    last = target;
  }
  return out;
}

void print_hand(const std::string& name, double pinch_m) {
  const auto hand = config::load_hand(name);
  if (!hand) return static_cast<void>(std::fprintf(stderr, "%s\n", hand.error().detail.c_str()));
  const hand::HandModel model;
  for (std::size_t f = 1; f < kFingers; ++f) {
    const auto finger = static_cast<Finger>(f);
    if (hand->embodiment.fingers[f].link.empty()) continue;
    EmbodimentConfig config = hand->embodiment;
    const auto off = make_embodiment(config);
    config.pinch_m = pinch_m;
    const auto on = make_embodiment(config);
    if (!off || !on) return static_cast<void>(std::fprintf(stderr, "%s\n", off.error().detail.c_str()));
    const auto pinch = pinch_posture(model, f);
    const Sweep without = sweep(*off, model, pinch, finger), with = sweep(*on, model, pinch, finger);
    const double least_mm = 1e3 * least_gap_m(*on, finger);
    std::printf("  %-14s %-7s %8.2f   %8s   %8.2f   %8.2f %8.2f   %8.2f %8.2f\n", name.c_str(), kFingerNames[f],
                1e3 * human_gap_m(state_of(model, pinch), f), least_mm > 0.0 ? "no" : "yes", without.gap_mm,
                with.gap_mm, with.deepest_mm, without.step_deg, with.step_deg);
  }
}

}  // namespace
}  // namespace embody

int main(int argc, char** argv) {
  const double pinch_mm = argc > 1 ? std::atof(argv[1]) : 20.0;
  std::printf(
      "surface distance of thumb and finger, mm, at the end of a sweep from the open hand to a human pinch;\n"
      "largest motor step per hundredth of the sweep, degrees\n");
  std::printf("  %-14s %-7s %8s   %8s   %8s   %8s %8s   %8s %8s\n", "hand", "finger", "human", "can touch", "without",
              "with", "deepest", "step w/o", "with");
  for (const char* name : {"mia", "shadow", "robotiq_2f140", "barrett"}) embody::print_hand(name, 1e-3 * pinch_mm);
  return 0;
}
