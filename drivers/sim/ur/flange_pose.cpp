#include "drivers/sim/ur/flange_pose.hpp"

#include "drivers/ur_rtde/ur_models.hpp"

namespace embody::sim {

math::Pose ur10e_flange_pose(const math::Vector6& q_rad) noexcept {
  static const ur::UrKinematics kNominal = ur::nominal_kinematics(**ur::find_model("UR10e"));
  return ur::flange_pose(kNominal, q_rad);
}

}  // namespace embody::sim
