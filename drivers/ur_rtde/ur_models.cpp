#include "drivers/ur_rtde/ur_models.hpp"

#include <algorithm>
#include <numbers>

namespace embody::ur {
namespace {

constexpr double kQuarter = std::numbers::pi / 2.0;

/// Arms of one generation differ by more; calibrations by much less.
constexpr double kSameModel_m = 0.03;

bool same_letters(std::string_view a, std::string_view b) noexcept {
  const auto lower = [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; };
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [&](char x, char y) { return lower(x) == lower(y); });
}

}  // namespace

Result<const UrModel*> find_model(std::string_view name) noexcept {
  for (const UrModel& model : robot::kUrModels) {
    if (same_letters(model.name, name)) return &model;
  }
  return make_error(Errc::kNotFound, "there is no arm model '%.*s': choose ur3e, ur5e, ur10e, ur16e, ur3, ur5 or ur10",
                    static_cast<int>(std::min<std::size_t>(name.size(), 40)), name.data());
}

UrKinematics nominal_kinematics(const UrModel& model) noexcept {
  UrKinematics kinematics;
  kinematics.a_m = {0.0, model.geometry.a2_m, model.geometry.a3_m, 0.0, 0.0, 0.0};
  kinematics.d_m = {model.geometry.d1_m, 0.0, 0.0, model.geometry.d4_m, model.geometry.d5_m, model.geometry.d6_m};
  kinematics.alpha_rad = {kQuarter, 0.0, 0.0, kQuarter, -kQuarter, 0.0};
  return kinematics;
}

math::Pose flange_pose(const UrKinematics& kinematics, const math::Vector6& q_rad) noexcept {
  math::Pose X_BE = math::Pose::Identity();
  for (std::size_t i = 0; i < 6; ++i) {
    const double angle_rad = q_rad[static_cast<Eigen::Index>(i)] + kinematics.theta_rad[i];
    X_BE.rotate(Eigen::AngleAxisd(angle_rad, Eigen::Vector3d::UnitZ()));
    X_BE.translate(Eigen::Vector3d(kinematics.a_m[i], 0.0, kinematics.d_m[i]));
    X_BE.rotate(Eigen::AngleAxisd(kinematics.alpha_rad[i], Eigen::Vector3d::UnitX()));
  }
  return X_BE;
}

double flange_distance_m(const UrKinematics& a, const UrKinematics& b) noexcept {
  // Stretched, upright, folded and bent: every length shows in one of them.
  const std::array<math::Vector6, 4> postures{math::Vector6::Zero(), math::Vector6{0.0, -1.57, 0.0, -1.57, 0.0, 0.0},
                                              math::Vector6{0.5, -1.2, 2.4, -1.2, 1.5, 0.0},
                                              math::Vector6{-1.0, -2.0, -1.5, 0.7, -1.2, 0.4}};
  double largest_m = 0.0;
  for (const math::Vector6& q_rad : postures) {
    const Eigen::Vector3d offset = flange_pose(a, q_rad).translation() - flange_pose(b, q_rad).translation();
    largest_m = std::max(largest_m, offset.norm());
  }
  return largest_m;
}

const UrModel* identify_model(const UrKinematics& reported, int major) noexcept {
  const UrModel* nearest = nullptr;
  double least_m = kSameModel_m;
  for (const UrModel& model : robot::kUrModels) {
    if ((model.software_major == 3) != (major <= 3)) continue;
    const double distance_m = flange_distance_m(nominal_kinematics(model), reported);
    if (distance_m < least_m) {
      least_m = distance_m;
      nearest = &model;
    }
  }
  return nearest;
}

Status check_model(const UrModel& configured, const UrKinematics& reported, int major) noexcept {
  const UrModel* found = identify_model(reported, major);
  if (found == &configured) return {};
  const double distance_mm = 1e3 * flange_distance_m(nominal_kinematics(configured), reported);
  const std::string_view name = configured.name;
  const std::string_view other = found == nullptr ? std::string_view("no known model") : found->name;
  return make_error(
      Errc::kRefused,
      "the configuration says %.*s, but the controller reports the geometry of %.*s (flange up to %.0f mm "
      "away): correct the arm model in the configuration",
      static_cast<int>(name.size()), name.data(), static_cast<int>(other.size()), other.data(), distance_mm);
}

}  // namespace embody::ur
