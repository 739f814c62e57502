#include "core/hand/builtin_mesh.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "core/hand/skinning.hpp"

namespace embody::hand {
namespace {

using Eigen::Index;
using Eigen::Vector3d;

constexpr double kPi = 3.14159265358979323846;

// Half way along first, second and third bone, m. By Finger; the thumb's first bone lies in the thenar.
constexpr std::array<std::array<double, 3>, kFingers> kRadius_m{{{.0190, .0102, .0089},
                                                                 {.0110, .0081, .0072},
                                                                 {.0111, .0082, .0075},
                                                                 {.0097, .0077, .0069},
                                                                 {.0087, .0067, .0062}}};
constexpr double kThumbRoot_m = .014;  ///< radius at the thumb's first joint
constexpr double kPalmHalfThickness_m = .0160;
constexpr double kWristHalfBreadth_m = .0270;

constexpr int kAround = 12;                             // vertices of a ring of a finger
constexpr std::array<int, 3> kRingsPerBone{4, 4, 3};    // from each joint up to the next one or the rounded tip
constexpr std::array kCapAngles{kPi / 6.0, kPi / 3.0};  // rings of a rounded end, between its rim and its pole

/// A point that moves with the shape.
struct Anchor {
  Vector3d p;
  Eigen::Matrix<double, 3, 10> directions;
};

Anchor joint_anchor(const HandData& data, std::size_t joint) {
  const auto k = static_cast<Index>(joint);
  return {data.joints_M.col(k), data.joint_directions.middleRows<3>(3 * k)};
}

Anchor tip_anchor(const HandData& data, std::size_t finger) {
  const auto f = static_cast<Index>(finger);
  return {data.tips_M.col(f), data.tip_directions.middleRows<3>(3 * f)};
}

/// On the line through both, also beyond them.
Anchor between(const Anchor& a, const Anchor& b, double s) {
  return {(1.0 - s) * a.p + s * b.p, (1.0 - s) * a.directions + s * b.directions};
}

/// Beside the bones: the offset changes in the proportion `growth . shape`.
Anchor beside(const Anchor& a, const Vector3d& offset, const Shape& growth) {
  return {a.p + offset, a.directions + offset * growth.transpose()};
}

using Weights = std::array<std::pair<std::size_t, double>, 4>;  // joint, weight

class MeshBuilder {
 public:
  int add(const Anchor& anchor, const Weights& weights) {
    vertices_.push_back({anchor, weights});
    return static_cast<int>(vertices_.size()) - 1;
  }

  /// Band between two rings that run anticlockwise about the direction from the first to the second.
  void add_band(const std::vector<int>& from, const std::vector<int>& to) {
    for (std::size_t i = 0; i < from.size(); ++i) {
      const std::size_t next = (i + 1) % from.size();
      triangles_.push_back({from[i], from[next], to[i]});
      triangles_.push_back({from[next], to[next], to[i]});
    }
  }

  /// Closes a ring that runs anticlockwise about the direction from its centre to the pole; else `inverted`.
  void add_fan(const std::vector<int>& ring, int pole, bool inverted) {
    for (std::size_t i = 0; i < ring.size(); ++i) add(ring[i], ring[(i + 1) % ring.size()], pole, inverted);
  }

  /// Closes a flat ring of even size, whose first and middle vertex are its left and right end, without a new vertex.
  void add_lid(const std::vector<int>& ring, bool inverted) {
    const std::size_t n = ring.size();
    for (std::size_t i = 0; i < n / 2; ++i) {
      if (i > 0) add(ring[i], ring[n - i - 1], ring[n - i], inverted);
      if (i + 1 < n / 2) add(ring[i], ring[i + 1], ring[n - i - 1], inverted);
    }
  }

  void write(HandMesh& mesh) const {
    const auto count = static_cast<Index>(vertices_.size());
    mesh.vertices_M.resize(3, count);
    mesh.shape_directions.resize(3 * count, static_cast<Index>(kHandShapeParameters));
    mesh.pose_correctives.resize(0, 0);
    mesh.weights.setZero(count, static_cast<Index>(kHandModelJoints));
    for (Index v = 0; v < count; ++v) {
      const Vertex& vertex = vertices_[static_cast<std::size_t>(v)];
      mesh.vertices_M.col(v) = vertex.anchor.p;
      mesh.shape_directions.middleRows<3>(3 * v) = vertex.anchor.directions;
      for (const auto& [joint, weight] : vertex.weights) mesh.weights(v, static_cast<Index>(joint)) += weight;
    }
    mesh.triangles.resize(3, static_cast<Index>(triangles_.size()));
    for (Index t = 0; t < mesh.triangles.cols(); ++t) {
      const auto& triangle = triangles_[static_cast<std::size_t>(t)];
      mesh.triangles.col(t) << triangle[0], triangle[1], triangle[2];
    }
  }

