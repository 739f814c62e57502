#pragma once
// Finds the joints of a hand in a JointState message, by name: a pure function, no allocation.
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "core/hal/types.hpp"

namespace embody::dds {

enum class JointStateMatch : std::uint8_t {
  kWhole,    ///< every joint is there
  kOther,    ///< none is there: another device's message on the same topic
  kPartial,  ///< some are missing
  kBroken,   ///< fewer positions than names, or a position that is not finite
};

struct MatchedJoints {
  JointStateMatch match{JointStateMatch::kOther};
  std::size_t missing{0};                      ///< kPartial: index of the first joint that is not there
  std::array<double, kMaxHandJoints> q_rad{};  ///< kWhole: in the order of `joints`
};

/// At most kMaxHandJoints `joints`. Names that are not among them are ignored; of a name that occurs twice, the first
/// counts. Null names are passed over. Cost: names x joints comparisons.
[[nodiscard]] MatchedJoints match_joints(std::span<const char* const> names, std::span<const double> positions,
                                         std::span<const std::string> joints) noexcept;

}  // namespace embody::dds
