#include "daemon/loops/marker_watch.hpp"

#include <algorithm>
#include <cmath>

namespace embody {
namespace {

using hand::MarkerVerdict;
using hand::TriadState;

constexpr std::array<const char*, 3> kBackPoints{"top", "left", "right"};
constexpr std::array<std::pair<std::size_t, std::size_t>, 3> kBackEdges{{{0, 1}, {0, 2}, {1, 2}}};
constexpr double kOften = 0.1;  // of the frames of the window: what happens less is not worth a sentence
constexpr double kHardlyEver = 0.05;

std::string point_name(std::size_t point) {
  if (point < 2) return point == 0 ? "tip" : "middle";
  return "point " + std::to_string(point);
}

bool visible(const MarkerFrame& frame, std::size_t slot) {
  return slot < frame.count && slot < kMaxMarkers && frame.markers[slot].visible;
}

}  // namespace

void MarkerWatch::add(const FingerReport& report, TimePoint now) {
  newest_ = report;
  for (std::size_t slot = 0; slot < kMaxMarkers; ++slot) {
    if (report.markers.verdict[slot] == MarkerVerdict::kRelabelled)
      relabelled_from_[slot] = report.markers.source[slot];
  }
  if (report.tracked.back.state == TriadState::kRelabelled) back_source_ = report.tracked.back.source;
  if (!samples_.empty() && now - samples_.back().t < kSpacing) return;
  samples_.push_back({now, report.tally});
  while (samples_.size() > 2 && samples_[1].t <= now - kWindow) samples_.pop_front();
}

std::uint32_t MarkerWatch::frames() const {
  return samples_.empty() ? 0 : newest_.tally.frames - samples_.front().tally.frames;
}

double MarkerWatch::fraction_seen(std::size_t slot) const {
  const std::uint32_t all = frames();
  if (all == 0) return 0.0;
  return static_cast<double>(newest_.tally.seen[slot] - samples_.front().tally.seen[slot]) / all;
}

bool MarkerWatch::often(std::size_t slot, MarkerVerdict verdict) const {
  const auto v = static_cast<std::size_t>(verdict);
  const std::uint32_t all = frames();
  if (all == 0) return false;
  return newest_.tally.verdicts[slot][v] - samples_.front().tally.verdicts[slot][v] > kOften * all;
}

bool MarkerWatch::often(TriadState state) const {
  const auto i = static_cast<std::size_t>(state);
  const std::uint32_t all = frames();
  return all > 0 && newest_.tally.back[i] - samples_.front().tally.back[i] > kOften * all;
}

std::string MarkerWatch::label(std::size_t slot) const {
  return slot < glove_.names.size() ? std::string(glove_.names[slot].view()) : std::string("?");
}

MarkerRow MarkerWatch::row(std::size_t slot) const {
  MarkerRow row;
  row.label = label(slot);
  row.seen = visible(newest_.tracked.frame, slot);
  row.seen_fraction = fraction_seen(slot);
  if (row.seen) row.p_W = newest_.tracked.frame.markers[slot].p_W;
  for (const hand::FingerMarker& marker : glove_.finger_markers) {
    if (marker.slot != slot) continue;
    row.finger = kFingerNames[static_cast<std::size_t>(marker.finger)];
    row.point = point_name(marker.point);
    row.verdict = newest_.markers.verdict[slot];
    if (row.verdict == MarkerVerdict::kRelabelled) row.source = label(newest_.markers.source[slot]);
    if (newest_.markers.residual_m[slot] > 0.0) row.residual_m = newest_.markers.residual_m[slot];
  }
  return row;
}

void MarkerWatch::describe_back(MarkersView& view) const {
  const MarkerFrame& frame = newest_.tracked.frame;
  const BackReport& back = newest_.tracked.back;
  for (std::size_t i = 0; i < kBackPoints.size(); ++i) {
    const std::size_t slot = glove_.back_slots[i];
    if (slot >= view.rows.size()) continue;
    MarkerRow& row = view.rows[slot];
    row.finger = "back";
    row.point = kBackPoints[i];
    row.verdict = !row.seen ? MarkerVerdict::kMissing : view.valid ? MarkerVerdict::kUsed : MarkerVerdict::kNone;
    if (view.valid && back.state == TriadState::kRelabelled && back.source[i] != i) {
      row.verdict = MarkerVerdict::kRelabelled;
      row.source = label(glove_.back_slots[back.source[i]]);
    }
  }
  bool all_seen = true;
  for (std::size_t i = 0; i < kBackEdges.size(); ++i) {
    const std::size_t a = glove_.back_slots[kBackEdges[i].first], b = glove_.back_slots[kBackEdges[i].second];
    if (visible(frame, a) && visible(frame, b)) {
      view.back.edges_m[i] = (frame.markers[a].p_W - frame.markers[b].p_W).norm();
    } else {
      all_seen = false;
    }
  }
  view.back.reference_m = back.reference_m;
  view.back.ambiguous = back.ambiguous;
  view.back.fit_error_m = newest_.tracked.pose.fit_error_m;
  view.back.state = back.checked ? hand::kTriadStateNames[static_cast<std::size_t>(back.state)]
                    : view.valid ? "fits"
                    : all_seen   ? "does not fit"
                                 : "not seen";
}

/// Sentences about labels of the finger markers that are probably wrong.
void MarkerWatch::find_labels(std::vector<std::string>& findings) const {
  for (std::size_t slot = 0; slot < glove_.names.size(); ++slot) {
    if (often(slot, MarkerVerdict::kRelabelled)) {
      const std::size_t source = relabelled_from_[slot];
      const bool mutual =
          source < kMaxMarkers && often(source, MarkerVerdict::kRelabelled) && relabelled_from_[source] == slot;
      if (!mutual) {
        findings.push_back("the marker " + label(slot) + " is probably the one labelled " + label(source));
      } else if (slot < source) {
        findings.push_back(label(slot) + " and " + label(source) + " are probably swapped");
      }
    }
    if (often(slot, MarkerVerdict::kGhost)) {
      findings.push_back(label(slot) + " follows something that is not the hand");
    } else if (often(slot, MarkerVerdict::kJumped)) {
      findings.push_back(label(slot) + " jumps farther than a finger moves and is not believed");
    }
  }
}

void MarkerWatch::find_back(std::vector<std::string>& findings) const {
  const auto& slots = glove_.back_slots;
  if (often(TriadState::kRelabelled)) {
    std::vector<std::size_t> exchanged;
    for (std::size_t i = 0; i < 3; ++i) {
      if (back_source_[i] != i) exchanged.push_back(slots[i]);
    }
    findings.push_back(exchanged.size() == 2
                           ? "back markers: " + label(exchanged[0]) + " and " + label(exchanged[1]) + " are swapped"
                           : "back markers: the labels of all three are exchanged");
  }
  if (often(TriadState::kWrong)) {
    findings.emplace_back("back markers: they do not form the glove's triangle, one of them is something else");
  }
  if (often(TriadState::kChanged)) {
    findings.emplace_back("back markers: their triangle has changed, a marker moved on the glove: calibrate again");
  }
}

void MarkerWatch::find(MarkersView& view) const {
  if (view.frames == 0) {
    view.findings.emplace_back("no frame came from the tracker within the last second");
    return;
  }
  find_back(view.findings);
  find_labels(view.findings);
  for (const MarkerRow& row : view.rows) {
    if (row.finger.empty() || row.seen_fraction >= kHardlyEver) continue;
    view.findings.push_back(row.label + (row.seen_fraction > 0.0 ? " is hardly seen" : " is not seen"));
  }
}

MarkersView MarkerWatch::view() const {
  MarkersView view;
  view.frame_number = newest_.state.frame_number;
  view.t_capture = newest_.state.t_capture;
  view.frames = frames();
  view.valid = newest_.state.valid;
  view.quality = newest_.state.quality;
  view.confidence = newest_.state.confidence;
  view.hand_confidence = newest_.state.hand_confidence;
  for (std::size_t slot = 0; slot < glove_.names.size(); ++slot) view.rows.push_back(row(slot));
  describe_back(view);
  find(view);
  return view;
}

}  // namespace embody
