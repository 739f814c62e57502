#include "core/robot/urdf_model.hpp"

// The only place that sees urdfdom, its XML parser and its message channel.
#include <console_bridge/console.h>
#include <urdf_parser/urdf_parser.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <limits>
#include <map>
#include <set>

#include "core/robot/xml_guard.hpp"

namespace embody::robot {
namespace {

constexpr XmlLimits kXmlLimits{kMaxUrdfBytes, kMaxUrdfDepth, 65'536};
constexpr double kMaxLength = 1e3;    // m (or turns of rad); more is a unit mistake, and sums could overflow
constexpr double kMostTurned = 25.2;  // rad, four turns; more are degrees

/// Keeps the first two errors that urdfdom reports in this thread instead of printing them: first the cause, then the
/// joint or link around it.
class MessageCapture final : public console_bridge::OutputHandler {
 public:
  static std::string& text() {
    thread_local std::string text;
    return text;
  }
  void log(const std::string& message, console_bridge::LogLevel level, const char* /*file*/, int /*line*/) override {
    if (level < console_bridge::CONSOLE_BRIDGE_LOG_ERROR || text().find("; ") != std::string::npos) return;
    text() += (text().empty() ? "" : "; ") + message;
  }
};

/// From the first call on, console_bridge is silent in this process. Never undone, so that threads need no lock.
void silence_console_bridge() {
  static MessageCapture capture;
  static const bool kInstalled = (console_bridge::useOutputHandler(&capture), true);
  static_cast<void>(kInstalled);
}

/// Names and messages come from the file: printable, on one line, of bounded length.
std::string printable(std::string_view text, std::size_t max_size = 60) {
  std::string result(text.substr(0, max_size));
  std::replace_if(
      result.begin(), result.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
  return text.size() > max_size ? result + "..." : result;
}

Error urdf_error(Errc code, std::string_view kind, std::string_view name, std::string_view what) {
  return make_error(code, "URDF: %s '%s' %s", std::string(kind).c_str(), printable(name).c_str(),
                    std::string(what).c_str());
}

Error joint_error(std::string_view name, std::string_view what) {
  return urdf_error(Errc::kMalformed, "joint", name, what);
}

std::string attribute(const TiXmlElement* element, const char* name) {
  const char* value = element == nullptr ? nullptr : element->Attribute(name);
  return value == nullptr ? std::string() : std::string(value);
}

/// urdfdom builds cycles of shared pointers from cyclic trees and lets a second parent overwrite the first: look at the
/// bare parent-child pairs first.
Status check_tree(const std::string& text) {
  TiXmlDocument document;
  document.Parse(text.c_str());
  const TiXmlElement* robot = document.FirstChildElement("robot");
  if (document.Error() || robot == nullptr) {
    return make_error(Errc::kMalformed, "URDF: not a readable <robot> document (%s, line %d)",
                      document.Error() ? printable(document.ErrorDesc(), 80).c_str() : "no <robot> element",
                      document.ErrorRow());
  }
  std::size_t links = 0;
  for (auto* link = robot->FirstChildElement("link"); link != nullptr; link = link->NextSiblingElement("link")) ++links;
  if (links > kMaxUrdfLinks) {
    return make_error(Errc::kUnsupported, "URDF: %zu links are more than the %zu allowed", links, kMaxUrdfLinks);
  }
  std::map<std::string, std::string> parent_of;
  for (auto* joint = robot->FirstChildElement("joint"); joint != nullptr; joint = joint->NextSiblingElement("joint")) {
    const std::string child = attribute(joint->FirstChildElement("child"), "link");
    const std::string parent = attribute(joint->FirstChildElement("parent"), "link");
    if (attribute(joint, "name").empty()) return joint_error("", "needs a name");
    if (child.empty() || parent.empty()) {
      return joint_error(attribute(joint, "name"), "needs a parent link and a child link");
    }
    if (!parent_of.emplace(child, parent).second) {
      return urdf_error(Errc::kMalformed, "link", child, "is the child of two joints; a robot must be a tree");
    }
  }
  std::set<std::string> reach_root;  // links whose way to the root has been walked
  for (const auto& entry : parent_of) {
    std::set<std::string> path;
    for (std::string link = entry.first; reach_root.count(link) == 0;) {
      if (!path.insert(link).second) {
        return urdf_error(Errc::kMalformed, "link", link, "is its own ancestor; a robot must be a tree");
      }
      const auto parent = parent_of.find(link);
      if (parent == parent_of.end()) break;
      link = parent->second;
    }
    reach_root.merge(path);
  }
  return {};
}

Result<JointType> joint_type(const urdf::Joint& joint) {
  switch (joint.type) {
    case urdf::Joint::FIXED:
      return JointType::kFixed;
    case urdf::Joint::REVOLUTE:
      return JointType::kRevolute;
    case urdf::Joint::CONTINUOUS:
      return JointType::kContinuous;
    case urdf::Joint::PRISMATIC:
      return JointType::kPrismatic;
    default:
      return urdf_error(Errc::kUnsupported, "joint", joint.name,
                        "is floating or planar; use fixed, revolute, continuous or prismatic joints");
  }
}

Status set_limits(const urdf::Joint& source, Joint& joint) {
  const bool bounded = joint.type == JointType::kRevolute || joint.type == JointType::kPrismatic;
  if (bounded && source.limits == nullptr) return joint_error(joint.name, "needs <limit lower=... upper=...>");
  if (source.limits != nullptr) {
    joint.max_velocity = source.limits->velocity;
    joint.max_effort = source.limits->effort;
  }
  if (bounded) {
    joint.lower = source.limits->lower;
    joint.upper = source.limits->upper;
  } else {
    joint.lower = -std::numeric_limits<double>::infinity();
    joint.upper = std::numeric_limits<double>::infinity();
  }
  if (bounded && !(std::abs(joint.lower) < kMaxLength && std::abs(joint.upper) < kMaxLength)) {
    return joint_error(joint.name, "has a limit that is not a finite angle or length");
  }
  if (joint.type == JointType::kRevolute && std::max(-joint.lower, joint.upper) > kMostTurned) {
    return joint_error(joint.name, "has a limit of more than four turns; URDF counts in radians");
  }
  if (joint.lower > joint.upper) return joint_error(joint.name, "has a lower limit above its upper limit");
  if (!std::isfinite(joint.max_velocity) || !std::isfinite(joint.max_effort)) {
    return joint_error(joint.name, "has an effort or velocity limit that is not finite");
  }
  if (joint.max_velocity < 0.0 || joint.max_effort < 0.0) {
    return joint_error(joint.name, "has an effort or velocity limit below zero");
  }
  return {};
}

/// Everything of one joint but links and mimic.
Result<Joint> convert_joint(const urdf::Joint& source) {
  Joint joint;
  joint.name = source.name;
  const Result<JointType> type = joint_type(source);
  if (!type) return type.error();
  joint.type = *type;
  const urdf::Pose& origin = source.parent_to_joint_origin_transform;
  const Eigen::Quaterniond rotation(origin.rotation.w, origin.rotation.x, origin.rotation.y, origin.rotation.z);
  const Eigen::Vector3d position(origin.position.x, origin.position.y, origin.position.z);
  if (!(position.cwiseAbs().maxCoeff() < kMaxLength) || !(std::abs(rotation.norm() - 1.0) < 1e-6)) {
    return joint_error(joint.name, "has an origin that is not a finite pose within 1 km");
  }
  joint.X_PC.linear() = rotation.normalized().toRotationMatrix();
  joint.X_PC.translation() = position;
  if (joint.type == JointType::kFixed) return joint;
  const Eigen::Vector3d axis(source.axis.x, source.axis.y, source.axis.z);
  const double length = axis.stableNorm();
  if (!std::isfinite(length) || length < 1e-6) return joint_error(joint.name, "has an axis of length zero");
  joint.axis = axis / length;
  if (const Status limits = set_limits(source, joint); !limits) return limits.error();
  return joint;
}

/// Replaces mimics of mimics by mimics of the independent joint. `mimicked[i]` is the name that joint i mimics.
Status resolve_mimics(std::vector<Joint>& joints, const std::vector<std::string>& mimicked, const RobotModel& model) {
  for (std::size_t i = 0; i < joints.size(); ++i) {
    if (!joints[i].mimic) continue;
    const std::optional<std::size_t> target = model.find_joint(mimicked[i]);
    if (!target) return joint_error(joints[i].name, "mimics '" + printable(mimicked[i]) + "', which does not exist");
    if (joints[i].type == JointType::kFixed || joints[*target].type == JointType::kFixed) {
      return joint_error(joints[i].name, "and the joint that it mimics must both move");
    }
    if (!(std::abs(joints[i].mimic->multiplier) < kMaxLength && std::abs(joints[i].mimic->offset) < kMaxLength)) {
      return joint_error(joints[i].name, "has a mimic multiplier or offset that is not finite");
    }
    joints[i].mimic->joint = *target;
  }
  for (std::size_t i = 0; i < joints.size(); ++i) {
    std::size_t hops = 0;
    while (joints[i].mimic && joints[joints[i].mimic->joint].mimic) {
      const Mimic inner = *joints[joints[i].mimic->joint].mimic;
      Mimic& outer = *joints[i].mimic;
      if (inner.joint == i || ++hops > joints.size()) return joint_error(joints[i].name, "mimics itself");
      outer = {inner.joint, outer.multiplier * inner.multiplier, outer.multiplier * inner.offset + outer.offset};
    }
  }
  return {};
}

Result<RobotModel> convert(const urdf::ModelInterface& source) {
  RobotModel model;
  model.name = source.getName();
  std::vector<urdf::LinkConstSharedPtr> order{source.getRoot()};
  std::vector<std::string> mimicked;
  model.links.push_back({order[0]->name, kNoIndex});
  for (std::size_t parent = 0; parent < order.size(); ++parent) {  // breadth first: parents before children
    for (const urdf::JointSharedPtr& child : order[parent]->child_joints) {
      Result<Joint> joint = convert_joint(*child);
      if (!joint) return joint.error();
      joint->parent_link = parent;
      joint->child_link = order.size();
      if (child->mimic != nullptr) joint->mimic = Mimic{kNoIndex, child->mimic->multiplier, child->mimic->offset};
      mimicked.push_back(child->mimic != nullptr ? child->mimic->joint_name : std::string());
      model.links.push_back({child->child_link_name, model.joints.size()});
      model.joints.push_back(std::move(*joint));
      order.push_back(source.getLink(child->child_link_name));
    }
  }
  if (const Status mimics = resolve_mimics(model.joints, mimicked, model); !mimics) return mimics.error();
  return model;
}

Result<RobotModel> parse(std::string_view view) {
  if (const Status bounds = check_xml_bounds(view, kXmlLimits); !bounds) {
    return make_error(bounds.error().code, "URDF: %s", bounds.error().detail.c_str());
  }
  silence_console_bridge();
  MessageCapture::text().clear();
  const std::string text(view);
  if (const Status tree = check_tree(text); !tree) return tree.error();
  const urdf::ModelInterfaceSharedPtr source = urdf::parseURDF(text);
  if (source == nullptr || source->getRoot() == nullptr) {
    const std::string& reason = MessageCapture::text();
    return make_error(Errc::kMalformed, "URDF: %s",
                      reason.empty() ? "the parser refused it without a reason" : printable(reason, 180).c_str());
  }
  return convert(*source);
}

template <class T>
std::optional<std::size_t> find_name(const std::vector<T>& items, std::string_view name) noexcept {
  const auto found = std::find_if(items.begin(), items.end(), [&](const T& item) { return item.name == name; });
  if (found == items.end()) return std::nullopt;
  return static_cast<std::size_t>(found - items.begin());
}

}  // namespace

std::optional<std::size_t> RobotModel::find_link(std::string_view link_name) const noexcept {
  return find_name(links, link_name);
}

std::optional<std::size_t> RobotModel::find_joint(std::string_view joint_name) const noexcept {
  return find_name(joints, joint_name);
}

Result<RobotModel> load_urdf(std::string_view text) noexcept {
  try {
    return parse(text);
  } catch (const std::exception& exception) {
    // e.g. "Failed converting string to double": urdfdom throws it without saying where, but often logs first.
    const std::string& reason = MessageCapture::text();
    return make_error(Errc::kMalformed, "URDF: unreadable value (%.60s)%s%.140s", exception.what(),
                      reason.empty() ? "" : ": ", reason.c_str());
  } catch (...) {
    return Error{Errc::kMalformed, "URDF: the parser failed with an unknown exception"};
  }
}

}  // namespace embody::robot
