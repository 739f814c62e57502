#include "daemon/evaluate/calibration_report.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/math/so3_jacobian.hpp"
#include "daemon/app/config_io.hpp"
#include "daemon/evaluate/print.hpp"
#include "daemon/evaluate/record_summary.hpp"

namespace embody::evaluate {
namespace {

using nlohmann::ordered_json;

constexpr double kWorse_mm = 0.5;
constexpr double kDegrees = 180.0 / 3.14159265358979323846;

constexpr std::array<const char*, 10> kShapeNames{"scale",        "palm breadth",  "palm length", "thumb length",
                                                  "index length", "middle length", "ring length", "little length",
                                                  "girth",        "last phalanges"};

const char* assumed(bool prior_only) {
  return prior_only ? "   only assumed: the motion does not tell" : "";
}

void print_shape(std::string& text, const hand::Calibration& c, bool builtin) {
  print(text, "%-22s %10s %10s\n", "shape", "value", "+-");
  for (Eigen::Index i = 0; i < 10; ++i) {
    const auto k = static_cast<std::size_t>(i);
    if (builtin) {
      print(text, "  %-20s %+8.1f %% %8.1f %%%s\n", kShapeNames[k], 100.0 * c.shape(i), 100.0 * c.shape_sd(i),
            assumed(c.shape_prior_only[k]));
    } else {
      print(text, "  parameter %-10zu %+10.2f %10.2f%s\n", k + 1, c.shape(i), c.shape_sd(i),
            assumed(c.shape_prior_only[k]));
    }
  }
}

void print_markers(std::string& text, const hand::Calibration& c, const hand::GloveLayout& layout) {
  print(text, "%-22s %5s %24s %21s %10s\n", "marker", "joint", "from the joint mm", "+- mm", "residual");
  for (const hand::CalibratedMarker& m : c.markers) {
    const Eigen::Vector3d p = 1e3 * m.offset_m;
    const Eigen::Vector3d sd = 1e3 * m.sd_m;
    const std::string name(layout.names[m.slot].view());
    print(text, "  %-20.20s %5zu %8.1f %7.1f %7.1f %7.1f %6.1f %6.1f %7.2f mm%s\n", name.c_str(),
          m.joint - hand::first_joint(m.finger) + 1, p.x(), p.y(), p.z(), sd.x(), sd.y(), sd.z(), 1e3 * m.residual_m,
          assumed(m.prior_only));
  }
}

ordered_json list(const double* values, std::size_t count) {
  ordered_json array = ordered_json::array();
  for (std::size_t i = 0; i < count; ++i) array.push_back(values[i]);
  return array;
}

ordered_json per_finger(const std::array<std::optional<double>, kFingers>& values) {
  ordered_json object;
  for (std::size_t f = 0; f < kFingers; ++f) object[kFingerNames[f]] = json_number(values[f]);
  return object;
}

}  // namespace

config::EmbodyConfig nominal_config(const config::EmbodyConfig& config) {
  config::EmbodyConfig nominal = config;
  nominal.subject.shape.fill(0.0);
  nominal.subject.back_edges_m.fill(0.0);
  nominal.subject.markers.clear();
  return nominal;
}

Vector6 log_se3(const Pose& X) noexcept {
  Vector6 S;
  S.head<3>() = math::log_so3(X.linear());
  S.tail<3>() = math::left_jacobian_so3(S.head<3>()).inverse() * X.translation();
  return S;
}

config::SubjectConfig calibrated_subject(const hand::Calibration& calibration, const hand::GloveLayout& layout,
                                         const config::SubjectConfig& base) {
  config::SubjectConfig subject = base;
  const Vector6 S = log_se3(calibration.X_HM);
  std::copy(calibration.shape.data(), calibration.shape.data() + calibration.shape.size(), subject.shape.begin());
  std::copy(S.data(), S.data() + S.size(), subject.X_HM_exponential.begin());
  subject.back_edges_m = calibration.back_edges_m;
  subject.markers.clear();
  for (const hand::CalibratedMarker& marker : calibration.markers) {
    config::MarkerPlaceConfig& place = subject.markers.emplace_back();
    place.marker = layout.names[marker.slot].view();
    place.joint = static_cast<int>(marker.joint - hand::first_joint(marker.finger)) + 1;
    std::copy(marker.offset_m.data(), marker.offset_m.data() + 3, place.offset_m.begin());
  }
  return subject;
}

Result<ResidualChange> residual_change(const config::EmbodyConfig& config, const config::SubjectConfig& subject,
                                       const std::vector<MarkerFrame>& frames) {
  EvaluationOptions options;
  options.reference = false;
  options.timing = false;
  config::EmbodyConfig calibrated = config;
  calibrated.subject = subject;
  ResidualChange change;
  for (const auto& [which, figures] :
       {std::pair{&config, &change.before_mm}, std::pair{&std::as_const(calibrated), &change.after_mm}}) {
    const Result<OperatorModels> models = make_operator_models(*which);
    if (!models) return models.error();
    const Result<RecordSamples> samples = evaluate_record(*models, frames, options);
    if (!samples) return samples.error();
    *figures = summarise(*samples).residual_mm;
  }
  return change;
}

std::string calibration_text(const hand::Calibration& c, const OperatorModels& nominal,
                             const ResidualChange& residuals) {
  std::string text;
  print(text, "calibrated from the %zu most different frames; +- is one standard deviation\n", c.frames_used);
  print_shape(text, c, nominal.data.skeleton.has_value());
  const hand::HandModel hand(nominal.data, c.shape, nominal.points);
  print(text, "  hand length %.1f mm, from the wrist to the tip of the middle finger\n",
        1e3 * (hand.rest_tips()[static_cast<std::size_t>(Finger::kMiddle)] - hand.rest_joints()[0]).norm());
  print_markers(text, c, nominal.layout);
  const Eigen::Vector3d p = 1e3 * c.X_HM.translation();
  const Eigen::Vector3d w = kDegrees * math::log_so3(c.X_HM.linear());
  print(text, "%-22s %8.1f %7.1f %7.1f mm,  +- %.1f %.1f %.1f mm\n", "hand under the glove", p.x(), p.y(), p.z(),
        1e3 * c.X_HM_sd(3), 1e3 * c.X_HM_sd(4), 1e3 * c.X_HM_sd(5));
  print(text, "%-22s %8.1f %7.1f %7.1f deg, +- %.1f %.1f %.1f deg\n", "", w.x(), w.y(), w.z(), kDegrees * c.X_HM_sd(0),
        kDegrees * c.X_HM_sd(1), kDegrees * c.X_HM_sd(2));
  print(text, "%-22s %8.1f %7.1f %7.1f mm (top-left, top-right, left-right)\n", "back markers apart",
        1e3 * c.back_edges_m[0], 1e3 * c.back_edges_m[1], 1e3 * c.back_edges_m[2]);
  print(text, "%-22s", "residual mm");
  for (const char* name : kFingerNames) print(text, " %8s", name);
  print(text, "\n%-22s", "  before");
  for (const auto& value : residuals.before_mm) print(text, " %8s", number(value, "%.2f").c_str());
  print(text, "\n%-22s", "  after");
  for (const auto& value : residuals.after_mm) print(text, " %8s", number(value, "%.2f").c_str());
  text += "\n";
  for (std::size_t f = 0; f < kFingers; ++f) {
    if (residuals.after_mm[f].value_or(0.0) <= residuals.before_mm[f].value_or(1e9) + kWorse_mm) continue;
    print(text, "warning: the %s finger fits worse than before: move more and calibrate again\n", kFingerNames[f]);
  }
  for (const std::string& line : c.advice) text += "advice: " + line + "\n";
  return text;
}

std::string calibration_json(const hand::Calibration& c, const OperatorModels& nominal,
                             const config::SubjectConfig& subject, const ResidualChange& residuals) {
  ordered_json object{{"frames_used", c.frames_used}};
  object["shape"] = list(c.shape.data(), 10);
  object["shape_sd"] = list(c.shape_sd.data(), 10);
  object["shape_prior_only"] = c.shape_prior_only;
  object["X_HM_exponential"] = subject.X_HM_exponential;
  object["X_HM_sd"] = list(c.X_HM_sd.data(), 6);
  object["back_edges_m"] = c.back_edges_m;
  object["markers"] = ordered_json::array();
  for (const hand::CalibratedMarker& m : c.markers) {
    object["markers"].push_back({{"marker", std::string(nominal.layout.names[m.slot].view())},
                                 {"finger", kFingerNames[static_cast<std::size_t>(m.finger)]},
                                 {"joint", m.joint - hand::first_joint(m.finger) + 1},
                                 {"offset_m", list(m.offset_m.data(), 3)},
                                 {"sd_m", list(m.sd_m.data(), 3)},
                                 {"residual_m", m.residual_m},
                                 {"prior_only", m.prior_only}});
  }
  for (std::size_t f = 0; f < kFingers; ++f) object["motion_rad"][kFingerNames[f]] = c.motion_rad[f];
  object["residual_before_mm"] = per_finger(residuals.before_mm);
  object["residual_after_mm"] = per_finger(residuals.after_mm);
  object["advice"] = c.advice;
  return object.dump(2, ' ', false, ordered_json::error_handler_t::replace);
}

std::string subject_file(const config::SubjectConfig& subject, const hand::Calibration& calibration,
                         const ResidualChange& residuals, const std::string& source, const std::string& date) {
  std::string text = "# Subject, calibrated by embodyctl calibrate on " + date + "\n# from " + source + "\n";
  print(text, "# (%zu frames used). Mean residual in mm:", calibration.frames_used);
  for (std::size_t f = 0; f < kFingers; ++f) {
    print(text, "%s %s %s", f == 0 ? "" : ",", kFingerNames[f], number(residuals.after_mm[f], "%.2f").c_str());
  }
  return text + ".\n" + config::print_toml(subject);
}

}  // namespace embody::evaluate
