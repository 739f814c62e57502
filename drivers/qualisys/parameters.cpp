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

Status parse_labels(const tinyxml2::XMLElement& section, std::vector<std::string>& labels) {
  for (const auto* label = section.FirstChildElement("Label"); label != nullptr;
       label = label->NextSiblingElement("Label")) {
    const auto name = child_text(*label, "Name");
    if (labels.size() == kMaxDataMarkers) {
      return make_error(Errc::kUnsupported, "QTM lists more than %zu labelled markers", kMaxDataMarkers);
    }
    if (name.empty() || name.size() > kMaxNameLength) {
      return make_error(Errc::kMalformed, "label %zu of QTM has a name of %zu characters (allowed: 1 to %zu)",
                        labels.size() + 1, name.size(), kMaxNameLength);
    }
    if (std::find(labels.begin(), labels.end(), name) != labels.end()) {
      return make_error(Errc::kRefused, "QTM lists two markers called '%.*s'; rename one of them in QTM",
                        static_cast<int>(name.size()), name.data());
    }
    labels.emplace_back(name);
  }
  std::size_t announced = 0;
  if (parse_number(child_text(section, "Labels"), announced) && announced == labels.size()) return {};
  const auto text = child_text(section, "Labels");
  return make_error(Errc::kMalformed, "QTM announces '%.*s' labels and lists %zu",
                    static_cast<int>(std::min<std::size_t>(text.size(), 40)), text.data(), labels.size());
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
  }
  const auto* section = root.FirstChildElement("The_3D");
  if (section == nullptr) {
    return make_error(Errc::kMalformed, "QTM's parameters hold no 3D section; switch on real-time 3D tracking in QTM");
  }
  parameters.axis_upwards = child_text(*section, "AxisUpwards");
  parameters.calibration_time = child_text(*section, "CalibrationTime");
  if (const auto status = parse_labels(*section, parameters.labels); !status) return status.error();
  return parameters;
}

}  // namespace embody::qualisys
