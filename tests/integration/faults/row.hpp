#pragma once
// One row of the fault matrix: what is done, and what has to come of it.
#include <string>
#include <vector>

#include "core/base/time.hpp"
#include "tests/integration/faults/devices.hpp"

namespace embody::faults {

enum class Arm {
  kStops,         ///< it comes to rest within the bound, and rests until the operator engages
  kGoesOn,        ///< it follows as if nothing was
  kGoesOnOrStops  ///< it depends on some milliseconds: a short gap is bridged, or ends in a hold
};

/// What brings the arm to rest: what its time to rest is measured against.
enum class Brake {
  kDaemon,  ///< set-points within the acceleration limits, or the program on the robot, which keeps the same limits
  kRobot    ///< the controller by itself: 300 ms from the start of the stop to standstill in the simulator
};

struct Row {
  std::string name;                 ///< unique, one word
  std::string fault;                ///< for the reader
  std::vector<std::string> before;  ///< Cell::act(), in order, 0.7 s before the fault
  std::vector<std::string> inject;  ///< Cell::act(), in order: the fault
  Arm arm{Arm::kStops};
  std::vector<std::string> modes;  ///< one of these at the end of the watch
  std::string cause;               ///< the cause then shown; empty: any
  std::vector<std::string> clear;  ///< Cell::act(), in order, after the watch
  Duration watch{std::chrono::milliseconds(800)};
  Duration notice{std::chrono::milliseconds(50)};  ///< until it is found at the latest
  /// Where the daemon shows that it has noticed, when that is not its mode: a JSON pointer into the status, or
  /// "marker LABEL" for a verdict other than `used`, or "back" for a state other than `good`.
  std::string evidence;
  Brake brake{Brake::kDaemon};
  bool quick{false};            ///< part of the short run
  bool restarts_daemon{false};  ///< the only way back
  bool hand_rests{false};       ///< while the arm goes on
  std::string note;             ///< for the reader
};

/// The rows of one cell, which share one daemon.
struct Group {
  std::string title;
  std::string devices;  ///< for the reader
  TrackerKind tracker{TrackerKind::kTcp};
  HandKind hand{HandKind::kMia};
  std::vector<Row> rows;
};

[[nodiscard]] std::vector<Row> tracker_rows();
[[nodiscard]] std::vector<Row> datagram_rows();
[[nodiscard]] std::vector<Row> rigid_body_rows();
[[nodiscard]] std::vector<Row> landmark_rows();
[[nodiscard]] std::vector<Row> arm_rows();
[[nodiscard]] std::vector<Row> mia_rows();
[[nodiscard]] std::vector<Row> streaming_mia_rows();
[[nodiscard]] std::vector<Row> can_mia_rows();
[[nodiscard]] std::vector<Row> robotiq_rows();
[[nodiscard]] std::vector<Row> process_rows();

/// All of it, in the order of the page. Groups with the same devices run in the same cell.
[[nodiscard]] std::vector<Group> all_groups();

}  // namespace embody::faults
