#pragma once
// A rigid body of QTM: its pose from the markers that carry it.
#include <span>
#include <string>
#include <vector>

#include "core/base/result.hpp"
#include "drivers/sim/qtm/frame_encoder.hpp"
#include "drivers/sim/qtm/motion.hpp"
#include "drivers/sim/qtm/parameters_xml.hpp"

namespace embody::sim {

/// Where an operator has put the frame of a body when defining it.
enum class BodyFrame : std::uint8_t {
  /// QTM's default: origin in the geometric centre, axes parallel to the world's in the frame of the definition.
  kCentre,
  /// By the first three markers, as the frame H of a hand (docs/notation.md): origin in the third, z to the first, y
  /// normal to (first - third) x (second - third).
  kMarkers,
};

struct QtmBody {
  std::string name;
  std::vector<std::string> markers;  ///< at least three of the motion
  BodyFrame frame{BodyFrame::kCentre};
};

class RigidBody {
 public:
  /// The shape is that of the first frame (of the first `kSearchedFrames`) in which all markers are visible.
  /// Errors: kInvalidArgument (fewer than three markers, one that the motion does not have), kNotFound (never seen
  /// together, or on one line).
  [[nodiscard]] static Result<RigidBody> define(const QtmBody& body, const Motion& motion);

  /// Least-squares pose (Kabsch 1976) of the shape on `markers`, which are all of the motion's; not tracked when one of
  /// the body's is missing.
  [[nodiscard]] BodyPose pose(std::span<const Marker> markers) const;

  [[nodiscard]] const BodyParameters& parameters() const noexcept { return parameters_; }
  [[nodiscard]] const std::vector<std::size_t>& slots() const noexcept { return slots_; }

 private:
  static constexpr std::size_t kSearchedFrames = 2'000;
  RigidBody() = default;
  std::vector<std::size_t> slots_;  // of the motion
  BodyParameters parameters_;       // points in the order of slots_
};

}  // namespace embody::sim
