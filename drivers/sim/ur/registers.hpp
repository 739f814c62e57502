#pragma once
// The registers between the arm driver and the robot's control program (docs/ur_rtde.md).
#include "core/hal/types.hpp"

namespace embody::sim {

struct RegisterInputs {
  std::int32_t sequence{0};                  ///< int 24
  std::int32_t mode{0};                      ///< int 25: 0 hold, 1 track, 9 exit; others hold without arming
  Vector6 q_target_rad{Vector6::Zero()};     ///< double 24-29
  Vector6 qd_target_rad_s{Vector6::Zero()};  ///< double 30-35, feed-forward
  std::uint64_t packages{0};                 ///< input packages so far; 0: nobody has ever sent one
};

enum class ProgramState : std::int32_t { kBoot = 0, kHold = 1, kTracking = 2, kStale = 3, kEnded = 9 };

/// Fault codes, kept until mode 0.
enum class ProgramFault : std::int32_t { kNone = 0, kStale = 1, kFarTarget = 2, kOutOfRange = 4, kMoved = 16 };

struct RegisterOutputs {
  std::int32_t sequence{0};                 ///< int 24: newest sequence seen
  ProgramState state{ProgramState::kBoot};  ///< int 25
  ProgramFault fault{ProgramFault::kNone};  ///< int 26
  std::int32_t version{0};                  ///< int 27
};

}  // namespace embody::sim
