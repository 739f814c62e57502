#include "core/hand/marker_guard.hpp"

#include <algorithm>
#include <cmath>

namespace embody::hand {
namespace {

using Eigen::Vector3d;

constexpr Duration kUsualStep = std::chrono::milliseconds(10);
constexpr Duration kLongestStep = std::chrono::milliseconds(500);
constexpr double kDoubtedGateShare = 1.0 / 3.0;
constexpr std::uint32_t kTrialsOfAnExchange = 10;
constexpr std::size_t kFewestForReference = 4;
constexpr std::size_t kFewestForSlip = 3;
constexpr Duration kSlipLearning = std::chrono::seconds(5);
constexpr double kSlipSeconds = 2.0;

template <std::size_t N>
double median(StaticVector<double, N>& values) noexcept {
  auto* middle = values.begin() + values.size() / 2;
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

double posture_residual_m(FingerProblem problem, const MarkerTrial& trial, int max_iterations,
                          double tolerance) noexcept {
  const FingerMeasurement candidate{trial.point, trial.p_M, 1.0};
  auto* same = std::find_if(problem.markers.begin(), problem.markers.end(),
                            [&](const FingerMeasurement& marker) { return marker.point == trial.point; });
  if (same != problem.markers.end()) {
    *same = candidate;
  } else if (!problem.markers.push_back(candidate)) {
    return HUGE_VAL;
  }
  problem.temporal_m_rad.setZero();
  const FingerSolution solution = solve_own(problem, max_iterations, tolerance);
  if (solution.status == SolveStatus::kInvalid) return HUGE_VAL;
  const FingerChain chain = problem.model->chain(problem.finger, solution.q_rad);
  double farthest_m = 0.0;
  for (const FingerMeasurement& marker : problem.markers) {
    farthest_m = std::max(farthest_m, (problem.model->point(problem.finger, marker.point, chain) - marker.p_M).norm());
  }
  return farthest_m;
}

MarkerGuard::MarkerGuard(const HandModel& model, const GloveLayout& glove, const MarkerGuardConfig& config) noexcept
    : config_(config) {
  entry_of_slot_.fill(kNobody);
  for (const FingerMarker& marker : glove.finger_markers) {
    if (marker.slot >= kMaxMarkers || marker.point >= model.point_count(marker.finger)) continue;
    if (entry_of_slot_[marker.slot] != kNobody) continue;
    const Vector3d knuckle_M = model.rest_joints()[first_joint(marker.finger)];
    const FingerChain straight = model.chain(marker.finger, Vector9::Zero());
    const double length_m = (model.point(marker.finger, marker.point, straight) - knuckle_M).norm();
    Entry entry;
    entry.marker = marker;
    entry.track = MarkerTrack(knuckle_M, length_m + config.reach_margin_m);
    entry.source = entries_.size();
    entry_of_slot_[marker.slot] = static_cast<std::uint8_t>(entries_.size());
    entries_.push_back(entry);
  }
}

void MarkerGuard::step(const MarkerFrame& frame, const HandPose& hand_pose, CheckedMarkers& out) noexcept {
  judge_slip();
  step_time(frame.t_capture);
  drop_unexplained();
  read(frame, hand_pose);
  trial_.reset();
  if (hand_pose.valid) {
    follow_reference();
    keep_sources();
    exchange();
    place_rest();
    ask();
  }
  report(out);
}

/// Time since the last frame, kept within reason (clocks may stand or jump), and the gate that goes with it.
void MarkerGuard::step_time(TimePoint t_capture) noexcept {
  const bool running = t_last_ > TimePoint{} && t_capture > t_last_;
  dt_ = running ? std::min(t_capture - t_last_, kLongestStep) : kUsualStep;
  t_last_ = t_capture;
  const double dt_s = to_seconds(dt_);
  gate_m_ = std::min(config_.step_m + config_.acceleration_m_s2 * dt_s * dt_s, config_.largest_gate_m);
}

/// How near to its expected place marker `i` must be under label `k`.
double MarkerGuard::gate_m(std::size_t i, std::size_t k) const noexcept {
  if (i != k && entries_[i].source != k) return config_.relabel_m;
  const bool doubted = i == k && entries_[i].track.goes_on(entries_[k].p_M, gate_m_, dt_);
  return doubted ? kDoubtedGateShare * gate_m_ : gate_m_;
}

/// Labels of the frame, in M; without a hand pose nothing is seen.
void MarkerGuard::read(const MarkerFrame& frame, const HandPose& hand_pose) noexcept {
  const Pose X_MW = hand_pose.X_WM.inverse();
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    Entry& entry = entries_[i];
    entry.seen = entry.taken = entry.placed = false;
    if (hand_pose.valid && entry.marker.slot < frame.count && frame.markers[entry.marker.slot].visible) {
      entry.p_M = X_MW * frame.markers[entry.marker.slot].p_W;
      entry.seen = entry.p_M.allFinite();
    }
    entry.track.advance(dt_, entry.seen, config_);
    if (!entry.track.known()) entry.source = i;
  }
}

/// When the markers jump together it is the frame of the back of the hand that moved under them (its markers are the
/// short end of a lever): the predictions move along by the median.
void MarkerGuard::follow_reference() noexcept {
  std::array<StaticVector<double, kMost>, 3> difference_m;
  for (const Entry& entry : entries_) {
    const Entry& label = entries_[entry.source];
    if (!label.seen || !entry.track.known()) continue;
    const Vector3d d = label.p_M - entry.track.predicted_M();
    for (std::size_t axis = 0; axis < 3; ++axis) difference_m[axis].push_back(d(static_cast<Eigen::Index>(axis)));
  }
  if (difference_m[0].size() < kFewestForReference) return;
  const Vector3d shift_M(median(difference_m[0]), median(difference_m[1]), median(difference_m[2]));
  const double shift_m = shift_M.norm();
  if (!(shift_m >= 0.5 * gate_m_ && shift_m <= config_.largest_gate_m)) return;
  for (Entry& entry : entries_) entry.track.shift(shift_M);
}

void MarkerGuard::place(std::size_t marker, std::size_t label) noexcept {
  Entry& entry = entries_[marker];
  if (entry.source != label) {
    entry.trials = 0;
    entry.advantage_m = 0.0;
  }
  entry.source = label;
  entry.placed = true;
  entries_[label].taken = true;
  entry.track.believe(entries_[label].p_M, config_);
}

/// Markers that are where they should be, under the label of the frame before.
void MarkerGuard::keep_sources() noexcept {
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    const std::size_t label = entries_[i].source;
    if (!entries_[label].seen || entries_[label].taken) continue;
    if (entries_[i].track.distance_m(entries_[label].p_M) <= gate_m(i, label)) place(i, label);
  }
}

/// Gives labels that jumped to the markers whose predicted places they jumped to, the nearest pair first.
void MarkerGuard::exchange() noexcept {
  for (std::size_t round = 0; round < entries_.size(); ++round) {
    std::size_t marker = kNobody, label = kNobody;
    double nearest_m = HUGE_VAL;
    for (std::size_t i = 0; i < entries_.size(); ++i) {
      if (entries_[i].placed || !entries_[i].track.known()) continue;
      for (std::size_t k = 0; k < entries_.size(); ++k) {
        if (!entries_[k].seen || entries_[k].taken) continue;
        const double distance_m = entries_[i].track.distance_m(entries_[k].p_M);
        if (!(distance_m <= gate_m(i, k)) || !(distance_m < nearest_m)) continue;
        nearest_m = distance_m;
        marker = i;
        label = k;
      }
    }
    if (marker == kNobody) return;
    place(marker, label);
  }
}

/// What is left: the first sight of a marker is believed, other places are doubted.
void MarkerGuard::place_rest() noexcept {
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    Entry& entry = entries_[i];
    if (entry.placed || !entry.seen || entry.taken) continue;
    if (!entry.track.known() && entry.track.reachable(entry.p_M)) {
      place(i, i);
    } else {
      entry.track.doubt(entry.p_M, gate_m_, dt_, config_);
    }
  }
}

