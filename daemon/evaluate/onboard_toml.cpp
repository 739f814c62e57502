#include "daemon/evaluate/onboard_toml.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <span>

#include "daemon/evaluate/print.hpp"

namespace embody::evaluate {
namespace {

using nlohmann::ordered_json;

/// A TOML string: JSON's, in ASCII, escapes the same characters.
std::string quoted(const std::string& text) {
  std::string out = nlohmann::json(text).dump(-1, ' ', true, ordered_json::error_handler_t::replace);
  for (std::size_t at = out.find('\x7f'); at != std::string::npos; at = out.find('\x7f', at)) {
    out.replace(at, 1, "\\u007F");  // JSON lets it pass
  }
  return out;
}

/// Six digits behind the point, without trailing zeros.
std::string decimal(double value) {
  std::string text;
  print(text, "%.6f", value);
  while (text.back() == '0' && text[text.size() - 2] != '.') text.pop_back();
  return text == "-0.0" ? "0.0" : text;
}

/// TOML arrays may break their lines: long ones stay within the page.
std::string array(const std::vector<std::string>& items) {
  std::string text = "[", line = "[";
  for (std::size_t i = 0; i < items.size(); ++i) {
    const std::string item = (i == 0 ? "" : ", ") + items[i];
    if (i > 0 && line.size() + item.size() > 96) {
      text += ",\n  ";
      line = "  " + items[i];
      text += items[i];
      continue;
    }
    text += item;
    line += item;
  }
  return text + "]";
}

std::string list(std::span<const double> values) {
  std::vector<std::string> items;
  for (const double value : values) items.push_back(decimal(value));
  return array(items);
}

std::string list(const Eigen::Vector3d& v) {
  return list(std::span(v.data(), 3));
}

std::string list(const std::vector<std::string>& names) {
  std::vector<std::string> items;
  items.reserve(names.size());
  for (const std::string& name : names) items.push_back(quoted(name));
  return array(items);
}

/// Inner bounds of the range, so that rounding never leaves the URDF's limits.
std::vector<double> rounded(const std::vector<double>& values, bool up) {
  std::vector<double> out;
  out.reserve(values.size());
  for (const double v : values) out.push_back((up ? std::ceil(1e6 * v - 1e-3) : std::floor(1e6 * v + 1e-3)) / 1e6);
  return out;
}

/// On one line, without what could end a comment or write over a terminal.
std::string comment(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; }, '?');
  std::string out = "#";
  std::size_t column = 1;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find(' ', at), text.size());
    if (column + end - at >= 118 && column > 1) out += "\n#  ", column = 3;
    out += " " + text.substr(at, end - at);
    column += 1 + end - at;
    at = end + 1;
  }
  return out + "\n";
}

void add_finger(std::string& text, const std::string& name, const FingerPoints& points) {
  text += "\n[" + name + "]\nlink = " + quoted(points.link) + "\ntip_m = " + list(points.tip_m) + "\n";
  if (points.middle_link != points.link) text += "middle_link = " + quoted(points.middle_link) + "\n";
  text += "middle_m = " + list(points.middle_m) + "\n";
  for (const ContactPad& pad : points.pads) {
    text += "\n[[" + name + ".pads]]\nlink = " + quoted(pad.link) + "\nfrom_m = " + list(pad.from_m) +
            "\nto_m = " + list(pad.to_m) + "\nradius_m = " + decimal(pad.radius_m) + "\nfacing = " + list(pad.facing) +
            "\n";
  }
}

const char* side_name(Side side) {
  return kSideNames[static_cast<std::size_t>(side)];
}

std::string printable_ascii(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
  return text;
}

}  // namespace

