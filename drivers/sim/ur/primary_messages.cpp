#include "drivers/sim/ur/primary_messages.hpp"

namespace embody::sim {
namespace {

constexpr std::int8_t kFromController = -2;
constexpr std::uint8_t kJointRunning = 253;

/// A message, or a part of one, whose size is filled in at the end.
class Writer {
 public:
  explicit Writer(std::uint8_t type) { add(std::uint32_t{0}).add(type); }

  template <class T>
  Writer& add(T value) {
    const std::size_t offset = bytes_.size();
    bytes_.resize(offset + sizeof(T));
    rtde::store(bytes_, offset, value);
    return *this;
  }
  Writer& add(std::string_view text) {
    const auto raw = std::as_bytes(std::span(text));
    bytes_.insert(bytes_.end(), raw.begin(), raw.end());
    return *this;
  }
  Writer& add(const math::Vector6& values) {
    for (const double value : values) add(value);
    return *this;
  }
  template <class T>
  Writer& add(const std::array<T, 6>& values) {
    for (const T value : values) add(value);
    return *this;
  }
  Writer& add(const Message& part) {
    bytes_.insert(bytes_.end(), part.begin(), part.end());
    return *this;
  }
  Writer& zeros(std::size_t count) {
    bytes_.resize(bytes_.size() + count);
    return *this;
  }
  [[nodiscard]] Message take() {
    rtde::store(bytes_, 0, static_cast<std::uint32_t>(bytes_.size()));
    return std::move(bytes_);
  }

 private:
  Message bytes_;
};

Writer robot_message(ur::MessageKind kind) {
  Writer out(ur::kRobotMessage);
  out.add(std::uint64_t{0}).add(kFromController).add(static_cast<std::uint8_t>(kind));
  return out;
}

Message mode_part(const RobotReport& r) {
  const auto flag = [](bool on) { return std::uint8_t{on}; };
  Writer out(0);
  out.add(static_cast<std::uint64_t>(r.controller_time_s * 1e6)).add(flag(true)).add(flag(true));
  out.add(flag((r.safety.robot_status_bits & 1U) != 0));
  out.add(flag((r.safety.safety_status_bits & 0b1110'0000U) != 0));
  out.add(flag((r.safety.safety_status_bits & 0b100U) != 0));
  out.add(flag(r.safety.runtime_state == 2)).add(flag(r.safety.runtime_state == 4));
  out.add(static_cast<std::uint8_t>(r.safety.robot_mode)).add(std::uint8_t{0});
  return out.add(r.speed_slider).add(r.speed_slider).add(1.0).add(std::uint8_t{0}).take();
}

Message joint_part(const RobotReport& r) {
  Writer out(1);
  for (int i = 0; i < 6; ++i) {
    out.add(r.q_rad[i]).add(r.q_target_rad[i]).add(r.qd_rad_s[i]);
    out.zeros(4 * sizeof(float)).add(kJointRunning);  // current, voltage, two temperatures
  }
  return out.take();
}

Message kinematics_part(const ur::UrKinematics& k) {
  Writer out(ur::kKinematicsPart);
  return out.add(k.checksum).add(k.theta_rad).add(k.a_m).add(k.d_m).add(k.alpha_rad).add(k.calibration_status).take();
}

}  // namespace

Message encode_robot_state(const RobotReport& report, const ur::UrKinematics* kinematics) {
  Writer out(ur::kRobotState);
  out.add(mode_part(report)).add(joint_part(report));
  out.add(Writer(4).add(report.tcp_pose).add(math::Vector6(math::Vector6::Zero())).take());
  if (kinematics != nullptr) out.add(kinematics_part(*kinematics));
  return out.take();
}

// Size, then doubles only: time, target q, qd, qdd, current, moment, actual q, qd, ...
Message encode_realtime_state(const RobotReport& report) {
  constexpr std::size_t kSize = 1220;
  Message bytes(kSize);
  const auto set = [&bytes](std::size_t index, double value) {
    rtde::store(bytes, sizeof(std::uint32_t) + sizeof(double) * index, value);
  };
  rtde::store(bytes, 0, static_cast<std::uint32_t>(kSize));
  set(0, report.controller_time_s);
  for (std::size_t i = 0; i < 6; ++i) {
    const auto joint = static_cast<Eigen::Index>(i);
    set(1 + i, report.q_target_rad[joint]);
    set(31 + i, report.q_rad[joint]);
    set(37 + i, report.qd_rad_s[joint]);
    set(55 + i, report.tcp_pose[joint]);
  }
  set(94, report.safety.robot_mode);
  set(101, report.safety.safety_status);
  set(131, static_cast<double>(report.safety.runtime_state));
  return bytes;
}

Message encode_text_message(std::string_view text) {
  return robot_message(ur::MessageKind::kText).add(text).take();
}

Message encode_version(const rtde::ControllerVersion& version) {
  constexpr std::string_view kProject = "URControl";
  Writer out = robot_message(ur::MessageKind::kVersion);
  out.add(static_cast<std::uint8_t>(kProject.size())).add(kProject);
  out.add(static_cast<std::uint8_t>(version.major)).add(static_cast<std::uint8_t>(version.minor));
  return out.add(version.bugfix).add(version.build).add(std::string_view("21-09-2022, 00:00:00")).take();
}

Message encode_error_code(int code, int argument, int level, std::string_view text) {
  Writer out = robot_message(ur::MessageKind::kErrorCode);
  out.add(std::int32_t{code}).add(std::int32_t{argument}).add(std::int32_t{level});
  return out.add(std::uint32_t{0}).add(std::uint32_t{0}).add(text).take();
}

Message encode_key_message(std::string_view title, std::string_view text) {
  title = title.substr(0, 255);
  Writer out = robot_message(ur::MessageKind::kKey);
  out.add(std::int32_t{0}).add(std::int32_t{0}).add(static_cast<std::uint8_t>(title.size()));
  return out.add(title).add(text).take();
}

Message encode_runtime_exception(int line, int column, std::string_view text) {
  return robot_message(ur::MessageKind::kRuntimeException)
      .add(std::int32_t{line})
      .add(std::int32_t{column})
      .add(text)
      .take();
}

}  // namespace embody::sim
