#pragma once
// What was seen in a row, and what the logs of the devices say about it.
#include <optional>
#include <string>
#include <vector>

#include "drivers/sim/ur/ur_controller.hpp"
#include "tests/integration/faults/cell.hpp"

namespace embody::faults {

struct HandSample {
  TimePoint t{};
  std::vector<double> q_rad;
  std::uint64_t motions{0};
};

/// In place of a mode: there is no daemon, or it is suspended.
inline constexpr const char* kNoAnswer = "no answer";

/// What the daemon showed at one look.
struct Shown {
  TimePoint t{};  ///< of the answer
  std::string mode, cause;
  double since_s{0.0};
  std::string evidence;
};

struct Timeline {
  TimePoint t_fault{};
  TimePoint t_cleared{};
  std::optional<TimePoint> t_engaged;  ///< the operator's engage was accepted
  std::vector<HandSample> hand;
  std::vector<Shown> shown;
  std::vector<sim::UrSample> arm;  ///< from just before the fault to the end of the row
  Duration longest_gap{0};         ///< between two looks: how long this machine held us up
};

struct ArmOutcome {
  double speed_rad_s{0.0};          ///< largest of a joint when the fault came
  std::optional<Duration> to_rest;  ///< after the fault, every joint stays below 0.01 rad/s
  Duration bound{0};
  double travel_rad{0.0};         ///< largest of a joint, from the fault to the end of the watch
  double moved_at_rest_rad{0.0};  ///< largest of a joint, from rest to the operator's engage
  double worst_speed{0.0};        ///< largest joint speed over its limit, whole row; 1: at the limit
  double worst_step{0.0};         ///< the same of the way within one control cycle
};
/// `detected`: after the fault. `robot_brakes`: the controller stops by itself.
[[nodiscard]] ArmOutcome judge_arm(const Timeline& line, const CellLimits& limits, bool robot_brakes,
                                   Duration detected);

struct HandOutcome {
  double excursion_rad{0.0};  ///< largest of a joint from where it was when its last command came
  Duration to_rest{0};        ///< after the fault, every joint stays where it is
  bool commanded{false};      ///< it still obeyed motion commands 0.2 s after the fault
};
/// `t_end`: what the hand does from then on was asked for.
[[nodiscard]] HandOutcome judge_hand(const Timeline& line, TimePoint t_end);

/// When the daemon first showed something else than before the fault.
[[nodiscard]] std::optional<Duration> time_to_detect(const Timeline& line);

}  // namespace embody::faults
