#include "daemon/convert/trajectory_columns.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

namespace embody::convert {
namespace {

constexpr std::array kPoseColumns{"time_s", "x_m", "y_m", "z_m", "qw", "qx", "qy", "qz"};
constexpr const char* kValid = "valid";
constexpr std::string_view kAngle = "_rad", kLength = "_m";

/// Text without line breaks and other control characters.
std::string one_line(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) < ' ' || c == '\x7f'; }, '?');
  return text;
}

std::string number_text(double value) {
  std::string text;
  append_number(value, "nan", text);
  return text;
}

std::string frame_text(const Trajectory& trajectory) {
  if (trajectory.object_markers.empty()) return "P in W: the motion-capture world";
  return "P in O: origin in the first object marker, x axis towards the second, the third in the xy plane at y > 0";
}

std::vector<std::string> split(std::string_view text) {
  std::vector<std::string> parts;
  while (!text.empty()) {
    const auto comma = text.find(',');
    parts.emplace_back(text.substr(0, comma));
    text.remove_prefix(comma == std::string_view::npos ? text.size() : comma + 1);
  }
  return parts;
}

}  // namespace

std::vector<std::string> column_names(const Trajectory& trajectory) {
  std::vector<std::string> names(kPoseColumns.begin(), kPoseColumns.end());
  for (const JointColumn& joint : trajectory.joints) {
    names.push_back(joint.name + std::string(joint.prismatic ? kLength : kAngle));
  }
  names.emplace_back(kValid);
  return names;
}

void row_values(const Trajectory& trajectory, std::size_t row, std::vector<double>& values) {
  const TrajectoryRow& r = trajectory.rows[row];
  const Eigen::Quaterniond& o = r.orientation;
  values = {r.time_s, r.p_m.x(), r.p_m.y(), r.p_m.z(), o.w(), o.x(), o.y(), o.z()};
  values.insert(values.end(), trajectory.joints_of(row), trajectory.joints_of(row) + trajectory.joints.size());
  values.push_back(r.valid ? 1.0 : 0.0);
}

Status set_columns(const std::vector<std::string>& names, Trajectory& trajectory) {
  const std::size_t pose = kPoseColumns.size();
  for (std::size_t i = 0; i < pose; ++i) {
    if (i < names.size() && names[i] == kPoseColumns[i]) continue;
    return make_error(Errc::kMalformed, "column %zu is '%.40s' where '%s' belongs", i + 1,
                      i < names.size() ? names[i].c_str() : "", kPoseColumns[i]);
  }
  if (names.size() == pose || names.back() != kValid)
    return make_error(Errc::kMalformed, "the last column is not 'valid'");
  trajectory.joints.clear();
  for (std::size_t i = pose; i + 1 < names.size(); ++i) {
    const bool angle = names[i].ends_with(kAngle);
    if (!angle && !names[i].ends_with(kLength)) {
      return make_error(Errc::kMalformed, "column %zu, '%.40s', ends neither in _rad nor in _m", i + 1,
                        names[i].c_str());
    }
    trajectory.joints.push_back({names[i].substr(0, names[i].size() - (angle ? kAngle : kLength).size()), !angle});
  }
  return {};
}

void append_row(const std::vector<double>& values, Trajectory& trajectory) {
  TrajectoryRow& row = trajectory.rows.emplace_back();
  row.time_s = values[0];
  row.p_m = {values[1], values[2], values[3]};
  row.orientation = Eigen::Quaterniond(values[4], values[5], values[6], values[7]);
  row.valid = values.back() != 0.0;
  const auto first = values.begin() + static_cast<std::ptrdiff_t>(kPoseColumns.size());
  trajectory.q.insert(trajectory.q.end(), first, values.end() - 1);
}

std::vector<std::pair<std::string, std::string>> about(const Trajectory& trajectory) {
  std::vector<std::pair<std::string, std::string>> lines{
      {"format", "embody trajectory " + std::to_string(kFormatVersion)},
      {"source", one_line(trajectory.source)},
      {"hand", one_line(trajectory.hand)},
      {"first_frame", std::to_string(trajectory.first_frame)},
      {"last_frame", std::to_string(trajectory.last_frame)},
      {"rate_hz", number_text(trajectory.rate_hz)},
      {"pose", frame_text(trajectory)},
      {"frame_P", "root link of the robot hand's URDF"},
      {"time_s", "since frame 1 of the source"},
      {"x_m y_m z_m", "origin of P, metres"},
      {"qw qx qy qz", "orientation of P, unit quaternion, scalar first, sign without jumps"},
      {"joints", "URDF joints: _rad radians, _m metres"},
      {"valid", "1: measured; 0: the last known pose and joints (nan or null: nothing known yet)"}};
  if (!trajectory.label.empty()) lines.insert(lines.begin() + 3, {"label", one_line(trajectory.label)});
  if (!trajectory.object_markers.empty()) {
    std::string names;
    for (const std::string& name : trajectory.object_markers) names += (names.empty() ? "" : ",") + one_line(name);
    lines.insert(lines.begin() + 3, {"object", names});
  }
  return lines;
}

bool set_about(std::string_view key, std::string_view text, Trajectory& trajectory) {
  const auto count = [text](std::size_t& value) {
    double number = 0.0;
    if (!parse_number(text, number) || !(number >= 0.0 && number < 1e15)) return false;
    value = static_cast<std::size_t>(number);
    return true;
  };
  if (key == "source") trajectory.source = text;
  if (key == "hand") trajectory.hand = text;
  if (key == "label") trajectory.label = text;
  if (key == "object") trajectory.object_markers = split(text);
  if (key == "first_frame") return count(trajectory.first_frame);
  if (key == "last_frame") return count(trajectory.last_frame);
  if (key == "rate_hz") return parse_number(text, trajectory.rate_hz) && trajectory.rate_hz > 0.0;
  return true;
}

void append_number(double value, std::string_view missing, std::string& text) {
  if (!std::isfinite(value)) {
    text += missing;
    return;
  }
  constexpr int kDigits = 9;
  std::array<char, 32> digits;
  const auto end =
      std::to_chars(digits.data(), digits.data() + digits.size(), value, std::chars_format::general, kDigits);
  text.append(digits.data(), end.ptr);
}

bool parse_number(std::string_view text, double& value) noexcept {
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value);
  return failure == std::errc{} && end == text.data() + text.size();
}

}  // namespace embody::convert
