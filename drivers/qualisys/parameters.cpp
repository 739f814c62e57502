#include "drivers/qualisys/parameters.hpp"

#include <tinyxml2.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "drivers/qualisys/codec.hpp"

namespace embody::qualisys {
namespace {

std::string_view trim(std::string_view text) noexcept {
  constexpr std::string_view kBlank = " \t\r\n";
  const auto first = text.find_first_not_of(kBlank);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlank) - first + 1);
}

/// Trimmed text of the child `name`; empty when the child is absent or empty.
std::string_view child_text(const tinyxml2::XMLElement& parent, const char* name) noexcept {
  const auto* child = parent.FirstChildElement(name);
  const char* text = child == nullptr ? nullptr : child->GetText();
  return text == nullptr ? std::string_view{} : trim(text);
}

template <class Number>
bool parse_number(std::string_view text, Number& value) noexcept {
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value);
  return failure == std::errc{} && end == text.data() + text.size();
}

Status parse_frequency(const tinyxml2::XMLElement& general, double& frequency_hz) {
  const auto text = child_text(general, "Frequency");
  if (parse_number(text, frequency_hz) && std::isfinite(frequency_hz) && frequency_hz > 0.0 && frequency_hz <= 1e5) {
    return {};
  }
  return make_error(Errc::kMalformed, "QTM's General parameters hold no usable Frequency ('%.*s')",
                    static_cast<int>(std::min<std::size_t>(text.size(), 40)), text.data());
}

RealTimeProcessing parse_processing(const tinyxml2::XMLElement& general) noexcept {
  const auto* actions = general.FirstChildElement("RealTime_Processing_Actions");
  if (actions == nullptr) return {};
  const auto tracking = child_text(*actions, "Tracking");
  return {tracking.empty() || tracking == "3D", child_text(*actions, "AIM") != "false",
          child_text(*actions, "Track6DOF") != "false"};
}

/// The name of `element`, number `index` (from 1) of QTM's list of `kind`.
Result<std::string> parse_name(const tinyxml2::XMLElement& element, const char* kind, std::size_t index,
                               std::size_t most) {
  const auto name = child_text(element, "Name");
  if (index > most) return make_error(Errc::kUnsupported, "QTM lists more than %zu %ss", most, kind);
  if (name.empty() || name.size() > kMaxNameLength) {
    return make_error(Errc::kMalformed, "%s %zu of QTM has a name of %zu characters (allowed: 1 to %zu)", kind, index,
                      name.size(), kMaxNameLength);
  }
  return std::string(name);
}

Error same_name(const char* kind, const std::string& name) noexcept {
  return make_error(Errc::kRefused, "QTM lists two %s called '%s'; rename one of them in QTM", kind, name.c_str());
}

/// The number that QTM announces in the element `name` must be `found`.
Status check_count(const tinyxml2::XMLElement& section, const char* name, const char* kind, std::size_t found) {
  std::size_t announced = 0;
  const auto text = child_text(section, name);
  if (parse_number(text, announced) && announced == found) return {};
  return make_error(Errc::kMalformed, "QTM announces '%.*s' %s and lists %zu",
                    static_cast<int>(std::min<std::size_t>(text.size(), 40)), text.data(), kind, found);
}

Status parse_labels(const tinyxml2::XMLElement& section, std::vector<std::string>& labels) {
  for (const auto* label = section.FirstChildElement("Label"); label != nullptr;
       label = label->NextSiblingElement("Label")) {
    auto name = parse_name(*label, "label", labels.size() + 1, kMaxDataMarkers);
    if (!name) return name.error();
    if (std::find(labels.begin(), labels.end(), *name) != labels.end()) return same_name("markers", *name);
    labels.push_back(std::move(*name));
  }
  return check_count(section, "Labels", "labels", labels.size());
}

/// QTM tells poses relative to the world (0) or to another body; the text of these elements says which.
bool is_relative(const tinyxml2::XMLElement& body, const char* name) noexcept {
  const auto text = child_text(body, name);
  return !text.empty() && text != "0";
}

Status parse_bodies(const tinyxml2::XMLElement& section, std::vector<BodyParameters>& bodies) {
  for (const auto* body = section.FirstChildElement("Body"); body != nullptr; body = body->NextSiblingElement("Body")) {
    auto name = parse_name(*body, "rigid body", bodies.size() + 1, kMaxDataBodies);
    if (!name) return name.error();
    const auto same = [&](const BodyParameters& other) { return other.name == *name; };
    if (std::any_of(bodies.begin(), bodies.end(), same)) return same_name("rigid bodies", *name);
    const bool relative = is_relative(*body, "Data_origin") || is_relative(*body, "Data_orientation");
    bodies.push_back({std::move(*name), child_text(*body, "Enabled") != "false", relative});
  }
  if (section.FirstChildElement("Bodies") == nullptr) return {};  // since 1.21 nothing is announced
  return check_count(section, "Bodies", "rigid bodies", bodies.size());
}

}  // namespace

Result<Parameters> parse_parameters(std::string_view xml) {
  if (xml.size() > kMaxParametersSize) {
    return make_error(Errc::kUnsupported, "QTM's parameters are larger than %zu bytes", kMaxParametersSize);
  }
  tinyxml2::XMLDocument document;  // refuses elements nested deeper than 100
  if (document.Parse(xml.data(), xml.size()) != tinyxml2::XML_SUCCESS || document.RootElement() == nullptr) {
    return make_error(Errc::kMalformed, "QTM's parameters are not well-formed XML (line %d)", document.ErrorLineNum());
  }
  const auto& root = *document.RootElement();
  Parameters parameters;
  if (const auto* general = root.FirstChildElement("General"); general != nullptr) {
    if (const auto status = parse_frequency(*general, parameters.frequency_hz); !status) return status.error();
    parameters.processing = parse_processing(*general);
  }
  const auto* section = root.FirstChildElement("The_3D");
  if (section == nullptr) {
    return make_error(Errc::kMalformed, "QTM's parameters hold no 3D section; switch on real-time 3D tracking in QTM");
  }
  parameters.axis_upwards = child_text(*section, "AxisUpwards");
  parameters.calibration_time = child_text(*section, "CalibrationTime");
  if (const auto status = parse_labels(*section, parameters.labels); !status) return status.error();
  if (const auto* bodies = root.FirstChildElement("The_6D"); bodies != nullptr) {
    if (const auto status = parse_bodies(*bodies, parameters.bodies); !status) return status.error();
  }
  return parameters;
}

}  // namespace embody::qualisys
