#pragma once
// A cell of the fault matrix: simulated tracker, arm and hand in this process, the real embodyd as a child.
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "daemon/control/control_client.hpp"
#include "daemon/ctl/child_process.hpp"
#include "daemon/simlab/simulated_hand.hpp"
#include "drivers/sim/ur/ur_controller.hpp"
#include "drivers/ur_rtde/dashboard.hpp"
#include "tests/integration/faults/devices.hpp"

namespace embody::faults {

using nlohmann::json;

/// Limits of the configuration that the bounds of the matrix are made of. Those not named are the product's defaults.
struct CellLimits {
  Vector6 acceleration_rad_s2;
  Vector6 speed_rad_s;
  Duration hold_after;
  Duration stale_after;
  double watchdog_hz;
};

class Cell {
 public:
  /// Starts the devices, then the daemon `programs`/embodyd. Errors: one sentence.
  static Result<std::unique_ptr<Cell>> start(TrackerKind tracker, HandKind hand, const std::string& programs);
  Cell(const Cell&) = delete;
  Cell& operator=(const Cell&) = delete;
  ~Cell();

  /// Does one thing: "tracker FAULT", "arm FAULT", "hand FAULT", "operator ACTION" (what a person does at the robot:
  /// unlock, stop-program, bring-up, restart-safety, calibrate, activate), "daemon stop|continue|kill|term|start",
  /// "client leaves", "request COMMAND". Errors: of whom it concerns.
  Status act(const std::string& words);

  /// The daemon's status, or nothing when it does not answer within 100 ms (or is known not to run).
  std::optional<json> status();
  std::optional<json> markers();
  /// True when the daemon obeys.
  bool ask(control::Command command);
  [[nodiscard]] bool daemon_runs() { return daemon_ && !daemon_->exit_code() && !suspended_; }
  [[nodiscard]] int daemons_started() const noexcept { return daemons_started_; }

  sim::UrController& arm() { return *arm_; }
  [[nodiscard]] sim::SimulatedHand& hand() { return *hand_; }
  /// Motion commands that the hand has obeyed so far.
  [[nodiscard]] std::uint64_t hand_motions() const;
  [[nodiscard]] const CellLimits& limits() const noexcept { return limits_; }
  /// What the daemon has logged since the last call.
  [[nodiscard]] std::string new_log();

 private:
  explicit Cell(std::string folder, std::string programs)
      : folder_(std::move(folder)), programs_(std::move(programs)) {}
  Status start_devices(TrackerKind tracker, HandKind hand);
  Status start_daemon();
  Status connect();
  Status act_on_daemon(const std::string& action);
  Status act_as_operator(const std::string& action);
  std::optional<json> look(control::Command command);

  std::string folder_, programs_, config_;
  CellLimits limits_;
  std::unique_ptr<SimulatedTracker> tracker_;
  std::unique_ptr<sim::UrController> arm_;
  std::unique_ptr<sim::SimulatedHand> hand_;
  std::optional<ctl::ChildProcess> daemon_;
  std::optional<control::ControlClient> client_;
  bool suspended_{false};
  int daemons_started_{0};
  std::size_t log_read_{0};
};

}  // namespace embody::faults