/// A marker that no posture explains while it is believed; of the markers of one finger the farthest.
void MarkerGuard::drop_unexplained() noexcept {
  for (std::size_t finger = 0; finger < kFingers; ++finger) {
    Entry* worst = nullptr;
    for (Entry& entry : entries_) {
      if (static_cast<std::size_t>(entry.marker.finger) != finger) continue;
      if (entry.track.unexplained() < config_.ghost_frames) continue;
      if (worst == nullptr || entry.track.residual_m() > worst->track.residual_m()) worst = &entry;
    }
    if (worst == nullptr) continue;
    for (Entry& entry : entries_) {
      if (static_cast<std::size_t>(entry.marker.finger) == finger) entry.track.excuse();
    }
    worst->track.drop(config_);
    worst->source = entry_of_slot_[worst->marker.slot];
  }
}

/// One question per frame, the markers in turn: lasting jumps first, then whether exchanged labels had been right.
void MarkerGuard::ask() noexcept {
  for (const bool exchanged : {false, true}) {
    for (std::size_t n = 0; n < entries_.size(); ++n) {
      const std::size_t i = (asked_ + 1 + n) % entries_.size();
      const Entry& entry = entries_[i];
      const bool relabelled = entry.placed && entry.source != i && entry.seen && entry.track.reachable(entry.p_M);
      const bool doubted = entry.seen && !entry.placed && !entry.taken && entry.track.asks();
      if (exchanged ? !relabelled : !doubted) continue;
      asked_ = i;
      trial_ = MarkerTrial{entry.marker.slot, entry.marker.finger, entry.marker.point, entry.p_M};
      return;
    }
  }
}

