#include "tests/unit/embodiment/mia_config.hpp"

#include <toml++/toml.h>

#include "tests/unit/robot/mia_urdf.hpp"

namespace embody::test {
namespace {

std::vector<double> numbers(const toml::node_view<toml::node>& node) {
  std::vector<double> values;
  for (const toml::node& item : *node.as_array()) values.push_back(item.value<double>().value());
  return values;
}

std::vector<std::string> names(const toml::node_view<toml::node>& node) {
  std::vector<std::string> values;
  for (const toml::node& item : *node.as_array()) values.push_back(item.value<std::string>().value());
  return values;
}

}  // namespace

EmbodimentConfig mia_config() {
  toml::table file = toml::parse_file(EMBODY_SOURCE_DIR "/config/hands/mia.toml");
  EmbodimentConfig config;
  config.name = file["name"].value<std::string>().value();
  config.urdf = file["urdf"].value<std::string>().value();
  config.root_link = file["root_link"].value<std::string>().value();
  config.X_PM = Vector6(numbers(file["X_PM"]).data());
  config.motors = names(file["motors"]);
  config.motor_lower_rad = numbers(file["motor_lower_rad"]);
  config.motor_upper_rad = numbers(file["motor_upper_rad"]);
  config.thumb_mode = file["thumb_mode"].value<std::string>() == "opposed" ? ThumbMode::kOpposed : ThumbMode::kLateral;
  config.thumb_motor = file["thumb_motor"].value<std::string>().value();
  config.thumb_opposed_from_rad = file["thumb_opposed_from_rad"].value<double>().value();
  for (toml::node& item : *file["couplings"].as_array()) {
    const toml::node_view<toml::node> coupling(item);
    config.couplings.push_back({coupling["joint"].value<std::string>().value(),
                                coupling["motor"].value<std::string>().value(), numbers(coupling["motor_rad"]),
                                numbers(coupling["joint_rad"])});
  }
  config.finger_zero_offset_rad = file["finger_zero_offset_rad"].value<double>().value();
  config.zero_offset_joints = names(file["zero_offset_joints"]);
  for (std::size_t i = 0; i < kFingers; ++i) {
    const auto finger = file[kFingerNames[i]];
    config.fingers[i].link = finger["link"].value<std::string>().value();
    config.fingers[i].tip_m = Eigen::Vector3d(numbers(finger["tip_m"]).data());
    config.fingers[i].middle_m = Eigen::Vector3d(numbers(finger["middle_m"]).data());
  }
  return config;
}

robot::RobotModel mia_model() {
  auto model = robot::load_urdf(mia_urdf());
  if (!model) throw std::runtime_error(model.error().detail.c_str());
  return std::move(*model);
}

}  // namespace embody::test
