#include "drivers/ur_rtde/installation_check.hpp"

#include <cmath>

#include "core/math/pose.hpp"
#include "drivers/ur_rtde/ur_models.hpp"

namespace embody::ur {
namespace {

constexpr double kPayloadTolerance_kg = 0.1;
constexpr double kLengthTolerance_m = 0.005;
constexpr double kAngleTolerance_rad = 0.02;

double distance_m(const double* a, const double* b) noexcept {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

/// Angle between the orientations of two rotation vectors: the vectors themselves may differ by full turns.
double angle_rad(const double* a, const double* b) noexcept {
  const auto rotation = [](const double* w) { return math::exp_so3(Eigen::Vector3d(w[0], w[1], w[2])); };
  return math::angle_between(rotation(a), rotation(b));
}

}  // namespace

Status check_settings(const ExpectedInstallation& expected, const rtde::ArmSettings& reported) noexcept {
  const auto& payload_kg = expected.payload_kg;
  if (payload_kg && !(std::abs(*payload_kg - reported.payload_kg) <= kPayloadTolerance_kg)) {
    return make_error(Errc::kRefused,
                      "the robot's payload is set to %.2f kg, the configuration says %.2f kg: correct the installation",
                      reported.payload_kg, *payload_kg);
  }
  const auto& cog = expected.cog_m;
  if (cog && !(distance_m(cog->data(), reported.cog_m.data()) <= kLengthTolerance_m)) {
    return make_error(Errc::kRefused,
                      "the robot's centre of gravity is set to [%.3f %.3f %.3f] m, the configuration says "
                      "[%.3f %.3f %.3f] m: correct the installation",
                      reported.cog_m[0], reported.cog_m[1], reported.cog_m[2], (*cog)[0], (*cog)[1], (*cog)[2]);
  }
  const auto& tcp = expected.tcp;
  const bool tcp_fits = !tcp || (distance_m(tcp->data(), reported.tcp.data()) <= kLengthTolerance_m &&
                                 angle_rad(tcp->data() + 3, reported.tcp.data() + 3) <= kAngleTolerance_rad);
  if (!tcp_fits) {
    const auto& is = reported.tcp;
    return make_error(Errc::kRefused,
                      "the robot's tool centre point is [%.3f %.3f %.3f] m, [%.2f %.2f %.2f] rad, the configuration "
                      "says [%.3f %.3f %.3f] m, [%.2f %.2f %.2f] rad: correct the installation",
                      is[0], is[1], is[2], is[3], is[4], is[5], (*tcp)[0], (*tcp)[1], (*tcp)[2], (*tcp)[3], (*tcp)[4],
                      (*tcp)[5]);
  }
  return {};
}

Status check_geometry(const ExpectedInstallation& expected, const UrKinematics& reported,
                      std::uint32_t controller_major) noexcept {
  if (expected.model.empty()) return {};
  const auto model = find_model(expected.model);
  if (!model) return model.error();
  return check_model(**model, reported, static_cast<int>(controller_major));
}

}  // namespace embody::ur
