#pragma once
// The parameter texts of QTM: what GetParameters answers (Qualisys, "QTM RT Server Protocol Documentation", XML
// parameters; layouts of 1.21 and later after the official C++ SDK, which reads all of them).
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace embody::sim {

/// A point that defines a rigid body.
struct BodyPoint {
  std::string name;
  Eigen::Vector3d p_B{0.0, 0.0, 0.0};  ///< m, in the frame of the body
};

struct BodyParameters {
  std::string name;
  std::vector<BodyPoint> points;
};

/// What QTM knows about its measurement.
struct QtmSetup {
  double rate_hz{0.0};
  std::string axis;  ///< "+Z"
  bool calibrated{true};
  std::vector<std::string> labels;
  std::vector<BodyParameters> bodies;
  bool start_on_trigger{false};
};

/// The parameter text for the words `GetParameters <sections>`; nothing when a section does not exist in protocol
/// 1.`minor_version`. Sections without a device (analog, force, image, gaze, eye tracker, skeletons) are empty.
[[nodiscard]] std::optional<std::string> parameters_xml(const std::vector<std::string>& words, const QtmSetup& setup,
                                                        int minor_version);

/// The text that QTM sends when a calibration has ended.
[[nodiscard]] std::string calibration_result_xml(const QtmSetup& setup, int minor_version);

}  // namespace embody::sim
