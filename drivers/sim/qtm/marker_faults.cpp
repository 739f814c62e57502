#include "drivers/sim/qtm/marker_faults.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace embody::sim {
namespace {

constexpr double kGhostDistance_m = 0.1;
constexpr double kGapPeriod_s = 3.0;  // once per grasp of the published recording

std::optional<std::size_t> index_of(const std::vector<std::string>& names, std::string_view name) {
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end()) return {};
  return static_cast<std::size_t>(found - names.begin());
}

Error no_such(const char* what, const std::string& name) {
  return make_error(Errc::kNotFound, "the simulated QTM has no %s '%.60s'", what, name.c_str());
}

}  // namespace

MarkerFaults::MarkerFaults(const Motion& motion)
    : names_(motion.marker_names),
      gap_period_(static_cast<std::size_t>(std::max(1.0, std::round(kGapPeriod_s * motion.rate_hz)))),
      markers_(names_.size()),
      labels_(names_) {
  for (std::size_t i = 0; i < names_.size(); ++i) shows_.emplace_back(i);
}

bool MarkerFaults::handles(FaultKind kind) noexcept {
  return kind != FaultKind::kResidual && kind <= FaultKind::kRenameLabel;
}

std::optional<std::size_t> MarkerFaults::label(std::string_view name) const {
  return index_of(labels_, name);
}

std::optional<std::size_t> MarkerFaults::marker(std::string_view name) const {
  if (const auto i = index_of(names_, name)) return i;
  const auto renamed = label(name);
  return renamed ? shows_[*renamed] : std::nullopt;
}

Status MarkerFaults::act(const Fault& fault, std::size_t tick) {
  const auto frames = static_cast<std::size_t>(std::max(0.0, fault.value));
  switch (fault.kind) {
    case FaultKind::kNan:
      all_missing_until_ = tick + frames;
      return {};
    case FaultKind::kScale:
      scale_ = fault.value;
      return {};
    case FaultKind::kTriadLoss:
      if (triad_.empty()) return make_error(Errc::kNotFound, "the simulated QTM has no rigid body");
      for (const std::size_t i : triad_) markers_[i].missing_until = tick + frames;
      return {};
    case FaultKind::kSwap:
    case FaultKind::kReorder:
    case FaultKind::kAddLabel:
    case FaultKind::kRemoveLabel:
    case FaultKind::kRenameLabel:
      return act_on_labels(fault);
    default:
      return act_on_marker(fault, tick);
  }
}

Status MarkerFaults::act_on_marker(const Fault& fault, std::size_t tick) {
  const auto found = marker(fault.a);
  if (!found) return no_such("marker", fault.a);
  MarkerState& state = markers_[*found];
  const auto frames = static_cast<std::size_t>(std::max(0.0, fault.value));
  switch (fault.kind) {
    case FaultKind::kHide:
      state.hidden = true;
      break;
    case FaultKind::kShow:
      state = {};
      break;
    case FaultKind::kDrop:
      state.missing_until = tick + frames;
      break;
    case FaultKind::kGap:
      state.gap_frames = frames;
      state.gap_start = tick;
      break;
    case FaultKind::kStep:
      state.step_m.x() = 1e-3 * fault.value;
      break;
    case FaultKind::kGhost:
      state.ghost = fault.on;
      state.p_W_ghost.reset();
      break;
    case FaultKind::kUnlabel:
      state.unlabelled_until = tick + frames;
      state.unlabelled_id = next_id_++;
      break;
    default:
      return make_error(Errc::kInvalidArgument, "this is no fault of a marker");
  }
  return {};
}

Status MarkerFaults::act_on_labels(const Fault& fault) {
  if (fault.kind == FaultKind::kReorder) {
    std::reverse(labels_.begin(), labels_.end());
    std::reverse(shows_.begin(), shows_.end());
    return {};
  }
  if (fault.kind == FaultKind::kAddLabel) {
    if (label(fault.a)) return make_error(Errc::kInvalidArgument, "the label '%.60s' exists already", fault.a.c_str());
    if (labels_.size() >= Motion::kMaxMarkers) return make_error(Errc::kInvalidArgument, "there are too many labels");
    labels_.push_back(fault.a);
    shows_.emplace_back();
    return {};
  }
  const auto i = label(fault.a);
  if (!i) return no_such("label", fault.a);
  if (fault.kind == FaultKind::kSwap) {
    const auto k = label(fault.b);
    if (!k) return no_such("label", fault.b);
    std::swap(shows_[*i], shows_[*k]);
  } else if (fault.kind == FaultKind::kRenameLabel) {
    labels_[*i] = fault.b;
  } else if (labels_.size() == 1) {
    return make_error(Errc::kInvalidArgument, "'%.60s' is the last label", fault.a.c_str());
  } else {
    labels_.erase(labels_.begin() + static_cast<std::ptrdiff_t>(*i));
    shows_.erase(shows_.begin() + static_cast<std::ptrdiff_t>(*i));
  }
  return {};
}

void MarkerFaults::restart() {
  all_missing_until_ = 0;
  for (MarkerState& state : markers_) {
    state.missing_until = 0;
    state.unlabelled_until = 0;
    state.gap_start = 0;
  }
}

bool MarkerFaults::missing(const MarkerState& state, std::size_t tick) const noexcept {
  const bool in_gap = state.gap_frames > 0 && (tick - state.gap_start) % gap_period_ < state.gap_frames;
  return state.hidden || in_gap || tick < state.missing_until || tick < all_missing_until_;
}

void MarkerFaults::see(std::size_t tick, std::vector<Marker>& markers) {
  for (std::size_t i = 0; i < markers.size(); ++i) {
    MarkerState& state = markers_[i];
    Marker& marker = markers[i];
    if (missing(state, tick)) {
      marker = {};
      continue;
    }
    marker.p_W += state.step_m;
    if (state.ghost) {
      if (!state.p_W_ghost && marker.visible)
        state.p_W_ghost = marker.p_W + Eigen::Vector3d(0.0, 0.0, kGhostDistance_m);
      if (state.p_W_ghost) marker.p_W = *state.p_W_ghost;
      marker.visible = state.p_W_ghost.has_value();
    }
  }
}

void MarkerFaults::identify(std::size_t tick, const std::vector<Marker>& seen, FrameData& frame) const {
  frame.markers.assign(labels_.size(), {});
  frame.unlabelled.clear();
  for (std::size_t k = 0; k < labels_.size(); ++k) {
    if (!shows_[k]) continue;
    const MarkerState& state = markers_[*shows_[k]];
    const Marker& marker = seen[*shows_[k]];
    if (tick >= state.unlabelled_until) frame.markers[k] = marker;
  }
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (!seen[i].visible || tick >= markers_[i].unlabelled_until) continue;
    frame.unlabelled.push_back({seen[i].p_W, markers_[i].unlabelled_id});
  }
}

}  // namespace embody::sim
