#include "core/embodiment/similarity.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "core/math/triangle_distance.hpp"

namespace embody {
namespace {

using Eigen::Index;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;

/// Poses of all links with every joint at 0: robot fingers are straight there.
std::vector<Pose> zero_poses(const robot::RobotModel& model) {
  std::vector<Pose> X_PL(model.links.size(), Pose::Identity());
  for (const robot::Joint& joint : model.joints) X_PL[joint.child_link] = X_PL[joint.parent_link] * joint.X_PC;
  return X_PL;
}

Result<std::vector<Similarity::Sample>> place_samples(const robot::RobotModel& model,
                                                      const std::vector<ContactPad>& pads, std::size_t count) {
  const std::vector<Pose> X_PL = zero_poses(model);
  std::vector<std::size_t> links;
  std::vector<Pose> X_PL_of_pads;
  for (const ContactPad& pad : pads) {
    const auto link = model.find_link(pad.link);
    if (!link) {
      return make_error(Errc::kNotFound, "the robot hand has no link '%.60s', which a contact pad names",
                        pad.link.c_str());
    }
    links.push_back(*link);
    X_PL_of_pads.push_back(X_PL[*link]);
  }
  const Result<std::vector<PadSample>> placed = pad_samples(pads, X_PL_of_pads, count);
  if (!placed) return placed.error();
  std::vector<Similarity::Sample> samples;
  for (const PadSample& sample : *placed) samples.push_back({links[sample.pad], sample.p_L, sample.normal_L});
  return samples;
}

/// Triangles that lie in the patch with all corners, as positions in `patch`.
std::vector<std::array<Index, 3>> patch_triangles(const Eigen::Matrix3Xi& triangles, Index vertex_count,
                                                  const std::vector<int>& patch) {
  std::vector<Index> position(static_cast<std::size_t>(vertex_count), -1);
  for (std::size_t i = 0; i < patch.size(); ++i) position[static_cast<std::size_t>(patch[i])] = static_cast<Index>(i);
  std::vector<std::array<Index, 3>> inside;
  for (Index t = 0; t < triangles.cols(); ++t) {
    std::array<Index, 3> corners{};
    for (std::size_t k = 0; k < 3; ++k) {
      corners[k] = position[static_cast<std::size_t>(triangles(static_cast<Index>(k), t))];
    }
    if (std::min({corners[0], corners[1], corners[2]}) >= 0) inside.push_back(corners);
  }
  return inside;
}

Error of_finger(std::size_t finger, const Error& error) {
  return make_error(error.code, "%s: %s", kFingerNames[finger], error.detail.c_str());
}

}  // namespace

Result<Similarity> Similarity::create(const hand::HandData& data, const hand::Shape& shape,
                                      const robot::RobotModel& model, const EmbodimentConfig& config,
                                      std::size_t samples_per_finger) {
  Similarity similarity{hand::HandSkin(data, shape)};
  for (std::size_t f = 0; f < kFingers; ++f) {
    if (config.fingers[f].pads.empty()) continue;
    FingerSurfaces& finger = similarity.fingers_[f];
    finger.triangles = patch_triangles(data.mesh.triangles, data.mesh.size(), data.mesh.contact_vertices[f]);
    if (finger.triangles.empty()) {
      return make_error(Errc::kUnsupported, "%s: the hand model (%.60s) has no contact surface of this finger",
                        kFingerNames[f], data.source.c_str());
    }
    Result<std::vector<Sample>> samples = place_samples(model, config.fingers[f].pads, samples_per_finger);
    if (!samples) return of_finger(f, samples.error());
    finger.samples = std::move(*samples);
    finger.nearest.assign(finger.samples.size(), 0);
    finger.spheres.resize(finger.triangles.size());
  }
  return similarity;
}

Similarity::Distances Similarity::distances(const hand::Vector48& q_rad, const Pose& X_PM,
                                            std::span<const Pose> X_PL) noexcept {
  Distances means{};
  if (!q_rad.allFinite() || !X_PM.matrix().allFinite()) return means;
  skin_.step(q_rad);
  const Pose X_MP = X_PM.inverse();
  for (std::size_t f = 0; f < kFingers; ++f) means[f] = mean_distance(static_cast<Finger>(f), X_MP, X_PL);
  return means;
}

void Similarity::bound_triangles(const Matrix3Xd& corners, FingerSurfaces& surfaces) noexcept {
  for (std::size_t t = 0; t < surfaces.triangles.size(); ++t) {
    const auto& [a, b, c] = surfaces.triangles[t];
    const Vector3d centre = (corners.col(a) + corners.col(b) + corners.col(c)) / 3.0;
    surfaces.spheres[t] = {
        centre, std::sqrt(std::max({(corners.col(a) - centre).squaredNorm(), (corners.col(b) - centre).squaredNorm(),
                                    (corners.col(c) - centre).squaredNorm()}))};
  }
}

std::optional<double> Similarity::mean_distance(Finger finger, const Pose& X_MP, std::span<const Pose> X_PL) noexcept {
  FingerSurfaces& surfaces = fingers_[static_cast<std::size_t>(finger)];
  if (surfaces.samples.empty()) return std::nullopt;
  const Matrix3Xd& corners = skin_.contact_points(finger);
  bound_triangles(corners, surfaces);
  double sum_m = 0.0;
  for (std::size_t i = 0; i < surfaces.samples.size(); ++i) {
    const Sample& sample = surfaces.samples[i];
    if (sample.link >= X_PL.size()) return std::nullopt;
    const Vector3d p_M = X_MP * (X_PL[sample.link] * sample.p_L);
    if (!p_M.allFinite()) return std::nullopt;
    const auto distance_m = [&](std::size_t t) {
      const auto& [a, b, c] = surfaces.triangles[t];
      return math::distance_to_triangle(p_M, corners.col(a), corners.col(b), corners.col(c));
    };
    // A good first guess lets the spheres rule out most of the others.
    std::size_t& nearest = surfaces.nearest[i];
    double least_m = distance_m(nearest);
    for (std::size_t t = 0; t < surfaces.triangles.size(); ++t) {
      const double reach_m = least_m + surfaces.spheres[t].radius_m;
      if ((p_M - surfaces.spheres[t].centre_M).squaredNorm() >= reach_m * reach_m) continue;
      const double candidate_m = distance_m(t);
      if (candidate_m < least_m) {
        least_m = candidate_m;
        nearest = t;
      }
    }
    sum_m += least_m;
  }
  return sum_m / static_cast<double>(surfaces.samples.size());
}

}  // namespace embody
