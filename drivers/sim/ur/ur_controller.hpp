#pragma once
// A simulated UR controller that speaks RTDE, the ports 30001 to 30003 and the dashboard over TCP: one thread, one
// clock, real bytes. A fresh one runs, with our control program playing.
#include <atomic>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "core/base/result.hpp"
#include "drivers/sim/ur/controller_config.hpp"
#include "drivers/sim/ur/controller_faults.hpp"
#include "drivers/sim/ur/rtde_counters.hpp"

namespace embody::sim {

/// The robot after one control cycle.
struct UrSample {
  TimePoint t{};                                    ///< planned time of the cycle
  std::uint64_t cycle{0};                           ///< timestamp = cycle / frequency_hz, since start or RTDE restart
  Vector6 q_rad{Vector6::Zero()};                   ///< actual
  Vector6 qd_rad_s{Vector6::Zero()};                ///< actual
  Vector6 q_target_rad{Vector6::Zero()};            ///< set-point of the control program
  ProgramState program_state{ProgramState::kBoot};  ///< a stopped program leaves its last one
};

struct UrCounters : RtdeCounters {
  std::uint64_t cycles{0};       ///< control cycles, the caught-up ones included
  std::uint64_t late_cycles{0};  ///< cycles that the host missed: stepped later, never sent
};

/// The functions after port() may be called from any thread; a fault takes effect before the next control cycle.
class UrController {
 public:
  explicit UrController(UrControllerConfig config);
  ~UrController();
  UrController(const UrController&) = delete;
  UrController& operator=(const UrController&) = delete;

  /// Listens and starts the control thread. Cycle k is due at start + k / frequency_hz; cycles that the host missed are
  /// stepped with the inputs at hand, but only the newest is sent. Errors: kInvalidArgument, kIo.
  Status start();
  /// Ends the thread and closes all connections. start() begins anew.
  void stop() noexcept;
  /// 0 before start().
  [[nodiscard]] std::uint16_t port() const noexcept { return ports_[0]; }
  [[nodiscard]] std::uint16_t primary_port() const noexcept { return ports_[1]; }
  [[nodiscard]] std::uint16_t secondary_port() const noexcept { return ports_[2]; }
  [[nodiscard]] std::uint16_t realtime_port() const noexcept { return ports_[3]; }
  [[nodiscard]] std::uint16_t dashboard_port() const noexcept { return ports_[4]; }

  /// A client streams and has sent at least one input package.
  [[nodiscard]] bool has_client() const noexcept { return has_client_; }
  [[nodiscard]] UrCounters counters() const;
  /// The newest sample.
  [[nodiscard]] UrSample latest() const;
  /// Everything in the log, oldest first.
  [[nodiscard]] std::vector<UrSample> samples() const;
  /// Modes after the newest cycle.
  [[nodiscard]] SafetyStatus safety() const;

  /// A fault by name (controller_faults.hpp), with or without "ur " in front. Errors: kInvalidArgument.
  Status fault(std::string_view text);

  void protective_stop() { post("protective-stop"); }
  void emergency_stop() { post("emergency-stop"); }
  /// Ends a stop, powers the arm and restarts the program, which has to be armed again.
  void clear_stop() { post("clear-stop"); }
  void set_program_running(bool running) { post(running ? "program on" : "program off"); }
  /// Like a pulled cable: nothing is sent or read, the sockets stay open, the robot goes on by itself.
  void freeze(bool frozen) { post(frozen ? "freeze on" : "freeze off"); }
  /// Closes all RTDE connections; the port stays open.
  void disconnect_clients() { post("disconnect"); }

 private:
  void post(std::string_view fault);
  void run(const std::stop_token& stop);
  void apply_faults();
  void log(TimePoint t, std::uint64_t cycle);

  UrControllerConfig config_;
  std::unique_ptr<ControllerLoop> loop_;
  std::array<std::uint16_t, 5> ports_{};
  std::atomic<bool> has_client_{false};
  mutable std::mutex mutex_;  // of what follows; held for a few microseconds, longer only while the log is copied
  std::vector<FaultAction> faults_;
  std::vector<UrSample> log_;
  std::size_t logged_{0};
  UrCounters counters_;
  SafetyStatus safety_;
  std::jthread thread_;
};

}  // namespace embody::sim
