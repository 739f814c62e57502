#include "daemon/app/operator_models.hpp"

#include <algorithm>

#include "core/hand/calibration.hpp"
#include "core/hand/landmark_layout.hpp"
#include "drivers/mano/mano_file.hpp"

namespace embody {
namespace {

using config::FingerPoint;

template <class Vector, std::size_t N>
Vector vector(const std::array<double, N>& values) {
  return Eigen::Map<const Vector>(values.data());
}

Result<std::size_t> slot_of(const config::GloveConfig& glove, const std::string& marker) {
  const auto found = std::find(glove.names.begin(), glove.names.end(), marker);
  if (found != glove.names.end()) return static_cast<std::size_t>(found - glove.names.begin());
  return make_error(Errc::kNotFound, "[glove] names no marker '%s': add it to `names`", marker.c_str());
}

Result<hand::HandData> make_hand(const config::SubjectConfig& subject) {
  if (subject.model.empty()) {
    const bool a = subject.skeleton == config::Skeleton::kA;
    return hand::builtin_hand(a ? hand::Skeleton::kBoneLengths : hand::Skeleton::kWebXr, subject.side);
  }
  Result<hand::HandData> data = mano::load_hand(subject.model);
  if (data && data->side != subject.side) {
    return make_error(Errc::kInvalidArgument, "[subject] side is \"%s\", but the model %.120s is of the other hand",
                      kSideNames[static_cast<std::size_t>(subject.side)], subject.model.c_str());
  }
  return data;
}

/// Joint 1..3 of a finger in MANO's order.
std::size_t joint_of(Finger finger, int joint) {
  return hand::first_joint(finger) + static_cast<std::size_t>(joint - 1);
}

hand::HandPoint own_point(const config::FingerMarkerConfig& marker) {
  hand::HandPoint point;
  point.kind = marker.point == FingerPoint::kSurface ? hand::HandPoint::Kind::kSurface : hand::HandPoint::Kind::kBone;
  point.joint = joint_of(marker.finger, marker.joint);
  point.vertices = marker.vertices;
  point.barycentric = marker.barycentric;
  point.offset_m = vector<Eigen::Vector3d>(marker.offset_m);
  return point;
}

Error full(Finger finger) {
  return make_error(Errc::kInvalidArgument, "[glove] finger_markers: more than %zu markers on the %s finger",
                    config::kMaxMarkersPerFinger, kFingerNames[static_cast<std::size_t>(finger)]);
}

/// Layout of the glove; its points of its own are added to the models'.
Status add_glove(const config::GloveConfig& glove, OperatorModels& models) {
  for (const std::string& name : glove.names) models.layout.names.push_back(FixedString<48>(std::string_view(name)));
  const std::array<const std::string*, 3> back{&glove.back.top, &glove.back.left, &glove.back.right};
  for (std::size_t i = 0; i < back.size(); ++i) {
    const Result<std::size_t> slot = slot_of(glove, *back[i]);
    if (!slot) return slot.error();
    models.layout.back_slots[i] = *slot;
  }
  for (const config::FingerMarkerConfig& marker : glove.finger_markers) {
    const Result<std::size_t> slot = slot_of(glove, marker.marker);
    if (!slot) return slot.error();
    auto& points = models.points[static_cast<std::size_t>(marker.finger)];
    auto point = static_cast<std::size_t>(marker.point);
    if (marker.point == FingerPoint::kBone || marker.point == FingerPoint::kSurface) {
      point = points.size();
      if (!points.push_back(own_point(marker))) return full(marker.finger);
    }
    if (!models.layout.finger_markers.push_back({marker.finger, point, *slot})) return full(marker.finger);
  }
  return {};
}

/// Calibrated places instead of the glove's. Tip and middle stay what the robot's fingers follow: their markers get
/// points of their own.
Status add_places(const config::SubjectConfig& subject, OperatorModels& models) {
  hand::Calibration places;
  places.back_edges_m = subject.back_edges_m;
  for (const config::MarkerPlaceConfig& place : subject.markers) {
    const auto* marker = std::find_if(
        models.layout.finger_markers.begin(), models.layout.finger_markers.end(),
        [&](const hand::FingerMarker& known) { return models.layout.names[known.slot].view() == place.marker; });
    if (marker == models.layout.finger_markers.end()) {
      return make_error(Errc::kInvalidArgument, "[subject] markers: '%.48s' is no finger marker of the glove",
                        place.marker.c_str());
    }
    hand::CalibratedMarker known;
    known.slot = marker->slot;
    known.finger = marker->finger;
    known.joint = joint_of(marker->finger, place.joint);
    known.offset_m = vector<Eigen::Vector3d>(place.offset_m);
    places.markers.push_back(known);
  }
  const hand::CalibratedGlove glove = hand::apply(places, models.layout, models.points);
  models.layout = glove.glove;
  models.points = glove.points;
  return {};
}

hand::FingerEstimatorConfig make_fingers(const config::RecordMappingConfig& config) {
  hand::FingerEstimatorConfig fingers;
  fingers.objective = config.objective;
  fingers.solver = config.solver;
  fingers.max_iterations = config.max_iterations;
  fingers.coupling_m_rad = config.coupling_m_rad;
  fingers.coupling_ratio = config.coupling_ratio;
  fingers.catch_up_rad_s = config.catch_up_rad_s;
  fingers.hold = config.hold;
  fingers.decay = config.decay;
  for (std::size_t f = 0; f < kFingers; ++f) {
    const config::FingerPriorConfig& prior = config.fingers[f];
    fingers.lower_rad[f] = vector<hand::Vector9>(prior.lower_rad);
    fingers.upper_rad[f] = vector<hand::Vector9>(prior.upper_rad);
    fingers.weight_plus[f] = vector<hand::Vector9>(prior.weight_plus);
    fingers.weight_minus[f] = vector<hand::Vector9>(prior.weight_minus);
    fingers.temporal_m_rad[f] = vector<hand::Vector9>(prior.temporal_m_rad);
  }
  return fingers;
}

}  // namespace

Result<OperatorModels> make_operator_models(const config::EmbodyConfig& config) {
  Result<hand::HandData> data = make_hand(config.subject);
  if (!data) return data.error();
  OperatorModels models;
  models.data = std::move(*data);
  models.shape = vector<hand::Shape>(config.subject.shape);
  models.X_HM = math::exp_se3(vector<Vector6>(config.subject.X_HM_exponential));
  models.fingers = make_fingers(config.record_mapping);
  if (config.tracker.driver == config::TrackerDriver::kLandmarks) {
    models.layout = hand::landmark_layout();
    models.points = hand::landmark_points(models.data);
    models.fingers = hand::for_landmarks(models.fingers);
  } else {
    models.points = hand::default_points(models.data);
    if (const Status added = add_glove(config.glove, models); !added) return added.error();
    if (const Status added = add_places(config.subject, models); !added) return added.error();
  }
  if (const Status checked = hand::check_points(models.data, models.points); !checked) {
    return make_error(checked.error().code, "[glove] finger_markers: %s", checked.error().detail.c_str());
  }
  return models;
}

}  // namespace embody
