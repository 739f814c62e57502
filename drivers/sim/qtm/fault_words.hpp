#pragma once
// The faults of the simulated QTM as text, and scripts of them: pure functions of text.
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.hpp"

namespace embody::sim {

enum class FaultKind : std::uint8_t {
  // Markers, by the name they have in the motion.
  kHide,
  kShow,
  kDrop,
  kGap,
  kTriadLoss,
  kStep,
  kGhost,
  kUnlabel,
  kNan,
  kScale,
  kResidual,
  // The list of labels.
  kSwap,
  kReorder,
  kAddLabel,
  kRemoveLabel,
  kRenameLabel,
  // Time.
  kTimestampReset,
  kFrozenFrameNumber,
  kSkip,
  kRate,
  kStall,
  kPause,
  // Connections.
  kDisconnect,
  kKill,
  kRestart,
  kHalfOpen,
  kEventStorm,
  kEvent,
  kCameraLink,
  // Parameters.
  kUncalibrated,
  kAxis,
  // Datagrams.
  kSplitUdp,
  kReorderUdp,
  kDuplicateUdp,
};

struct Fault {
  FaultKind kind{FaultKind::kReorder};
  std::string a;  ///< marker or label; the axis
  std::string b;  ///< the other label
  double value{0.0};
  double second_value{0.0};
  bool on{true};
};

/// One fault, e.g. `drop thumb_tip 5`; names with blanks stand in double quotes. fault_help() lists all.
/// Error kInvalidArgument: unknown fault, a missing, surplus or impossible argument.
[[nodiscard]] Result<Fault> parse_qtm_fault(std::string_view words);

/// One line per fault: its words, then what it does.
[[nodiscard]] std::string fault_help();

/// A fault and the frame from which on it acts, counted from 0 at the start of the measurement.
struct ScheduledFault {
  std::size_t frame{0};
  Fault fault;
  std::size_t line{0};  ///< of the script, for messages
};

/// A script: lines `<frame> <fault>` or `<seconds>s <fault>`, e.g. `1.5s stall 200`; empty lines and lines that
/// start with `#`. Sorted by time, in the order of the lines where that is equal. At most 10,000 lines and 1 MiB.
/// Error kInvalidArgument names the line.
[[nodiscard]] Result<std::vector<ScheduledFault>> parse_fault_script(std::string_view text, double rate_hz);

}  // namespace embody::sim
