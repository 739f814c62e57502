#pragma once
// The robot hand of the simulated lab, whichever the configuration names.
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.hpp"
#include "core/base/time.hpp"
#include "daemon/app/config.hpp"
#include "daemon/simlab/follow_report.hpp"
#include "drivers/mia/mia_config.hpp"

namespace embody::sim {

/// What the lab adds to the configuration of the hand.
struct HandOptions {
  std::string link;                               ///< path of a symlink to the hand's pseudo-terminal; empty: none
  std::optional<mia::Generation> mia_generation;  ///< firmware of a Mia; empty: what the configuration expects
  double log_length_s{120.0};                     ///< the newest so many seconds are kept
};

/// One counter of a simulated hand.
struct HandCounter {
  const char* name;
  std::uint64_t value;
};

/// A hand that exists only in this process. start() and fault() belong to one thread, the rest to any.
class SimulatedHand {
 public:
  SimulatedHand() = default;
  SimulatedHand(const SimulatedHand&) = delete;
  SimulatedHand& operator=(const SimulatedHand&) = delete;
  virtual ~SimulatedHand() = default;

  /// First word of its faults: "mia", "robotiq", "hand".
  [[nodiscard]] virtual const char* name() const noexcept = 0;
  /// Errors: those of the device (a symlink in the way, no such CAN interface, ...).
  virtual Status start() = 0;
  /// What a driver opens: a pseudo-terminal, a CAN interface, a topic.
  [[nodiscard]] virtual std::string device() const = 0;
  /// A driver has connected and talks.
  [[nodiscard]] virtual bool in_use() const = 0;
  /// Where it is now, in the order of the hand file's motors (rad).
  [[nodiscard]] virtual std::vector<double> joint_angles_rad() const = 0;
  /// Where it was, 100 times a second, oldest first.
  [[nodiscard]] virtual std::vector<HandSample> log() const = 0;
  [[nodiscard]] virtual std::vector<HandCounter> counters() const = 0;
  /// Errors: of the simulator, in its own words.
  virtual Status fault(std::string_view words) = 0;
  /// Would fault() understand it? Nothing happens.
  [[nodiscard]] virtual Status check_fault(std::string_view words) const = 0;
  /// One line per fault: its words, at least two blanks, what it does.
  [[nodiscard]] virtual std::string fault_help() const = 0;
};

/// The hand that `config` drives. Nothing is opened yet. @pre check_devices()
[[nodiscard]] std::unique_ptr<SimulatedHand> make_simulated_hand(const config::EmbodyConfig& config,
                                                                 const HandOptions& options);

}  // namespace embody::sim
