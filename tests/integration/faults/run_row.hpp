#pragma once
// Makes one fault happen while arm and hand move, watches what comes of it, and lets an operator recover.
#include "tests/integration/faults/cell.hpp"
#include "tests/integration/faults/outcome.hpp"
#include "tests/integration/faults/row.hpp"

namespace embody::faults {

struct RowResult {
  std::optional<Duration> detected;
  ArmOutcome arm;
  HandOutcome hand;
  std::vector<std::string> modes;  ///< that the daemon went through
  std::string cause;               ///< at the end of the watch
  std::string recovery;            ///< what an operator did
  Duration recovered_in{0};        ///< after the fault was over
  Duration longest_gap{0};
  std::uint64_t late_cycles{0};       ///< of the simulated controller: the machine was busy with something else
  bool over_bound{false};             ///< the arm took longer, if only by some milliseconds
  std::vector<std::string> failures;  ///< what breaks a rule of the matrix
};

/// Leaves the cell engaged.
[[nodiscard]] RowResult run_row(Cell& cell, const Row& row);

}  // namespace embody::faults
