#pragma once
// What the driver needs of QTM's XML parameters (sections General, 3D and 6D).
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.hpp"

namespace embody::qualisys {

/// Largest parameter text accepted; 256 labels and 30 cameras need some 100 kB.
inline constexpr std::size_t kMaxParametersSize = std::size_t{1} << 20;
inline constexpr std::size_t kMaxNameLength = 128;

/// A rigid body that QTM knows.
struct BodyParameters {
  std::string name;  ///< trimmed
  bool enabled{true};
  bool relative{false};  ///< its pose is told in something else than the world

  friend bool operator==(const BodyParameters&, const BodyParameters&) = default;
};

/// What QTM does with each frame while it measures. All true where it does not tell (before 1.14).
struct RealTimeProcessing {
  bool tracks_3d{true};
  bool identifies{true};  ///< AIM: without it markers have no labels
  bool tracks_6d{true};

  friend bool operator==(const RealTimeProcessing&, const RealTimeProcessing&) = default;
};

struct Parameters {
  double frequency_hz{0.0};  ///< capture rate; 0 when the General section is absent
  RealTimeProcessing processing;
  std::string axis_upwards;
  std::string calibration_time;        ///< empty: not calibrated
  std::vector<std::string> labels;     ///< trimmed, distinct, in the order of the data
  std::vector<BodyParameters> bodies;  ///< distinct, in the order of the data; empty when the 6D section is absent

  friend bool operator==(const Parameters&, const Parameters&) = default;
};

/// Parses the answer to `GetParameters General 3D 6D` (or fewer sections, 3D among them), with bodies as before and
/// since version 1.21. The name of the root element is QTM's version and is ignored. Errors: kMalformed (not XML, no 3D
/// section, counts, empty or overlong name, frequency), kUnsupported (too large, too many labels or bodies), kRefused
/// (two labels or two bodies of the same name).
[[nodiscard]] Result<Parameters> parse_parameters(std::string_view xml);

}  // namespace embody::qualisys
