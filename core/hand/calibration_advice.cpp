#include "core/hand/calibration_advice.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace embody::hand {
namespace {

constexpr double kDegrees = 57.29577951308232;
constexpr double kLittleFlexionRad = 0.7;
constexpr double kLittleSpreadRad = 0.2;
constexpr double kLittleThumbRad = 0.3;
constexpr double kSeldomSeen = 0.5;
constexpr double kFarOff = 3.5;  // prior standard deviations

/// From the 5th to the 95th percentile: what an outlier cannot make.
double range(std::vector<double>& values) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  const auto at = [&values](double share) {
    return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
  };
  return at(0.95) - at(0.05);
}

template <class... Values>
std::string sentence(const char* format, Values... values) {
  std::array<char, 240> text{};
  std::snprintf(text.data(), text.size(), format, values...);
  return text.data();
}

std::string name_of(std::size_t finger) {
  return finger == 0 ? "thumb" : std::string(kFingerNames[finger]) + " finger";
}

}  // namespace

void advise(const CalibrationProblem& problem, const CalibrationVariables& at, const GloveLayout& glove,
            const CalibrationPrior& prior, Calibration& calibration) {
  std::array<double, kFingers> sideways_rad{};
  std::array<bool, kFingers> worn{};  // a marker of the finger
  const auto frames = static_cast<double>(at.frames.size());
  for (const CalibrationMarker& marker : problem.markers()) worn[static_cast<std::size_t>(marker.finger)] = true;
  for (std::size_t f = 0; f < kFingers; ++f) {
    std::vector<double> flexion, abduction;
    for (std::size_t k = 0; k < at.frames.size(); ++k) {
      const auto seen = [&](const CalibrationMarker& m) {
        const auto i = static_cast<std::size_t>(&m - problem.markers().data());
        return static_cast<std::size_t>(m.finger) == f && problem.frames().frames[k].p_H[i].has_value();
      };
      if (std::none_of(problem.markers().begin(), problem.markers().end(), seen)) continue;
      flexion.push_back(problem.angle_prior(f).flexion_rad(at.frames[k].q_rad[f]));
      abduction.push_back(problem.angle_prior(f).abduction_rad(at.frames[k].q_rad[f]));
    }
    const double share = static_cast<double>(flexion.size()) / frames;
    calibration.motion_rad[f] = range(flexion);
    sideways_rad[f] = range(abduction);
    if (!worn[f]) continue;
    const std::string finger = name_of(f);
    if (share < kSeldomSeen) {
      calibration.advice.push_back(sentence("keep the %s in view: its markers were seen in %.0f %% of the frames only",
                                            finger.c_str(), 100.0 * share));
    } else if (calibration.motion_rad[f] < kLittleFlexionRad) {
      calibration.advice.push_back(sentence("move the %s more: its flexion ranged over %.0f degrees only",
                                            finger.c_str(), kDegrees * calibration.motion_rad[f]));
    }
  }
  const double spread_rad = *std::max_element(sideways_rad.begin() + 1, sideways_rad.end());
  if (std::any_of(worn.begin() + 1, worn.end(), [](bool w) { return w; }) && spread_rad < kLittleSpreadRad) {
    calibration.advice.push_back(
        sentence("spread the fingers and close them again: none moved sideways by more than %.0f degrees",
                 kDegrees * spread_rad));
  }
  if (worn[0] && sideways_rad[0] < kLittleThumbRad) {
    calibration.advice.push_back(sentence("draw circles with the thumb: it moved across the palm by %.0f degrees only",
                                          kDegrees * sideways_rad[0]));
  }
  for (std::size_t m = 0; m < calibration.markers.size(); ++m) {
    const CalibratedMarker& marker = calibration.markers[m];
    const std::string name = marker.slot < glove.names.size() ? std::string(glove.names[marker.slot].view())
                                                              : sentence("in slot %zu", marker.slot);
    const double off_m = (marker.offset_m - problem.markers()[m].nominal_m).norm();
    if (marker.prior_only) {
      calibration.advice.push_back(
          sentence("the place of marker %s is known from the nominal layout only", name.c_str()));
    } else if (off_m > kFarOff * prior.marker_sd_m) {
      calibration.advice.push_back(
          sentence("marker %s came out %.0f mm from its nominal place: check its label and the bone that the layout "
                   "puts it on",
                   name.c_str(), 1e3 * off_m));
    }
  }
  if ((calibration.shape.array().abs() > kFarOff * prior.shape_sd.array()).any()) {
    calibration.advice.push_back(
        "the shape of the hand came out unusual: calibrate again with wider motion, and check the labels");
  }
}

}  // namespace embody::hand
