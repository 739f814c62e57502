#pragma once
// Robot descriptions of config/hands for tests, and changes of them that must not matter.
#include <fstream>
#include <iterator>
#include <map>
#include <random>
#include <stdexcept>
#include <string>

#include "core/robot/urdf_model.hpp"

namespace embody::test {

inline std::string shipped_file(const std::string& name) {
  std::ifstream file(EMBODY_SOURCE_DIR "/config/hands/" + name);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

/// Throws if the URDF cannot be read: the test then fails with the sentence.
inline robot::RobotModel shipped_model(const std::string& name) {
  auto model = robot::load_urdf(shipped_file(name + ".urdf"));
  if (!model) throw std::runtime_error(model.error().detail.c_str());
  return std::move(*model);
}

/// The same robot with new names in a new alphabetical order (by which the loader sorts siblings). Fills `old_name`.
inline robot::RobotModel renamed(const robot::RobotModel& model, std::uint64_t seed,
                                 std::map<std::string, std::string>& old_name) {
  std::mt19937_64 engine(seed);
  robot::RobotModel copy = model;
  const auto rename = [&](std::string& name) {
    std::string fresh = "x" + std::to_string(engine() % 1'000'000'007);
    while (old_name.count(fresh) != 0) fresh += "0";
    old_name[fresh] = name;
    name = fresh;
  };
  for (robot::Link& link : copy.links) rename(link.name);
  for (robot::Joint& joint : copy.joints) rename(joint.name);
  return copy;
}

/// The same robot with links and joints in another order, parents still before children.
inline robot::RobotModel reordered(const robot::RobotModel& model, std::uint64_t seed) {
  std::mt19937_64 engine(seed);
  std::vector<std::size_t> ready{0}, order;  // links of `model`
  while (!ready.empty()) {
    const std::size_t pick = order.empty() ? 0 : engine() % ready.size();
    const std::size_t link = ready[pick];
    ready.erase(ready.begin() + static_cast<std::ptrdiff_t>(pick));
    order.push_back(link);
    for (const robot::Joint& joint : model.joints) {
      if (joint.parent_link == link) ready.push_back(joint.child_link);
    }
  }
  std::vector<std::size_t> new_link(order.size()), new_joint(model.joints.size());
  for (std::size_t i = 0; i < order.size(); ++i) new_link[order[i]] = i;
  robot::RobotModel copy;
  copy.name = model.name;
  for (const std::size_t link : order) {
    const std::size_t joint = model.links[link].parent_joint;
    copy.links.push_back({model.links[link].name, joint == robot::kNoIndex ? joint : copy.joints.size()});
    if (joint == robot::kNoIndex) continue;
    new_joint[joint] = copy.joints.size();
    copy.joints.push_back(model.joints[joint]);
  }
  for (robot::Joint& joint : copy.joints) {
    joint.parent_link = new_link[joint.parent_link];
    joint.child_link = new_link[joint.child_link];
    if (joint.mimic) joint.mimic->joint = new_joint[joint.mimic->joint];
  }
  return copy;
}

/// The root link's frame somewhere else: everything that hangs on it moves by `X_PnPo`.
inline robot::RobotModel rerooted(const robot::RobotModel& model, const math::Pose& X_PnPo) {
  robot::RobotModel copy = model;
  for (robot::Joint& joint : copy.joints) {
    if (joint.parent_link == 0) joint.X_PC = X_PnPo * joint.X_PC;
  }
  return copy;
}

/// The mirror image in x, frame by frame: joint values mean the mirrored posture.
inline robot::RobotModel mirrored(const robot::RobotModel& model) {
  const Eigen::Matrix3d S = Eigen::Vector3d(-1.0, 1.0, 1.0).asDiagonal();
  robot::RobotModel copy = model;
  for (robot::Joint& joint : copy.joints) {
    joint.X_PC.linear() = S * joint.X_PC.linear() * S;
    joint.X_PC.translation() = S * joint.X_PC.translation();
    const bool slides = joint.type == robot::JointType::kPrismatic;
    joint.axis = (slides ? 1.0 : -1.0) * (S * joint.axis);  // an axis of rotation is an axial vector
  }
  return copy;
}

}  // namespace embody::test