void MarkerGuard::answer(double residual_m) noexcept {
  if (!trial_) return;
  Entry& entry = entries_[asked_];
  trial_.reset();
  if (!entry.placed) {
    double usual_m = 0.0;
    for (const Entry& other : entries_) {
      if (other.marker.finger == entry.marker.finger) usual_m = std::max(usual_m, other.track.usual_m());
    }
    entry.track.answer(residual_m, usual_m, config_);
    if (!entry.track.ghost()) entry.source = asked_;
    return;
  }
  const double gain_m = std::clamp(entry.track.residual_m() - residual_m, -0.1, 0.1);
  entry.trials = std::min(entry.trials + 1, kTrialsOfAnExchange);
  entry.advantage_m += (gain_m - entry.advantage_m) / static_cast<double>(entry.trials);
  undo_exchanges();
}

/// Takes exchanges back when the labels' own places fit better: the exchange had been there when the labels were first
/// seen and is over, or two markers were mistaken.
void MarkerGuard::undo_exchanges() noexcept {
  double sum_m = 0.0;
  std::size_t exchanged = 0;
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    if (entries_[i].source == i || !entries_[i].placed) continue;
    if (entries_[i].trials < kTrialsOfAnExchange) return;
    sum_m += entries_[i].advantage_m;
    ++exchanged;
  }
  if (exchanged == 0 || !(sum_m > config_.label_advantage_m * static_cast<double>(exchanged))) return;
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    if (entries_[i].source == i) continue;
    entries_[i].source = i;
    entries_[i].track.restart();
  }
}

void MarkerGuard::explain(std::size_t slot, const Vector3d& model_M, CheckedMarkers& out) noexcept {
  if (slot >= kMaxMarkers || entry_of_slot_[slot] == kNobody || !model_M.allFinite()) return;
  Entry& entry = entries_[entry_of_slot_[slot]];
  entry.track.explain(model_M, dt_, config_);
  if (!entry.placed) return;
  out.residual_m[slot] = entry.track.residual_m();
  sum_m_ += entry.track.residual_m();
  ++explained_;
}

void MarkerGuard::judge_slip() noexcept {
  if (explained_ >= kFewestForSlip) {
    const double mean_m = sum_m_ / static_cast<double>(explained_);
    if (learnt_ < kSlipLearning) {
      learnt_ += dt_;
      const double share = std::min(1.0, to_seconds(dt_) / to_seconds(learnt_));
      first_m_ += share * (mean_m - first_m_);
      recent_m_ = first_m_;
    } else {
      recent_m_ += std::min(1.0, to_seconds(dt_) / kSlipSeconds) * (mean_m - recent_m_);
    }
  }
  explained_ = 0;
  sum_m_ = 0.0;
}

double MarkerGuard::slip_m() const noexcept {
  return learnt_ < kSlipLearning ? 0.0 : std::max(0.0, recent_m_ - first_m_);
}

void MarkerGuard::report(CheckedMarkers& out) const noexcept {
  out.verdict.fill(MarkerVerdict::kNone);
  out.residual_m.fill(0.0);
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    const Entry& entry = entries_[i];
    const std::size_t slot = entry.marker.slot;
    out.source[slot] = static_cast<std::uint8_t>(entries_[entry.source].marker.slot);
    if (entry.placed) {
      out.verdict[slot] = entry.source == i ? MarkerVerdict::kUsed : MarkerVerdict::kRelabelled;
      out.p_M[slot] = entries_[entry.source].p_M;
    } else if (!entry.seen || entry.taken) {
      out.verdict[slot] = MarkerVerdict::kMissing;
    } else {
      out.verdict[slot] = entry.track.ghost() ? MarkerVerdict::kGhost : MarkerVerdict::kJumped;
      out.p_M[slot] = entry.p_M;
    }
  }
}

}  // namespace embody::hand
