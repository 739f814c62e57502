// Where the tip and middle points of the fingers are, unless a calibration knows better.
#include "core/hand/hand_model.hpp"

namespace embody::hand {
namespace {

using Eigen::Vector3d;
using Places = std::array<std::array<std::pair<std::size_t, Vector3d>, 2>, kFingers>;  // joint, place in the flat hand

// Fitted, with a prior on nails and proximal phalanges, to a public recording of the 13-marker glove (dfki-ric/
// hand_embodiment, test/data/recording.tsv, BSD-3-Clause): this is where that glove carries its markers relative to
// these skeletons, not data of any hand model. Part of the offsets makes up for the difference between the skeleton and
// the subject's hand, e.g. the middle markers of ring and little finger, whose knuckles lie further out than the
// skeleton's.
Places builtin_places(Skeleton skeleton) {
  if (skeleton == Skeleton::kWebXr) {
    return {{{{{15, {.0111, -.0375, .0934}}, {14, {.0373, -.0201, .0806}}}},
             {{{3, {-.0779, .0077, .0279}}, {1, {-.0333, .0202, .0201}}}},
             {{{6, {-.0825, .0100, .0007}}, {4, {-.0248, .0223, -.0008}}}},
             {{{12, {-.0742, .0052, -.0255}}, {10, {-.0177, .0083, -.0340}}}},
             {{{9, {-.0444, .0013, -.0399}}, {7, {-.0063, -.0034, -.0480}}}}}};
  }
  return {{{{{15, {.0100, -.0241, .0942}}, {14, {.0385, -.0113, .0802}}}},
           {{{3, {-.0777, .0164, .0312}}, {1, {-.0319, .0260, .0204}}}},
           {{{6, {-.0851, .0179, .0054}}, {4, {-.0264, .0227, -.0005}}}},
           {{{12, {-.0767, .0161, -.0177}}, {10, {-.0216, .0093, -.0328}}}},
           {{{9, {-.0448, .0159, -.0398}}, {7, {-.0109, .0008, -.0490}}}}}};
}

// Vertices and offsets of the published record mapping (dfki-ric/hand_embodiment, configuration 20211105_april).
HandPoint mano_place(std::size_t finger, std::size_t point) {
  constexpr std::array<std::array<int, 2>, kFingers> kVertices{
      {{724, 706}, {314, 261}, {426, 399}, {534, 509}, {651, 627}}};
  HandPoint place;
  place.kind = HandPoint::Kind::kSurface;
  place.vertices.fill(kVertices[finger][point]);
  place.offset_m = finger == 0 ? Vector3d(.006, .006, .003) : Vector3d(.0, .007, .0);
  return place;
}

}  // namespace

HandPoints default_points(const HandData& data) {
  const double mirror = data.side == Side::kRight ? 1.0 : -1.0;
  HandPoints points;
  for (std::size_t f = 0; f < kFingers; ++f) {
    for (std::size_t i = 0; i < 2; ++i) {
      HandPoint point;
      if (data.skeleton) {
        const auto [joint, place] = builtin_places(*data.skeleton)[f][i];
        point.joint = joint;
        point.stretches = true;
        point.offset_m =
            Vector3d(mirror * place.x(), place.y(), place.z()) - data.joints_M.col(static_cast<Eigen::Index>(joint));
      } else {
        point = mano_place(f, i);
        point.offset_m.x() *= mirror;
      }
      points[f].push_back(point);
    }
  }
  return points;
}

Status check_points(const HandData& data, const HandPoints& points) {
  for (std::size_t f = 0; f < kFingers; ++f) {
    const std::size_t first = first_joint(static_cast<Finger>(f));
    for (std::size_t i = 0; i < points[f].size(); ++i) {
      const HandPoint& point = points[f][i];
      const char* finger = kFingerNames[f];
      if (!point.offset_m.allFinite()) {
        return make_error(Errc::kInvalidArgument, "point %zu of the %s finger: its offset is not finite", i, finger);
      }
      const bool on_joint = point.kind == HandPoint::Kind::kBone || point.kind == HandPoint::Kind::kJoint;
      if (on_joint && (point.joint < first || point.joint > first + 2)) {
        return make_error(Errc::kInvalidArgument,
                          "point %zu of the %s finger: joint %zu is not one of its joints (%zu to %zu)", i, finger,
                          point.joint, first, first + 2);
      }
      for (const int vertex : point.vertices) {
        if (point.kind != HandPoint::Kind::kSurface || (vertex >= 0 && vertex < data.mesh.size())) continue;
        return make_error(Errc::kInvalidArgument, "point %zu of the %s finger: the hand has no vertex %d (it has %td)",
                          i, finger, vertex, static_cast<std::ptrdiff_t>(data.mesh.size()));
      }
    }
  }
  return {};
}

}  // namespace embody::hand
