#pragma once
// What a calibration means: as a subject file, and as a report for the person who was calibrated.
#include <optional>
#include <string>

#include "core/hand/calibration.hpp"
#include "daemon/app/operator_models.hpp"

namespace embody::evaluate {

/// Mean distance of a finger's markers to the model, before (with the subject in force) and after.
struct ResidualChange {
  std::array<std::optional<double>, kFingers> before_mm;
  std::array<std::optional<double>, kFingers> after_mm;
};

/// What a calibration starts from: the configured glove on a hand of zero shape, without calibrated places.
[[nodiscard]] config::EmbodyConfig nominal_config(const config::EmbodyConfig& config);

/// The subject that `calibration` describes: `base` (side, skeleton or model) with its numbers.
[[nodiscard]] config::SubjectConfig calibrated_subject(const hand::Calibration& calibration,
                                                       const hand::GloveLayout& layout,
                                                       const config::SubjectConfig& base);

/// Evaluates `frames` with the subject in force and with `subject`. Errors of make_operator_models().
[[nodiscard]] Result<ResidualChange> residual_change(const config::EmbodyConfig& config,
                                                     const config::SubjectConfig& subject,
                                                     const std::vector<MarkerFrame>& frames);

/// Tables and advice for people: %, mm, degrees, each with its standard deviation.
[[nodiscard]] std::string calibration_text(const hand::Calibration& calibration, const OperatorModels& nominal,
                                           const ResidualChange& residuals);

/// One JSON object with the same figures in SI units (residuals in mm).
[[nodiscard]] std::string calibration_json(const hand::Calibration& calibration, const OperatorModels& nominal,
                                           const config::SubjectConfig& subject, const ResidualChange& residuals);

/// The subject file: comment lines about where it comes from, then print_toml(). `source` and `date` are for people.
[[nodiscard]] std::string subject_file(const config::SubjectConfig& subject, const hand::Calibration& calibration,
                                       const ResidualChange& residuals, const std::string& source,
                                       const std::string& date);

/// Exponential coordinates of a pose, rotation first: math::exp_se3() of them is the pose.
[[nodiscard]] Vector6 log_se3(const Pose& X) noexcept;

}  // namespace embody::evaluate
