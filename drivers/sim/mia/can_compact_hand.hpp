#pragma once
// What a Mia hand behind a gateway with the profile "compact" does with the frames it gets: no thread, no descriptor,
// no clock. Time is an argument. The profile is our own, not Prensilia's (drivers/mia/compact/codec.hpp).
#include <array>
#include <deque>
#include <optional>
#include <vector>

#include "drivers/mia/compact/codec.hpp"
#include "drivers/sim/mia/motor.hpp"

namespace embody::sim {

struct CompactHandConfig {
  mia::compact::Ids ids;
  double lag_s{0.04};                                            ///< of the motors
  Duration ack_delay{std::chrono::milliseconds(1)};              ///< of the gateway
  Duration heartbeat_timeout{std::chrono::milliseconds(300)};    ///< three periods of the host
  std::array<double, mia::kMotors> start_counts{0.0, 0.0, 0.0};  ///< thumb, index, MRL
};

struct CompactHandCounters {
  std::uint64_t commands{0};         ///< good frames
  std::uint64_t motions{0};          ///< of these: executed position and speed commands
  std::uint64_t stops{0};            ///< of these: stops
  std::uint64_t refused{0};          ///< of these: answered with a no
  std::uint64_t repeated{0};         ///< of these: counter as before; not executed
  std::uint64_t damaged{0};          ///< frames without effect and answer: CRC, length
  std::uint64_t heartbeats{0};       ///< good ones
  std::uint64_t heartbeat_stops{0};  ///< times that it stopped for want of them
};

class CompactHand {
 public:
  using CanFrame = transport::CanFrame;

  CompactHand(const CompactHandConfig& config, TimePoint now);

  void receive(const CanFrame& frame, TimePoint now);
  /// Moves on to `now`; returns what the hand says until then.
  std::vector<CanFrame> advance(TimePoint now);
  /// Moves on to `now` and says nothing: that is left to the next advance().
  void move_to(TimePoint now) noexcept;
  /// When advance() will next have something to do.
  [[nodiscard]] std::optional<TimePoint> next_event() const noexcept;

  [[nodiscard]] std::array<double, mia::kMotors> motor_counts() const noexcept;
  [[nodiscard]] const CompactHandCounters& counters() const noexcept { return counters_; }
  [[nodiscard]] bool heartbeat_lost() const noexcept { return heartbeat_lost_; }

  // Faults.
  void silence(bool on) noexcept { silent_ = on; }  ///< obeys, but sends nothing
  void silence_motor(std::size_t motor, bool on) noexcept { mute_motor_[motor] = on; }
  void drop_acks(unsigned n) noexcept { drop_acks_ = n; }    ///< the next n are not sent
  void break_crc(unsigned n) noexcept { broken_crcs_ = n; }  ///< of the next n acknowledgements
  void garble_states(unsigned n) noexcept { garbled_ = n; }  ///< the next n states are cut to five bytes
  void drop_states(unsigned n) noexcept { drop_states_ = n; }
  void stick_counter(bool on) noexcept { stuck_ = on; }         ///< of the states
  void lower_supply(bool on) noexcept { under_voltage_ = on; }  ///< flag only
  void restart();  ///< as after a loss of power: at rest, positions unknown, no stream
  void calibrate() noexcept { calibrated_ = true; }

 private:
  struct Pending {
    TimePoint due{};
    mia::compact::Ack ack;
  };

  [[nodiscard]] mia::compact::AckStatus execute(const mia::compact::Command& command);
  [[nodiscard]] mia::compact::AckStatus drive(const mia::compact::Command& command);
  void halt(std::uint8_t motor) noexcept;
  void say_states(std::vector<CanFrame>& out);
  void say_ack(const mia::compact::Ack& ack, std::vector<CanFrame>& out);

  CompactHandConfig config_;
  TimePoint now_;
  std::array<MiaMotor, mia::kMotors> motors_;
  std::deque<Pending> pending_;
  std::array<std::optional<std::uint8_t>, mia::kMotors + 1> last_counter_{};
  std::optional<Duration> state_period_;
  TimePoint next_state_{};
  unsigned forces_every_{0};
  unsigned states_said_{0};
  std::uint8_t state_counter_{0};
  std::uint8_t forces_counter_{0};
  std::optional<TimePoint> heartbeat_due_;
  bool heartbeat_lost_{false};
  bool calibrated_{true};
  bool under_voltage_{false};
  CompactHandCounters counters_;
  bool silent_{false};
  bool stuck_{false};
  std::array<bool, mia::kMotors> mute_motor_{};
  unsigned drop_acks_{0};
  unsigned drop_states_{0};
  unsigned broken_crcs_{0};
  unsigned garbled_{0};
};

}  // namespace embody::sim
