#pragma once
// What a Mia hand does with the bytes it gets: no thread, no file, no clock. Time is an argument.
#include <deque>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "drivers/mia/codec.hpp"
#include "drivers/sim/mia/mia_simulator.hpp"
#include "drivers/sim/mia/motor.hpp"

namespace embody::sim {

/// Time never runs backwards: an earlier `now` counts as the latest one seen.
class MiaDevice {
 public:
  MiaDevice(const MiaSimulatorConfig& config, TimePoint now);

  /// Takes bytes of the host that arrived at `now`.
  void receive(std::span<const char> bytes, TimePoint now);
  /// Moves on to `now`; returns what the hand has to say until then.
  std::string advance(TimePoint now);
  /// Moves on to `now` and says nothing: what falls due meanwhile is said by the next advance().
  void move_to(TimePoint now);
  /// When advance() will next have something to say; nothing: not before the host speaks.
  [[nodiscard]] std::optional<TimePoint> next_event() const noexcept;
  /// The host has gone: half a frame and replies under way are forgotten; motion and streams go on.
  void forget_host() noexcept;

  [[nodiscard]] std::array<double, mia::kMotors> motor_counts() const noexcept;
  [[nodiscard]] std::array<double, mia::kMotors> joint_angles_rad() const noexcept;
  [[nodiscard]] std::vector<MiaSample> log() const;
  [[nodiscard]] MiaSimulatorCounters counters() const noexcept;

  void mute(bool on) noexcept { mute_ = on; }
  void drop_next(unsigned n) noexcept { drop_ = n; }
  void garble_next(unsigned n) noexcept { garble_ = n; }

 private:
  struct Pending {
    TimePoint due{};
    mia::Command command{};
  };

  void record(TimePoint t);
  void execute(const mia::Request& request);
  void switch_stream(char channel, bool on) noexcept;
  [[nodiscard]] std::optional<mia::DataLine> data_line(char channel) const noexcept;
  [[nodiscard]] std::array<double, mia::kMotors> joint_speeds_rad_s() const noexcept;
  void answer(const mia::Command& command, std::string& out);
  bool say(std::string_view line, std::string& out);

  MiaSimulatorConfig config_;
  std::array<MiaMotor, mia::kMotors> motors_;
  std::array<int, mia::kMotors> current_percent_{50, 50, 50};
  mia::CommandAssembler commands_;
  std::deque<Pending> pending_;
  TimePoint now_;
  TimePoint next_sample_;
  TimePoint next_stream_;
  std::string streams_;  ///< channels that are on
  std::vector<MiaSample> log_;
  std::size_t log_begin_{0};
  MiaSimulatorCounters counters_;
  bool mute_{false};
  unsigned drop_{0};
  unsigned garble_{0};
};

}  // namespace embody::sim
