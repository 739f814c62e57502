#pragma once
// How near a robot hand's contact surfaces come to the human hand's: the metric of the paper, section "Similarity
// Between MANO and Robotic Hand".
#include <array>
#include <optional>
#include <span>
#include <vector>

#include "core/embodiment/pad_samples.hpp"
#include "core/hand/skinning.hpp"
#include "core/robot/urdf_model.hpp"

namespace embody {

/// Per finger: (1/N) sum_i min_j d(p_i, T_j) over N samples p_i of the robot finger's contact pads and the triangles
/// T_j of the same human finger's contact surface (triangles whose three corners are in HandMesh::contact_vertices).
class Similarity {
 public:
  struct Sample {
    std::size_t link{0};                      ///< of the robot model
    Eigen::Vector3d p_L{0.0, 0.0, 0.0};       ///< m
    Eigen::Vector3d normal_L{0.0, 0.0, 0.0};  ///< out of the finger
  };
  /// Means by Finger, m; nothing for a finger without pads.
  using Distances = std::array<std::optional<double>, kFingers>;

  /// `data`, `model` and the pads of `config` must describe hands of the same side. Allocates.
  /// Errors: kNotFound (link of a pad), kInvalidArgument (pads, see pad_samples()), kUnsupported (the hand data has no
  /// contact surface of a finger that has pads). The sentence names the finger.
  [[nodiscard]] static Result<Similarity> create(const hand::HandData& data, const hand::Shape& shape,
                                                 const robot::RobotModel& model, const EmbodimentConfig& config,
                                                 std::size_t samples_per_finger = kPadSamples);

  /// `q_rad`: the 48 pose parameters of the human hand (wrist first; 0 for a hand state); `X_PM`: hand-model base in
  /// the root link; `X_PL`: poses of the robot's links in the root link, by index in the model. Nothing for a finger
  /// without pads, and for one with an argument that is not finite or with a link beyond `X_PL`. Some 0.2 ms, no heap.
  [[nodiscard]] Distances distances(const hand::Vector48& q_rad, const Pose& X_PM, std::span<const Pose> X_PL) noexcept;

  /// None for a finger without pads.
  [[nodiscard]] std::span<const Sample> samples(Finger finger) const noexcept { return at(finger).samples; }
  /// Triangles of the human finger's contact surface.
  [[nodiscard]] std::size_t triangle_count(Finger finger) const noexcept { return at(finger).triangles.size(); }

 private:
  using Triangle = std::array<Eigen::Index, 3>;  // columns of HandSkin::contact_points()
  struct Sphere {
    Eigen::Vector3d centre_M{0.0, 0.0, 0.0};
    double radius_m{0.0};
  };
  struct FingerSurfaces {
    std::vector<Sample> samples;
    std::vector<std::size_t> nearest;  // triangle of each sample in the frame before: where to look first
    std::vector<Triangle> triangles;
    std::vector<Sphere> spheres;  // around each triangle, in the present pose
  };

  explicit Similarity(hand::HandSkin skin) : skin_(std::move(skin)) {}
  [[nodiscard]] const FingerSurfaces& at(Finger finger) const noexcept {
    return fingers_[static_cast<std::size_t>(finger)];
  }
  static void bound_triangles(const Eigen::Matrix3Xd& corners_M, FingerSurfaces& surfaces) noexcept;
  [[nodiscard]] std::optional<double> mean_distance(Finger finger, const Pose& X_MP,
                                                    std::span<const Pose> X_PL) noexcept;

  hand::HandSkin skin_;
  std::array<FingerSurfaces, kFingers> fingers_;
};

}  // namespace embody
