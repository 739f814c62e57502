#pragma once
// A robot's tree of links and joints, read from URDF text and checked. Core knows no files: the caller reads them.
#include <Eigen/Core>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.hpp"
#include "core/math/pose.hpp"

namespace embody::robot {

enum class JointType { kFixed, kRevolute, kContinuous, kPrismatic };

inline constexpr std::size_t kNoIndex = static_cast<std::size_t>(-1);

/// q = multiplier * q[joint] + offset. Chains of mimics are resolved: `joint` is never a mimic itself.
struct Mimic {
  std::size_t joint{kNoIndex};
  double multiplier{1.0};
  double offset{0.0};
};

struct Joint {
  std::string name;
  JointType type{JointType::kFixed};
  std::size_t parent_link{0};
  std::size_t child_link{0};
  math::Pose X_PC{math::Pose::Identity()};  ///< child link in the parent link at q = 0
  Eigen::Vector3d axis{1.0, 0.0, 0.0};      ///< unit vector in the child link
  double lower{0.0};                        ///< rad or m; -/+ infinity for continuous, 0 for fixed joints
  double upper{0.0};
  double max_velocity{0.0};  ///< rad/s or m/s; 0: not given
  double max_effort{0.0};    ///< Nm or N; 0: not given
  std::optional<Mimic> mimic;
};

struct Link {
  std::string name;
  std::size_t parent_joint{kNoIndex};  ///< kNoIndex for the root
};

/// Immutable after loading. links[0] is the root; parents precede children in both lists.
struct RobotModel {
  std::string name;
  std::vector<Link> links;
  std::vector<Joint> joints;

  [[nodiscard]] std::optional<std::size_t> find_link(std::string_view link_name) const noexcept;
  [[nodiscard]] std::optional<std::size_t> find_joint(std::string_view joint_name) const noexcept;
};

inline constexpr std::size_t kMaxUrdfBytes = 8U << 20U;
inline constexpr std::size_t kMaxUrdfDepth = 64;
inline constexpr std::size_t kMaxUrdfLinks = 4096;

/// Reads and checks URDF text. Untrusted text is fine: size and nesting are bounded, nothing is printed, nothing
/// throws. Allocates; not for a real-time thread. From the first call on,
/// console_bridge (the parser's message channel) is silent in this process.
/// Errors: kMalformed (not XML, not URDF, not a tree, no axis, no limits, lower > upper, not finite, broken mimic),
/// kUnsupported (too large, too deep, floating or planar joints). The sentence names the link or joint.
[[nodiscard]] Result<RobotModel> load_urdf(std::string_view text) noexcept;

}  // namespace embody::robot