std::string onboard_toml(const Onboarding& onboarding, const std::string& source) {
  const EmbodimentConfig& hand = onboarding.config;
  std::string text = comment("Proposed by embodyctl onboard from " + source + ". Check by eye:");
  for (const std::string& line : onboarding.check_by_eye) text += comment("- " + line);
  text += "name = " + quoted(hand.name) + "\nurdf = " + quoted(hand.urdf) +
          "   # relative to this file\nroot_link = " + quoted(hand.root_link) + "   # frame P\n";
  print(text,
        "file_side = \"%s\"   # that the URDF and the numbers below describe\nside = \"%s\"        # to drive\n\n",
        side_name(hand.file_side), side_name(hand.side));
  text +=
      "# Base of the human hand model in P: exponential coordinates [w, v] (rotation vector in rad, then v in m).\n";
  print(text, "# The flat human hand laid onto the open robot hand; %.0f mm root mean square.\n",
        1e3 * onboarding.score.fit_m);
  text +=
      "X_PM = " + list(std::span(hand.X_PM.data(), 6)) +
      "\n\n# Coordinates of the driver, in its order: put them into the order of your driver. Mimic joints follow.\n" +
      "motors = " + list(hand.motors) + "\nmotor_lower_rad = " + list(rounded(hand.motor_lower_rad, true)) +
      "\nmotor_upper_rad = " + list(rounded(hand.motor_upper_rad, false)) + "\n\n" +
      "# Points that follow the tip and the middle marker of the human finger (on the back of the finger, where\n"
      "# markers sit), and the palmar surface of its last link (pads), in the link's frame.\n";
  text.pop_back();
  text += "\n";
  for (std::size_t f = 0; f < kFingers; ++f) {
    if (!hand.fingers[f].link.empty()) add_finger(text, kFingerNames[f], hand.fingers[f]);
  }
  return text;
}

std::string onboard_text(const robot::RobotModel& model, const Onboarding& onboarding) {
  std::string text;
  const robot::HandAnatomy& anatomy = onboarding.anatomy;
  print(text, "%s hand, palm %.60s, %zu motors, X_PM fits the flat hand within %.0f mm\n",
        side_name(onboarding.config.side), printable_ascii(model.links[anatomy.palm_link].name).c_str(),
        onboarding.config.motors.size(), 1e3 * onboarding.score.fit_m);
  print(text, "%-8s %-28s %9s %9s %9s %9s\n", "finger", "tip link", "length mm", "human mm", "reach %", "pinch mm");
  for (std::size_t f = 0; f < kFingers; ++f) {
    if (!onboarding.score.fingers[f]) continue;
    const FingerScore& score = *onboarding.score.fingers[f];
    std::optional<double> pinch_mm = score.pinch_m;
    if (pinch_mm) *pinch_mm *= 1e3;
    print(text, "%-8s %-28.28s %9.0f %9.0f %9.0f %9s\n", kFingerNames[f],
          printable_ascii(onboarding.config.fingers[f].link).c_str(), 1e3 * score.length_m, 1e3 * score.human_length_m,
          1e2 * score.reach, number(pinch_mm, "%.0f").c_str());
  }
  text +=
      "reach: human tip positions that the robot's come within 10 mm of (one motor per finger: a few % are the most)\n"
      "pinch: least distance of the tips' centres; two fingers of 8 mm radius touch at 16 mm\n";
  for (const std::string& line : onboarding.check_by_eye) text += "check by eye: " + printable_ascii(line) + "\n";
  return text;
}

std::string onboard_json(const robot::RobotModel& model, const Onboarding& onboarding) {
  const EmbodimentConfig& hand = onboarding.config;
  ordered_json object{{"name", hand.name},
                      {"palm_link", model.links[onboarding.anatomy.palm_link].name},
                      {"side", side_name(hand.side)},
                      {"side_sure", onboarding.anatomy.side_sure},
                      {"motors", hand.motors},
                      {"X_PM_exponential", std::vector<double>(hand.X_PM.data(), hand.X_PM.data() + 6)},
                      {"X_PM_rms_m", onboarding.score.fit_m},
                      {"scale", onboarding.score.scale}};
  for (std::size_t f = 0; f < kFingers; ++f) {
    ordered_json& finger = object["fingers"][kFingerNames[f]];
    if (!onboarding.score.fingers[f]) continue;
    const FingerScore& score = *onboarding.score.fingers[f];
    finger = {{"link", hand.fingers[f].link},
              {"length_m", score.length_m},
              {"human_length_m", score.human_length_m},
              {"reach", score.reach},
              {"pinch_m", json_number(score.pinch_m)}};
  }
  object["check_by_eye"] = onboarding.check_by_eye;
  return object.dump(2, ' ', false, ordered_json::error_handler_t::replace);
}

}  // namespace embody::evaluate
