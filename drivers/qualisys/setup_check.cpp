#include "drivers/qualisys/setup_check.hpp"

#include <algorithm>

#include "core/base/names.hpp"

namespace embody::qualisys {
namespace {

template <class T>
bool contains(const std::vector<T>& all, const T& one) {
  return std::find(all.begin(), all.end(), one) != all.end();
}

Status check_body(const std::vector<BodyParameters>& bodies, const std::string& name) {
  const auto body =
      std::find_if(bodies.begin(), bodies.end(), [&](const BodyParameters& each) { return each.name == name; });
  if (body == bodies.end()) {
    std::vector<std::string> names;
    names.reserve(bodies.size());
    for (const auto& each : bodies) names.push_back(each.name);
    return make_error(Errc::kNotFound, "QTM has no rigid body %s; define it in QTM or choose another one",
                      describe_missing({name}, names, 150).c_str());
  }
  if (!body->enabled) {
    return make_error(Errc::kRefused, "QTM's rigid body '%.100s' is disabled; enable it in QTM", name.c_str());
  }
  if (body->relative) {
    return make_error(Errc::kRefused,
                      "QTM tells the pose of '%.100s' relative to another body; choose the global coordinate system",
                      name.c_str());
  }
  return {};
}

Error changed(const char* what, const std::string& was, const std::string& is) noexcept {
  return make_error(Errc::kRefused, "QTM's %s changed from '%.60s' to '%.60s'", what, was.c_str(), is.c_str());
}

Status check_same_labels(const std::vector<std::string>& before, const std::vector<std::string>& now) {
  const auto [old_label, new_label] = std::mismatch(before.begin(), before.end(), now.begin(), now.end());
  if (old_label == before.end() && new_label == now.end()) return {};
  const char* was = old_label == before.end() ? "(none)" : old_label->c_str();
  const char* is = new_label == now.end() ? "(none)" : new_label->c_str();
  return make_error(Errc::kRefused, "QTM's label %td changed from '%.60s' to '%.60s' (%zu labels before, %zu now)",
                    old_label - before.begin() + 1, was, is, before.size(), now.size());
}

}  // namespace

Status check_names(const std::vector<std::string>& markers) {
  if (markers.empty() || markers.size() > kMaxMarkers) {
    return make_error(Errc::kInvalidArgument, "a glove layout has 1 to %zu markers, not %zu", kMaxMarkers,
                      markers.size());
  }
  for (auto name = markers.begin(); name != markers.end(); ++name) {
    if (std::find(markers.begin(), name, *name) == name) continue;
    return make_error(Errc::kInvalidArgument, "the glove layout names the marker '%.100s' twice", name->c_str());
  }
  return {};
}

Status check_setup(const Parameters& parameters, const Wanted& wanted) {
  if (parameters.calibration_time.empty()) {
    return make_error(Errc::kRefused, "QTM is not calibrated; calibrate the cameras in QTM, then try again");
  }
  if (parameters.axis_upwards != "+Z") {
    return make_error(Errc::kRefused, "QTM's upward axis is '%.20s', it must be '+Z'; change it in QTM's calibration",
                      parameters.axis_upwards.c_str());
  }
  std::vector<std::string> needed;
  for (const auto& name : wanted.markers) {
    if (!contains(wanted.optional, name)) needed.push_back(name);
  }
  if (const auto missing = describe_missing(needed, parameters.labels, 150); !missing.empty()) {
    return make_error(Errc::kNotFound, "QTM has no marker(s) %s; name them in QTM or choose another glove",
                      missing.c_str());
  }
  if (!wanted.rigid_body.empty()) {
    if (const auto status = check_body(parameters.bodies, wanted.rigid_body); !status) return status;
  }
  if (parameters.frequency_hz > 0.0) return {};
  return make_error(Errc::kMalformed, "QTM does not tell its capture rate");
}

std::string processing_warning(const Parameters& parameters, const Wanted& wanted) {
  if (!parameters.processing.tracks_3d) return "3D tracking is off in QTM's real-time processing";
  if (!parameters.processing.identifies) return "AIM is off in QTM's real-time processing: markers have no labels";
  if (!parameters.processing.tracks_6d && !wanted.rigid_body.empty()) {
    return "6DOF tracking is off in QTM's real-time processing";
  }
  return {};
}

Status check_unchanged(const Parameters& before, const Parameters& now) {
  if (const auto status = check_same_labels(before.labels, now.labels); !status) return status;
  if (before.axis_upwards != now.axis_upwards) return changed("upward axis", before.axis_upwards, now.axis_upwards);
  if (before.calibration_time != now.calibration_time) {
    return changed("calibration", before.calibration_time, now.calibration_time);
  }
  if (before.frequency_hz != now.frequency_hz) {
    return make_error(Errc::kRefused, "QTM's capture rate changed from %g to %g Hz", before.frequency_hz,
                      now.frequency_hz);
  }
  if (before.bodies != now.bodies) {
    return make_error(Errc::kRefused, "QTM's rigid bodies changed (%zu before, %zu now)", before.bodies.size(),
                      now.bodies.size());
  }
  if (before.processing == now.processing) return {};
  return make_error(Errc::kRefused, "QTM's real-time processing changed");
}

DataMap make_map(const Parameters& parameters, const Wanted& wanted) {
  DataMap map;
  map.labels = parameters.labels.size();
  for (std::size_t slot = 0; slot < wanted.markers.size(); ++slot) {
    const auto& labels = parameters.labels;
    const auto label = std::find(labels.begin(), labels.end(), wanted.markers[slot]);
    map.label_of_slot[slot] = label == labels.end() ? DataMap::kNone : static_cast<std::size_t>(label - labels.begin());
  }
  for (const auto& body : parameters.bodies) {
    if (body.name == wanted.rigid_body) map.body = map.bodies;
    if (body.name == wanted.rigid_body) map.body_among_enabled = map.enabled_bodies;
    ++map.bodies;
    if (body.enabled) ++map.enabled_bodies;
  }
  return map;
}

}  // namespace embody::qualisys
