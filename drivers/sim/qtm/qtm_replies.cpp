#include "drivers/sim/qtm/qtm_replies.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <utility>

namespace embody::sim {
namespace {

using qualisys::Component;

template <class Number>
bool parse_number(std::string_view text, Number& value) noexcept {
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value);
  return failure == std::errc{} && end == text.data() + text.size();
}

std::string escape(std::string_view text) {
  std::string escaped;
  for (const char c : text) {
    switch (c) {
      case '&':
        escaped += "&amp;";
        break;
      case '<':
        escaped += "&lt;";
        break;
      case '>':
        escaped += "&gt;";
        break;
      default:
        escaped += c;
    }
  }
  return escaped;
}

std::string element(const char* name, std::string_view text) {
  return std::string("<") + name + ">" + escape(text) + "</" + name + ">\r\n";
}

std::string actions(const char* name, bool realtime) {
  std::string xml = std::string("<") + name + ">\r\n" + element("PreProcessing2D", "false") +
                    element("Tracking", "3D") + element("TwinSystemMerge", "false") + element("SplineFill", "false") +
                    element("AIM", "true") + element("Track6DOF", "false") + element("ForceData", "false") +
                    element("GazeVector", "false");
  if (!realtime) {
    for (const char* step : {"ExportTSV", "ExportC3D", "ExportMatlabFile", "ExportAviFile"}) {
      xml += element(step, "false");
    }
  }
  return xml + "</" + name + ">\r\n";
}

std::string general_xml(const QtmSetup& setup) {
  char rate[32];
  std::snprintf(rate, sizeof rate, "%g", setup.rate_hz);
  std::string xml = "<General>\r\n" + element("Frequency", rate) + element("Capture_Time", "10.000000");
  for (const char* trigger :
       {"Start_On_External_Trigger", "Start_On_Trigger_NO", "Start_On_Trigger_NC", "Start_On_Trigger_Software"}) {
    xml += element(trigger, "false");
  }
  xml += "<External_Time_Base>\r\n";
  constexpr std::array<std::pair<const char*, const char*>, 10> kTimeBase{{{"Enabled", "false"},
                                                                           {"Signal_Source", "Control port"},
                                                                           {"Signal_Mode", "Periodic"},
                                                                           {"Frequency_Multiplier", "1"},
                                                                           {"Frequency_Divisor", "1"},
                                                                           {"Frequency_Tolerance", "1000"},
                                                                           {"Nominal_Frequency", "None"},
                                                                           {"Signal_Edge", "Negative"},
                                                                           {"Signal_Shutter_Delay", "0"},
                                                                           {"Non_Periodic_Timeout", "10.000000"}}};
  for (const auto& [name, value] : kTimeBase) xml += element(name, value);
  xml += "</External_Time_Base>\r\n";
  return xml + actions("Processing_Actions", false) + actions("RealTime_Processing_Actions", true) +
         actions("Reprocessing_Actions", false) + "</General>\r\n";
}

std::string markers_xml(const QtmSetup& setup) {
  std::string xml = "<The_3D>\r\n" + element("AxisUpwards", setup.axis) +
                    element("CalibrationTime", setup.calibrated ? "2021-08-26 14:02:11" : "") +
                    element("Labels", std::to_string(setup.labels.size()));
  for (const auto& label : setup.labels) {
    xml += "<Label>\r\n" + element("Name", label) + element("RGBColor", "65280") +
           element("Trajectory_Type", "Measured") + "</Label>\r\n";
  }
  return xml + "</The_3D>\r\n";
}

/// Text of one section in lower case; nothing when QTM has no such section.
std::optional<std::string> section_xml(std::string_view section, const QtmSetup& setup) {
  if (section == "general") return general_xml(setup);
  if (section == "3d") return markers_xml(setup);
  constexpr std::array<std::pair<std::string_view, const char*>, 8> kEmpty{{{"6d", "The_6D"},
                                                                            {"analog", "Analog"},
                                                                            {"force", "Force"},
                                                                            {"image", "Image"},
                                                                            {"gazevector", "Gaze_Vector"},
                                                                            {"eyetracker", "Eye_Tracker"},
                                                                            {"skeleton", "Skeletons"},
                                                                            {"skeleton:global", "Skeletons"}}};
  const auto* found = std::find_if(kEmpty.begin(), kEmpty.end(), [&](const auto& e) { return e.first == section; });
  if (found == kEmpty.end()) return {};
  return element(found->second, "");
}

}  // namespace

std::vector<std::string> command_words(std::string_view command) {
  std::vector<std::string> words;
  bool inside = false;
  for (const char c : command.substr(0, command.find('\0'))) {
    const bool blank = c == ' ' || c == '\t' || c == '\r' || c == '\n';
    if (!blank && !inside) words.emplace_back();
    if (!blank) words.back() += c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    inside = !blank;
  }
  return words;
}

std::optional<int> supported_minor_version(std::string_view version) {
  constexpr std::string_view kMajor = "1.";
  int minor = 0;
  if (!version.starts_with(kMajor) || !parse_number(version.substr(kMajor.size()), minor)) return {};
  if (minor < 8 || minor > 28) return {};
  return minor;
}

std::optional<std::vector<Component>> parse_components(const std::vector<std::string>& words, std::size_t first) {
  std::vector<Component> components;
  for (std::size_t i = first; i < words.size(); ++i) {
    if (words[i] != "3d" && words[i] != "3dres") return {};
    const auto component = words[i] == "3d" ? Component::k3d : Component::k3dResidual;
    if (std::find(components.begin(), components.end(), component) == components.end()) components.push_back(component);
  }
  if (components.empty()) return {};
  return components;
}

std::optional<StreamRequest> parse_stream(const std::vector<std::string>& words, double rate_hz) {
  auto components = parse_components(words, 2);
  if (!components) return {};
  StreamRequest request{1, std::move(*components)};
  const std::string_view rate = words[1];
  constexpr std::string_view kFrequency = "frequency:";
  constexpr std::string_view kDivisor = "frequencydivisor:";
  if (rate == "allframes") return request;
  if (rate.starts_with(kDivisor)) {
    if (!parse_number(rate.substr(kDivisor.size()), request.divisor) || request.divisor == 0) return {};
    return request;
  }
  std::size_t frequency_hz = 0;
  if (!rate.starts_with(kFrequency) || !parse_number(rate.substr(kFrequency.size()), frequency_hz)) return {};
  if (frequency_hz == 0) return {};
  request.divisor = static_cast<std::size_t>(std::max(1.0, std::round(rate_hz / static_cast<double>(frequency_hz))));
  return request;
}

std::optional<std::string> parameters_xml(const std::vector<std::string>& words, const QtmSetup& setup,
                                          int minor_version) {
  if (words.size() < 2) return {};
  char root[40];
  std::snprintf(root, sizeof root, "QTM_Parameters_Ver_1.%02d", minor_version);
  std::string xml = std::string("<") + root + ">\r\n";
  for (std::size_t i = 1; i < words.size(); ++i) {
    if (words[i] == "all") {
      xml += general_xml(setup) + markers_xml(setup);
      continue;
    }
    const auto section = section_xml(words[i], setup);
    if (!section) return {};
    xml += *section;
  }
  return xml + "</" + root + ">\r\n";
}

}  // namespace embody::sim
