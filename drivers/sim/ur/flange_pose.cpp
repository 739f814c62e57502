#include "drivers/sim/ur/flange_pose.hpp"

#include <array>
#include <numbers>

namespace embody::sim {
namespace {

struct Link {
  double a_m, d_m, alpha_rad;
};

constexpr double kQuarter = std::numbers::pi / 2.0;
constexpr std::array<Link, 6> kLinks{{{0.0, 0.1807, kQuarter},
                                      {-0.6127, 0.0, 0.0},
                                      {-0.57155, 0.0, 0.0},
                                      {0.0, 0.17415, kQuarter},
                                      {0.0, 0.11985, -kQuarter},
                                      {0.0, 0.11655, 0.0}}};

}  // namespace

math::Pose ur10e_flange_pose(const math::Vector6& q_rad) noexcept {
  math::Pose X_BE = math::Pose::Identity();
  for (std::size_t i = 0; i < kLinks.size(); ++i) {
    const Link& link = kLinks[i];
    X_BE.rotate(Eigen::AngleAxisd(q_rad[static_cast<Eigen::Index>(i)], Eigen::Vector3d::UnitZ()));
    X_BE.translate(Eigen::Vector3d(link.a_m, 0.0, link.d_m));
    X_BE.rotate(Eigen::AngleAxisd(link.alpha_rad, Eigen::Vector3d::UnitX()));
  }
  return X_BE;
}

}  // namespace embody::sim
