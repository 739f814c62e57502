// The shipped robot hands side by side, on the synthetic motion, on
// pinches and on a real recording where there is one: time, joint
// steps beside those of the published implementation, point errors; what solving Mia's three coupled fingers together
// is worth; and what each option of the objective gains and costs. Prints tables: figures of docs/embodiment.md.
//   hands_bench [RECORDING.tsv]
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include "core/embodiment/segments.hpp"
#include "core/hand/synthetic_motion.hpp"
#include "daemon/app/config_io.hpp"
#include "daemon/app/models.hpp"
#include "daemon/evaluate/embodiment_evaluation.hpp"
#include "daemon/evaluate/recorded_frames.hpp"
#include "drivers/recording/tsv_recording.hpp"

namespace embody {
namespace {

constexpr double kDegrees = 180.0 / 3.14159265358979323846;

struct Hand {
  const char* name;
  const char* published_step_deg;  ///< largest joint step per 10 ms of the published implementation
};
constexpr std::array<Hand, 4> kHands{
    {{"mia", "6-14"}, {"shadow", "21-73"}, {"robotiq_2f140", "9"}, {"barrett", "43-58"}}};

[[noreturn]] void give_up(const Error& error) {
  std::fprintf(stderr, "hands_bench: %s\n", std::string(error.detail.view()).c_str());
  std::exit(1);
}

EmbodimentConfig hand_config(const std::string& name) {
  const auto hand = config::load_hand(EMBODY_SOURCE_DIR "/config/hands/" + name + ".toml");
  if (!hand) give_up(hand.error());
  return hand->embodiment;
}

EmbodimentMapping make(const EmbodimentConfig& config) {
  auto mapping = make_embodiment(config);
  if (!mapping) give_up(mapping.error());
  return std::move(*mapping);
}

double mean(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value;
  return values.empty() ? std::nan("") : sum / static_cast<double>(values.size());
}

double or_nan(std::optional<double> value) {
  return value.value_or(std::nan(""));
}

double mean_of_fingers(const evaluate::EmbodimentSummary& summary) {
  std::vector<double> fingers;
  for (const auto& value : summary.residual_mm) {
    if (value) fingers.push_back(*value);
  }
  return mean(fingers);
}

evaluate::EmbodimentSummary judge(const EmbodimentMapping& mapping, const std::vector<HandState>& states) {
  return evaluate::summarise(mapping.config().name, evaluate::evaluate_embodiment(mapping, states, false, {}));
}

/// Sum of the squared distances of all points, without the options' terms, mean over the frames, mm^2.
double mean_cost_mm2(EmbodimentMapping mapping, const std::vector<HandState>& states) {
  std::vector<double> costs;
  FingerTarget target;
  for (const HandState& state : states) {
    mapping.step(state, target);
    if (!target.valid) continue;
    double sum_mm2 = 0.0;
    for (const double residual_m : target.residual_m) sum_mm2 += 2e6 * residual_m * residual_m;
    costs.push_back(sum_mm2);
  }
  return mean(costs);
}

void compare_hands(const std::vector<HandState>& states) {
  std::printf("%-16s %9s %8s %8s %8s %9s %9s %9s %10s %10s\n", "hand", "us p50", "p99", "max", "step p50", "p99",
              "max deg", "published", "error mm", "cost mm2");
  for (const Hand& hand : kHands) {
    const EmbodimentMapping mapping = make(hand_config(hand.name));
    const auto s = judge(mapping, states);
    std::printf("%-16s %9.1f %8.1f %8.1f %8.3f %9.2f %9.2f %9s %10.2f %10.0f\n", hand.name, or_nan(s.solve_us.p50),
                or_nan(s.solve_us.p99), or_nan(s.solve_us.max), or_nan(s.joint_step_deg.p50),
                or_nan(s.joint_step_deg.p99), or_nan(s.joint_step_deg.max), hand.published_step_deg, mean_of_fingers(s),
                mean_cost_mm2(mapping, states));
  }
}

/// Middle, ring and little finger of Mia: one solve against the mean of three (as published), same couplings.
void compare_with_averaging(const std::vector<HandState>& states) {
  EmbodimentMapping together = make(hand_config("mia"));
  std::vector<EmbodimentMapping> alone;
  for (std::size_t f = 2; f < kFingers; ++f) {
    EmbodimentConfig one = hand_config("mia");
    for (std::size_t other = 0; other < kFingers; ++other) {
      if (other != f) one.fingers[other] = {};
    }
    alone.push_back(make(one));
  }
  const auto& motors = together.motor_names();
  const auto shared = static_cast<std::size_t>(std::find(motors.begin(), motors.end(), "j_mrl_fle") - motors.begin());
  std::vector<double> gain_mm, apart_deg;
  FingerTarget target, single;
  for (const HandState& state : states) {
    together.step(state, target);
    if (!target.valid) continue;
    double sum_rad = 0.0, least = 10.0, most = -10.0;
    for (EmbodimentMapping& mapping : alone) {
      mapping.step(state, single);
      const double r = single.q_rad[shared];
      sum_rad += r;
      least = std::min(least, r);
      most = std::max(most, r);
    }
    auto averaged_rad = target.q_rad;
    averaged_rad[shared] = sum_rad / static_cast<double>(alone.size());
    const auto rms_mm = [&](const std::array<double, kMaxHandJoints>& r_rad) {
      const auto g_P = together.finger_points(r_rad);
      double sum_m2 = 0.0;
      for (std::size_t f = 2; f < kFingers; ++f) {
        for (std::size_t i = 0; i < 2; ++i) sum_m2 += (together.X_PM() * state.p_M[f][i] - g_P[f][i]).squaredNorm();
      }
      return 1e3 * std::sqrt(sum_m2 / 6.0);
    };
    gain_mm.push_back(rms_mm(averaged_rad) - rms_mm(target.q_rad));
    apart_deg.push_back(kDegrees * (most - least));
  }
  std::printf(
      "Mia, middle to little finger: root mean square of their six points, averaging minus together: mean %.3f mm, "
      "p99 %.3f, max %.3f, least %.1e; the three solutions are %.1f degrees apart on average\n",
      mean(gain_mm), or_nan(evaluate::quantile(gain_mm, 0.99)), or_nan(evaluate::quantile(gain_mm, 1.0)),
      or_nan(evaluate::quantile(gain_mm, 0.0)), mean(apart_deg));
}

/// What the options are about.
struct Gains {
  std::vector<double> direction_deg;   ///< between the last phalanges of person and robot, all fingers
  std::vector<double> pinch_error_mm;  ///< of the gap thumb to finger, where the person's is below 20 mm
  std::vector<double> gap_mm;          ///< least gap of two finger tips of the robot in each frame
};

double human_gap_m(const HandState& state, std::size_t finger) {
  constexpr double kThumbRadius_m = 0.0095, kFingerRadius_m = 0.0075;  // as EmbodimentMapping takes them
  const auto& thumb = state.distal_M[0];
  const auto& other = state.distal_M[finger];
  const NearestPoints near = nearest_points(thumb[0], thumb[1], other[0], other[1]);
  return (near.on_b - near.on_a).norm() - kThumbRadius_m - kFingerRadius_m;
}

void add_frame(const EmbodimentMapping& mapping, const HandState& state, const FingerTarget& target, Gains& gains) {
  constexpr double kPinching_m = 0.02;
  robot::HandKinematics::Workspace links;
  mapping.kinematics().update(target.q_rad, links);
  double least_m = 1.0;
  for (std::size_t f = 0; f < kFingers; ++f) {
    const FingerPoints& points = mapping.config().fingers[f];
    if (points.link.empty()) continue;
    const ContactPad& pad = points.pads.front();
    const auto link = mapping.kinematics().model().find_link(pad.link);
    const Eigen::Vector3d robot_P = links.X_PL[*link].linear() * (pad.to_m - pad.from_m).normalized();
    const Eigen::Vector3d human_P =
        mapping.X_PM().linear() * (state.distal_M[f][1] - state.distal_M[f][0]).normalized();
    gains.direction_deg.push_back(kDegrees * std::acos(std::clamp(robot_P.dot(human_P), -1.0, 1.0)));
    for (std::size_t other = f + 1; other < kFingers; ++other) {
      if (mapping.config().fingers[other].link.empty()) continue;
      const double gap_m = mapping.pad_gap_m(static_cast<Finger>(f), static_cast<Finger>(other), target.q_rad);
      least_m = std::min(least_m, gap_m);
      if (f != 0) continue;
      const double human_m = human_gap_m(state, other);
      if (human_m < kPinching_m) gains.pinch_error_mm.push_back(1e3 * std::abs(gap_m - std::max(human_m, 0.0)));
    }
  }
  gains.gap_mm.push_back(1e3 * least_m);
}

struct Option {
  const char* name;
  double orientation_m, pinch_m, temporal_m_rad, collision_margin_m;
};
constexpr std::array<Option, 6> kOptions{{{"none", 0, 0, 0, 0},
                                          {"orientation_m = 0.02", 0.02, 0, 0, 0},
                                          {"pinch_m = 0.03", 0, 0.03, 0, 0},
                                          {"temporal_m_rad = 0.01", 0, 0, 0.01, 0},
                                          {"collision_margin_m = 0.002", 0, 0, 0, 0.002},
                                          {"all four", 0.02, 0.03, 0.01, 0.002}}};

void judge_option(const Hand& hand, const Option& option, const std::vector<HandState>& states) {
  EmbodimentConfig config = hand_config(hand.name);
  config.orientation_m = option.orientation_m;
  config.pinch_m = option.pinch_m;
  config.temporal_m_rad = option.temporal_m_rad;
  config.collision_margin_m = option.collision_margin_m;
  EmbodimentMapping mapping = make(config);
  const auto s = judge(mapping, states);
  Gains gains;
  FingerTarget target;
  for (const HandState& state : states) {
    mapping.step(state, target);
    if (target.valid) add_frame(mapping, state, target, gains);
  }
  const auto close = std::count_if(gains.gap_mm.begin(), gains.gap_mm.end(), [](double mm) { return mm < 1.95; });
  std::printf("%-14s %-27s %8.2f %8.1f %8.2f %7zu %8.2f %6td %8.3f %7.2f %8.2f %8.1f %7.1f\n", hand.name, option.name,
              mean_of_fingers(s), mean(gains.direction_deg), mean(gains.pinch_error_mm), gains.pinch_error_mm.size(),
              or_nan(evaluate::quantile(gains.gap_mm, 0.0)), close, or_nan(s.joint_step_deg.p50),
              or_nan(s.joint_step_deg.p99), or_nan(s.joint_step_deg.max), or_nan(s.solve_us.p50),
              or_nan(s.solve_us.p99));
}

void compare_options(const std::vector<HandState>& states) {
  std::printf("%-14s %-27s %8s %8s %8s %7s %8s %6s %8s %7s %8s %8s %7s\n", "hand", "option", "error mm", "tips deg",
              "pinch mm", "fingers", "gap mm", "< 2 mm", "step p50", "p99", "max deg", "us p50", "p99");
  for (const Hand& hand : kHands) {
    for (const Option& option : kOptions) judge_option(hand, option, states);
  }
  std::printf("\n");
}

void compare(const std::string& what, const std::vector<HandState>& states) {
  std::printf("%s, %zu frames\n\n", what.c_str(), states.size());
  compare_hands(states);
  std::printf("\n");
  compare_with_averaging(states);
  std::printf("\n");
  compare_options(states);
}

/// Thumb and each other finger meet and part again, a second each: the record mapping's answer to tip markers that move
/// from their places in the synthetic motion's first frame to a common point and back. M is the world.
std::vector<HandState> pinches(const OperatorModels& models) {
  const hand::SyntheticMotion motion;
  const HandState rest = evaluate::hand_states(models, {motion.frame(0).markers}).front();
  const Eigen::Vector3d towards_palm_m(0.0, -0.03, 0.0);
  hand::FingerEstimator fingers(models.hand_model(), models.layout, models.fingers);
  std::vector<HandState> states;
  HandPose pose;
  pose.valid = true;
  for (std::size_t k = 0; k < 400; ++k) {
    const std::size_t finger = 1 + k / 100;
    const double closed = 0.5 - 0.5 * std::cos(2.0 * 3.14159265358979323846 * static_cast<double>(k % 100) / 100.0);
    const Eigen::Vector3d meeting_M = 0.5 * (rest.p_M[0][0] + rest.p_M[finger][0]) + towards_palm_m;
    MarkerFrame frame;
    frame.frame_number = k + 1;
    frame.t_capture = TimePoint{std::chrono::milliseconds(10) * (k + 1)};
    frame.count = models.layout.names.size();
    for (const hand::FingerMarker& marker : models.layout.finger_markers) {
      const auto f = static_cast<std::size_t>(marker.finger);
      const bool pinching = f == 0 || f == finger;
      const bool tip = marker.point == 0;
      if (pinching && !tip) continue;  // the tip leads
      Eigen::Vector3d p_M = rest.p_M[f][tip ? 0 : 1];
      if (pinching) p_M += closed * (meeting_M - p_M);
      frame.markers[marker.slot] = {p_M, true};
    }
    pose.sequence = k;
    pose.frame_number = frame.frame_number;
    pose.t_capture = frame.t_capture;
    states.emplace_back();
    fingers.step(frame, pose, states.back());
  }
  return states;
}

int run(const std::string& file) {
  const auto config = config::load_config(EMBODY_SOURCE_DIR "/config/embody.toml");
  if (!config) give_up(config.error());
  const auto models = make_operator_models(*config);
  if (!models) give_up(models.error());
  const hand::SyntheticMotion motion;
  std::vector<MarkerFrame> frames;
  for (std::size_t k = 0; k < motion.frame_count(); ++k) frames.push_back(motion.frame(k).markers);
  compare("synthetic motion", evaluate::hand_states(*models, frames));
  std::printf("pinches\n\n");
  compare_options(pinches(*models));
  if (!std::filesystem::exists(file)) return 0;
  const auto recording = recording::load_tsv(file);
  if (!recording) give_up(recording.error());
  const auto real = evaluate::marker_frames(*recording, models->layout, {});
  if (!real) give_up(real.error());
  compare(std::filesystem::path(file).filename().string(), evaluate::hand_states(*models, *real));
  return 0;
}

}  // namespace
}  // namespace embody

int main(int argc, char** argv) {
  return embody::run(argc > 1 ? argv[1] : EMBODY_SOURCE_DIR "/../shared/data/small_pillow.tsv");
}