 private:
  struct Vertex {
    Anchor anchor;
    Weights weights;
  };

  void add(int a, int b, int c, bool inverted) {
    if (inverted) std::swap(b, c);
    triangles_.push_back({a, b, c});
  }

  std::vector<Vertex> vertices_;
  std::vector<std::array<int, 3>> triangles_;
};

double smooth_step(double x) {
  x = std::clamp(x, 0.0, 1.0);
  return x * x * (3.0 - 2.0 * x);
}

/// The bones of one finger laid out along a line: x = 0 at the first joint, m.
class FingerAxis {
 public:
  FingerAxis(const HandData& data, std::size_t finger) : first_(first_joint(static_cast<Finger>(finger))) {
    for (std::size_t level = 0; level < 3; ++level) anchors_[level] = joint_anchor(data, first_ + level);
    anchors_[3] = tip_anchor(data, finger);
    std::array<double, 3> length{};
    for (std::size_t bone = 0; bone < 3; ++bone) {
      const Vector3d along = anchors_[bone + 1].p - anchors_[bone].p;
      length[bone] = along.norm();
      direction_[bone] = along / length[bone];
      x_[bone + 1] = x_[bone] + length[bone];
      radii_[bone + 1] = {x_[bone] + .5 * length[bone], kRadius_m[finger][bone]};
    }
    radii_[0] = {0.0, finger == static_cast<std::size_t>(Finger::kThumb) ? kThumbRoot_m : kRadius_m[finger][0]};
    blend_ = {std::min(.45 * length[0], radii_[0].second), .45 * std::min(length[0], length[1]),
              .45 * std::min(length[1], length[2])};
  }

  [[nodiscard]] double joint_x(std::size_t level) const { return x_[level]; }
  [[nodiscard]] double length() const { return x_[3]; }

  [[nodiscard]] double radius(double x) const {
    std::size_t i = 1;
    while (i < 3 && x > radii_[i].first) ++i;
    const auto& [x0, r0] = radii_[i - 1];
    const auto& [x1, r1] = radii_[i];
    return r0 + (r1 - r0) * std::clamp((x - x0) / (x1 - x0), 0.0, 1.0);
  }

  [[nodiscard]] Anchor centre(double x) const {
    const std::size_t bone = x < x_[1] ? 0 : (x < x_[2] ? 1 : 2);
    return between(anchors_[bone], anchors_[bone + 1], (x - x_[bone]) / (x_[bone + 1] - x_[bone]));
  }

  [[nodiscard]] Vector3d tangent(double x) const {
    const double b = past(1, x), c = past(2, x);
    return ((1.0 - b) * direction_[0] + (b - c) * direction_[1] + c * direction_[2]).normalized();
  }

  [[nodiscard]] Weights weights(double x) const {
    const double a = past(0, x), b = past(1, x), c = past(2, x);
    return {{{0, 1.0 - a}, {first_, a - b}, {first_ + 1, b - c}, {first_ + 2, c}}};
  }

 private:
  /// From 0 before the joint to 1 behind it; the windows of neighbouring joints do not overlap.
  [[nodiscard]] double past(std::size_t level, double x) const {
    return smooth_step(.5 + .5 * (x - x_[level]) / blend_[level]);
  }

