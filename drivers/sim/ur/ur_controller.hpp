#pragma once
// A simulated UR10e controller that speaks RTDE on a TCP port: one thread, one clock, real bytes.
#include <atomic>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "core/base/result.hpp"
#include "drivers/sim/ur/rtde_counters.hpp"
#include "drivers/sim/ur/ur_robot.hpp"

namespace embody::sim {

struct UrControllerConfig {
  std::string address{"127.0.0.1"};
  std::uint16_t port{0};             ///< 0 takes a free one
  double frequency_hz{500.0};        ///< control cycles per second, 1 to 1000
  UrRobotConfig robot;               ///< q_start_rad, limits, lag
  std::size_t log_capacity{30'000};  ///< newest samples kept, one per control cycle
  std::size_t max_clients{8};
};

/// The robot after one control cycle.
struct UrSample {
  TimePoint t{};                                    ///< planned time of the cycle
  std::uint64_t cycle{0};                           ///< timestamp = cycle / frequency_hz
  Vector6 q_rad{Vector6::Zero()};                   ///< actual
  Vector6 qd_rad_s{Vector6::Zero()};                ///< actual
  Vector6 q_target_rad{Vector6::Zero()};            ///< set-point of the control program
  ProgramState program_state{ProgramState::kBoot};  ///< a stopped program leaves its last one
};

struct UrCounters : RtdeCounters {
  std::uint64_t cycles{0};       ///< control cycles, the caught-up ones included
  std::uint64_t late_cycles{0};  ///< cycles that the host missed: stepped later, never sent
};

/// The functions after port() may be called from any thread; a fault takes effect in the next control cycle.
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
  [[nodiscard]] std::uint16_t port() const noexcept { return port_; }

  /// A client streams and has sent at least one input package.
  [[nodiscard]] bool has_client() const noexcept { return has_client_; }
  [[nodiscard]] UrCounters counters() const;
  /// The newest sample.
  [[nodiscard]] UrSample latest() const;
  /// Everything in the log, oldest first.
  [[nodiscard]] std::vector<UrSample> samples() const;

  void protective_stop() noexcept;
  void emergency_stop() noexcept;
  /// Ends a stop, powers the arm and restarts the program, which has to be armed again.
  void clear_stop() noexcept;
  void set_program_running(bool running) noexcept;
  /// Like a pulled cable: nothing is sent or read, the sockets stay open, the robot goes on by itself.
  void freeze(bool frozen) noexcept { frozen_ = frozen; }
  /// Closes all connections; the port stays open.
  void disconnect_clients() noexcept;

 private:
  class Loop;
  void run(const std::stop_token& stop);
  void log(TimePoint t, std::uint64_t cycle);

  UrControllerConfig config_;
  std::unique_ptr<Loop> loop_;
  std::uint16_t port_{0};
  std::atomic<bool> has_client_{false};
  std::atomic<bool> frozen_{false};
  std::atomic<unsigned> requests_{0};
  mutable std::mutex mutex_;  // of what follows; held for a few microseconds, longer only while the log is copied
  std::vector<UrSample> log_;
  std::size_t logged_{0};
  UrCounters counters_;
  std::jthread thread_;
};

}  // namespace embody::sim
