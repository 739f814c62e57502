#include "tests/unit/robot/hand_files.hpp"

#include <toml++/toml.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <stdexcept>

namespace embody::test {
namespace {

using View = toml::node_view<toml::node>;

template <class T>
std::vector<T> list(const View& node) {
  std::vector<T> values;
  if (const toml::array* items = node.as_array()) {
    for (const toml::node& item : *items) values.push_back(item.value<T>().value());
  }
  return values;
}

Eigen::Vector3d vector3(const View& node) {
  const std::vector<double> values = list<double>(node);
  if (values.size() != 3) throw std::runtime_error("a vector does not have three numbers");
  return Eigen::Vector3d(values.data());
}

Side side_of(const View& node) {
  return node.value_or(std::string("right")) == "left" ? Side::kLeft : Side::kRight;
}

ContactPad pad_of(toml::table& table) {
  ContactPad pad;
  pad.link = table["link"].value<std::string>().value();
  pad.from_m = vector3(table["from_m"]);
  pad.to_m = vector3(table["to_m"]);
  pad.radius_m = table["radius_m"].value<double>().value();
  pad.facing = vector3(table["facing"]);
  pad.width_m = table["width_m"].value_or(0.0);
  return pad;
}

FingerPoints finger_of(const View& node) {
  FingerPoints finger;
  if (!node) return finger;
  finger.link = node["link"].value<std::string>().value();
  finger.tip_m = vector3(node["tip_m"]);
  finger.middle_link = node["middle_link"].value_or(std::string());
  finger.middle_m = vector3(node["middle_m"]);
  if (toml::array* pads = node["pads"].as_array()) {
    for (toml::node& pad : *pads) finger.pads.push_back(pad_of(*pad.as_table()));
  }
  return finger;
}

double interpolate(const JointCoupling& coupling, double r) {
  const auto& x = coupling.motor_rad;
  const auto& y = coupling.joint_rad;
  if (r <= x.front()) return y.front();
  for (std::size_t i = 1; i < x.size(); ++i) {
    if (r <= x[i]) return y[i - 1] + (y[i] - y[i - 1]) * (r - x[i - 1]) / (x[i] - x[i - 1]);
  }
  return y.back();
}

void follow_mimics(const robot::RobotModel& model, std::vector<double>& q) {
  for (std::size_t i = 0; i < q.size(); ++i) {
    if (const auto& mimic = model.joints[i].mimic) q[i] = mimic->multiplier * q[mimic->joint] + mimic->offset;
  }
}

}  // namespace

EmbodimentConfig hand_config(const std::string& name) {
  toml::table file = toml::parse_file(EMBODY_SOURCE_DIR "/config/hands/" + name + ".toml");
  EmbodimentConfig config;
  config.name = file["name"].value<std::string>().value();
  config.urdf = file["urdf"].value<std::string>().value();
  config.root_link = file["root_link"].value<std::string>().value();
  config.side = side_of(file["side"]);
  config.file_side = side_of(file["file_side"]);
  config.X_PM = Vector6(list<double>(file["X_PM"]).data());
  config.motors = list<std::string>(file["motors"]);
  config.motor_lower_rad = list<double>(file["motor_lower_rad"]);
  config.motor_upper_rad = list<double>(file["motor_upper_rad"]);
  if (toml::array* couplings = file["couplings"].as_array()) {
    for (toml::node& item : *couplings) {
      toml::table& node = *item.as_table();
      config.couplings.push_back({node["joint"].value<std::string>().value(),
                                  node["motor"].value<std::string>().value(), list<double>(node["motor_rad"]),
                                  list<double>(node["joint_rad"])});
    }
  }
  config.thumb_motor = file["thumb_motor"].value_or(std::string());
  config.thumb_opposed_from_rad = file["thumb_opposed_from_rad"].value_or(0.0);
  config.finger_zero_offset_rad = file["finger_zero_offset_rad"].value_or(0.0);
  config.zero_offset_joints = list<std::string>(file["zero_offset_joints"]);
  for (std::size_t i = 0; i < kFingers; ++i) config.fingers[i] = finger_of(file[kFingerNames[i]]);
  return config;
}

robot::RobotModel hand_model(const std::string& name) {
  std::ifstream file(EMBODY_SOURCE_DIR "/config/hands/" + name + ".urdf");
  const std::string text{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  auto model = robot::load_urdf(text);
  if (!model) throw std::runtime_error(name + ": " + model.error().detail.c_str());
  return std::move(*model);
}

std::vector<double> joint_angles(const robot::RobotModel& model, const std::map<std::string, double>& named_rad) {
  std::vector<double> q(model.joints.size(), 0.0);
  for (const auto& [joint, angle_rad] : named_rad) {
    const auto index = model.find_joint(joint);
    if (!index) throw std::runtime_error(model.name + " has no joint " + joint);
    q[*index] = angle_rad;
  }
  follow_mimics(model, q);
  return q;
}

std::vector<double> motor_angles(const robot::RobotModel& model, const EmbodimentConfig& config,
                                 std::span<const double> r_rad) {
  std::map<std::string, double> named_rad;
  for (std::size_t i = 0; i < config.motors.size(); ++i) {
    if (model.find_joint(config.motors[i])) named_rad[config.motors[i]] = r_rad[i];
  }
  for (const JointCoupling& coupling : config.couplings) {
    const auto motor = std::find(config.motors.begin(), config.motors.end(), coupling.motor);
    if (motor == config.motors.end()) throw std::runtime_error("a coupling has an unknown motor " + coupling.motor);
    named_rad[coupling.joint] = interpolate(coupling, r_rad[static_cast<std::size_t>(motor - config.motors.begin())]);
  }
  return joint_angles(model, named_rad);
}

std::vector<Pose> link_poses(const robot::RobotModel& model, std::span<const double> q_rad) {
  std::vector<Pose> X_PL(model.links.size(), Pose::Identity());
  for (std::size_t i = 0; i < model.joints.size(); ++i) {
    const robot::Joint& joint = model.joints[i];
    Pose X_JC = Pose::Identity();
    if (joint.type == robot::JointType::kPrismatic) {
      X_JC.translation() = q_rad[i] * joint.axis;
    } else if (joint.type != robot::JointType::kFixed) {
      X_JC.linear() = Eigen::AngleAxisd(q_rad[i], joint.axis).toRotationMatrix();
    }
    X_PL[joint.child_link] = X_PL[joint.parent_link] * joint.X_PC * X_JC;
  }
  return X_PL;
}

Eigen::Vector3d point_P(const robot::RobotModel& model, std::span<const double> q_rad, const std::string& link,
                        const Eigen::Vector3d& p_L) {
  const auto index = model.find_link(link);
  if (!index) throw std::runtime_error(model.name + " has no link " + link);
  return link_poses(model, q_rad)[*index] * p_L;
}

}  // namespace embody::test
