// Which rows run in which cell.
#include "tests/integration/faults/row.hpp"

namespace embody::faults {

std::vector<Group> all_groups() {
  using T = TrackerKind;
  using H = HandKind;
  return {
      {"Tracker: marker glove over TCP", "Qualisys (TCP), UR10e, Mia", T::kTcp, H::kMia, tracker_rows()},
      {"Arm: UR10e", "Qualisys (TCP), UR10e, Mia", T::kTcp, H::kMia, arm_rows()},
      {"Hand: Mia, acknowledging firmware", "Qualisys (TCP), UR10e, Mia", T::kTcp, H::kMia, mia_rows()},
      {"Daemon and operator", "Qualisys (TCP), UR10e, Mia", T::kTcp, H::kMia, process_rows()},
      {"Tracker: marker glove over UDP", "Qualisys (UDP), UR10e, Mia (streaming)", T::kUdp, H::kStreamingMia,
       datagram_rows()},
      {"Hand: Mia, streaming firmware", "Qualisys (UDP), UR10e, Mia (streaming)", T::kUdp, H::kStreamingMia,
       streaming_mia_rows()},
      {"Tracker: rigid body", "Qualisys (6D), UR10e, Robotiq 2F-140", T::kRigidBody, H::kRobotiq, rigid_body_rows()},
      {"Hand: Robotiq 2F-140", "Qualisys (6D), UR10e, Robotiq 2F-140", T::kRigidBody, H::kRobotiq, robotiq_rows()},
      {"Tracker: hand landmarks", "landmarks (UDP), UR10e, Mia (CAN, compact)", T::kLandmarks, H::kCanMia,
       landmark_rows()},
      {"Hand: Mia on CAN, compact profile", "landmarks (UDP), UR10e, Mia (CAN, compact)", T::kLandmarks, H::kCanMia,
       can_mia_rows()},
  };
}

}  // namespace embody::faults
