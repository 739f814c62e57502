#include "daemon/dds/joint_state_match.hpp"

#include <cmath>

namespace embody::dds {

MatchedJoints match_joints(std::span<const char* const> names, std::span<const double> positions,
                           std::span<const std::string> joints) noexcept {
  MatchedJoints result;
  const auto place_of = [names](const std::string& joint) {
    std::size_t place = 0;
    while (place < names.size() && (names[place] == nullptr || joint != names[place])) ++place;
    return place;
  };
  std::size_t found = 0;
  result.missing = joints.size();
  bool broken = false;
  for (std::size_t i = 0; i < joints.size() && i < kMaxHandJoints; ++i) {
    const std::size_t place = place_of(joints[i]);
    if (place == names.size()) {
      if (result.missing == joints.size()) result.missing = i;
      continue;
    }
    ++found;
    if (place >= positions.size() || !std::isfinite(positions[place])) {
      broken = true;
    } else {
      result.q_rad[i] = positions[place];
    }
  }
  result.match = found == 0               ? JointStateMatch::kOther
                 : broken                 ? JointStateMatch::kBroken
                 : found == joints.size() ? JointStateMatch::kWhole
                                          : JointStateMatch::kPartial;
  return result;
}

}  // namespace embody::dds