  std::size_t first_;
  std::array<Anchor, 4> anchors_;
  std::array<double, 4> x_{};  // joints and tip
  std::array<Vector3d, 3> direction_;
  std::array<std::pair<double, double>, 4> radii_;  // x, radius
  std::array<double, 3> blend_{};                   // half the width of the blend at each joint
};

void add_finger(const HandData& data, std::size_t finger, MeshBuilder& builder) {
  const FingerAxis axis(data, finger);
  const Vector3d dorsal = dorsal_direction(static_cast<Finger>(finger));
  const auto pole = [&](double x) { return builder.add(axis.centre(x), axis.weights(x)); };
  const auto ring = [&](double x, double radius) {
    const Vector3d along = axis.tangent(x);
    const Vector3d up = (dorsal - dorsal.dot(along) * along).normalized();
    const Vector3d side = along.cross(up);
    std::vector<int> indices;
    for (int i = 0; i < kAround; ++i) {
      const double angle = 2.0 * kPi * i / kAround;
      const Vector3d offset = radius * (std::cos(angle) * up + std::sin(angle) * side);
      indices.push_back(builder.add(beside(axis.centre(x), offset, data.thickness_directions), axis.weights(x)));
    }
    return indices;
  };

  std::vector<std::vector<int>> rings;
  const double root = axis.radius(0.0);
  for (auto angle = kCapAngles.rbegin(); angle != kCapAngles.rend(); ++angle) {
    rings.push_back(ring(-root * std::sin(*angle), root * std::cos(*angle)));
  }
  const double tip = axis.radius(axis.length());
  const double rim = axis.length() - tip;
  for (std::size_t bone = 0; bone < 3; ++bone) {
    const double from = axis.joint_x(bone);
    const double to = bone == 2 ? rim : axis.joint_x(bone + 1);
    for (int i = 0; i < kRingsPerBone[bone]; ++i) {
      const double x = from + (to - from) * i / kRingsPerBone[bone];
      rings.push_back(ring(x, axis.radius(x)));
    }
  }
  rings.push_back(ring(rim, tip));
  for (const double angle : kCapAngles) rings.push_back(ring(rim + tip * std::sin(angle), tip * std::cos(angle)));

  builder.add_fan(rings.front(), pole(-root), true);
  for (std::size_t i = 1; i < rings.size(); ++i) builder.add_band(rings[i - 1], rings[i]);
  builder.add_fan(rings.back(), pole(axis.length()), false);
}

/// Columns of the palm from the thumb's side to the little finger's: ends at the knuckles, m.
std::vector<Anchor> knuckle_line(const HandData& data) {
  constexpr std::array kOrder{Finger::kIndex, Finger::kMiddle, Finger::kRing, Finger::kLittle};
  std::vector<Anchor> line;
  for (const Finger finger : kOrder) {
    const Anchor knuckle = joint_anchor(data, first_joint(finger));
    if (!line.empty()) line.push_back(between(line.back(), knuckle, .5));
    line.push_back(knuckle);
  }
  const auto edge = [&](const Anchor& knuckle, Finger finger, double sign) {
    const Vector3d out = {0.0, 0.0, sign * kRadius_m[static_cast<std::size_t>(finger)][0]};
    return beside(knuckle, out, data.thickness_directions);
  };
  const Anchor radial = edge(line.front(), Finger::kIndex, 1.0);
  line.insert(line.begin(), {radial, between(radial, line.front(), .5)});
  const Anchor ulnar = edge(line.back(), Finger::kLittle, -1.0);
  line.push_back(between(line.back(), ulnar, .5));
  line.push_back(ulnar);
  return line;
}

void add_palm(const HandData& data, MeshBuilder& builder) {
  // Sections from behind the wrist to the webs between the fingers, and how thick each is.
  constexpr std::array<std::pair<double, double>, 9> kSections{
      {{-.08, .90}, {.0, 1.0}, {.15, 1.0}, {.30, 1.0}, {.45, 1.0}, {.60, 1.0}, {.75, .97}, {.92, .88}, {1.05, .60}}};
  const std::vector<Anchor> knuckles = knuckle_line(data);
  const std::size_t last = knuckles.size() - 1;
  const Weights weights{{{0, 1.0}}};
  Shape broader = Shape::Zero();
  broader(static_cast<Index>(HandShape::kScale)) = 1.0;
  broader(static_cast<Index>(HandShape::kPalmBreadth)) = 1.0;

  std::vector<std::vector<int>> rings;
  for (const auto& [s, thickness] : kSections) {
    const auto column = [&, s = s, thickness = thickness](std::size_t i, double side) {
      const double across = 1.0 - 2.0 * static_cast<double>(i) / static_cast<double>(last);
      const Anchor wrist = beside(joint_anchor(data, 0), {0.0, 0.0, across * kWristHalfBreadth_m}, broader);
      const bool edge = i == 0 || i == last;
      const bool beside_edge = i == 1 || i + 1 == last;
      const double height = side * thickness * kPalmHalfThickness_m * (edge ? 0.0 : (beside_edge ? .75 : 1.0));
      return builder.add(beside(between(wrist, knuckles[i], s), {0.0, height, 0.0}, data.thickness_directions),
                         weights);
    };
    std::vector<int> ring;  // back of the hand towards the little finger, then the palm back to the thumb
    for (std::size_t i = 0; i <= last; ++i) ring.push_back(column(i, 1.0));
    for (std::size_t i = last - 1; i > 0; --i) ring.push_back(column(i, -1.0));
    rings.push_back(ring);
  }
  builder.add_lid(rings.front(), true);
  for (std::size_t i = 1; i < rings.size(); ++i) builder.add_band(rings[i - 1], rings[i]);
  builder.add_lid(rings.back(), false);
}

}  // namespace

void add_builtin_mesh(HandData& data) {
  MeshBuilder builder;
  for (std::size_t finger = 0; finger < kFingers; ++finger) add_finger(data, finger, builder);
  add_palm(data, builder);
  builder.write(data.mesh);
  data.mesh.contact_vertices = contact_patches(data);
}

}  // namespace embody::hand
