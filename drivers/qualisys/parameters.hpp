#pragma once
// What the driver needs of QTM's XML parameters (sections General and 3D).
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.hpp"

namespace embody::qualisys {

/// Largest parameter text accepted; 256 labels and 30 cameras need some 100 kB.
inline constexpr std::size_t kMaxParametersSize = std::size_t{1} << 20;
inline constexpr std::size_t kMaxNameLength = 128;

struct Parameters {
  double frequency_hz{0.0};  ///< capture rate; 0 when the General section is absent
  std::string axis_upwards;
  std::string calibration_time;     ///< empty: not calibrated
  std::vector<std::string> labels;  ///< trimmed, distinct, in the order of the data

  friend bool operator==(const Parameters&, const Parameters&) = default;
};

/// Parses the answer to `GetParameters General 3D` (or `3D` alone). The name of the root element is QTM's version and
/// is ignored. Errors: kMalformed (not XML, no 3D section, label count, empty or overlong name, frequency),
/// kUnsupported (too large, too many labels), kRefused (two labels of the same name).
[[nodiscard]] Result<Parameters> parse_parameters(std::string_view xml);

}  // namespace embody::qualisys
