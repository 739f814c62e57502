#pragma once
// A Mia hand on CAN, profile "compact" (codec.hpp): a command frame per motor with an acknowledgement, cyclic states.
// User-defined CAN profile, not a Prensilia specification, unverified on hardware.
#include <optional>
#include <string>

#include "core/hal/hand_driver.hpp"
#include "drivers/mia/compact/codec.hpp"
#include "drivers/mia/compact/state_watch.hpp"
#include "drivers/mia/compact/stop_sequence.hpp"
#include "drivers/transport/can.hpp"

namespace embody::mia::compact {

struct CompactConfig {
  std::string interface { "can0" };  ///< or "unix:/path" (drivers/transport/can_double.hpp)
  Ids ids;                           ///< base to base + 0x1F belong to the hand
  bool local_loopback{true};         ///< candump on this computer sees our frames; needed on vcan
  int speed_percent{60};             ///< 0..99
  int current_percent{50};           ///< 0..80
  double command_rate_hz{20.0};      ///< what the hand loop is told; the serial line behind a gateway carries no more
  int state_rate_hz{100};            ///< asked of the hand, 10..500
  int forces_every{5};               ///< a forces frame after so many states, 0 (none) to 100
  Duration ack_timeout{std::chrono::milliseconds(20)};
  int lost_after_timeouts{5};                                 ///< missing or refusing acknowledgements in a row
  Duration state_timeout{std::chrono::milliseconds(100)};     ///< no news of a motor for so long ends the session
  Duration heartbeat_period{std::chrono::milliseconds(100)};  ///< the hand stops after three missed ones
  std::array<double, kMotors> min_rad{0.0, -1.4, 0.0};        ///< motor limits; targets are clamped to them
  std::array<double, kMotors> max_rad{1.1345, 1.4, 1.396};
  Transmission transmission;
};

/// Since the object was made.
struct CompactCounters {
  Counter commands;    ///< command frames sent, stops included
  Counter acks;        ///< good ones that were waited for
  Counter refusals;    ///< acknowledgements that say no
  Counter stray_acks;  ///< nobody waited for them: late, or of a command replaced meanwhile
  Counter timeouts;    ///< acknowledgements that did not come in time
  Counter no_room;     ///< frames that the kernel did not take
  Counter damaged;     ///< frames with a wrong CRC, length or value
  Counter replies;     ///< complete sets of states
  Counter lost_states;
  Counter repeated_states;
  Counter heartbeats;
  Counter stops;           ///< stop exchanges started
  Counter under_voltages;  ///< sessions that ended because the hand's supply was too low
  Counter error_frames;    ///< of the CAN controller: errors on the bus
  Counter bus_offs;        ///< times that the controller left the bus
};

/// write() sends each motor's target when its count changed, and at least once a second; a newer target replaces one
/// that is not acknowledged yet. read() takes frames, watches time-outs and sends the heartbeat: call it when the
/// descriptor is readable and at least every 20 ms. So the heartbeat stops when the loop does, and with it the hand.
///
/// kMove is refused when expired, not finite, of a wrong joint count, or while stopped. kHold and kStop never are.
/// kStop latches first (stop_sequence.hpp); a kStop that was never acknowledged starts again with the next one.
/// The session ends, with a sentence in reason(), when states or acknowledgements stay away, when the hand says that it
/// stopped for want of heartbeats, that its supply is too low or that it lost its positions, and with the bus
/// (interface down or gone, bus-off).
class MiaCanHand final : public HandDriver {
 public:
  explicit MiaCanHand(CompactConfig config);
  ~MiaCanHand() override;

  Result<HandInfo> connect() override;
  IoStatus read(HandDeviceState& state) noexcept override;
  IoStatus write(const HandCommand& command, TimePoint now) noexcept override;

  [[nodiscard]] const CompactCounters& counters() const noexcept { return counters_; }
  /// Of the present or last bus since it was opened: error frames, full queues.
  [[nodiscard]] transport::CanCounters bus_counters() const noexcept;
  [[nodiscard]] bool stopped() const noexcept { return stop_.latched(); }
  /// Last forces frame (raw), last currents (raw) and the passive joint j_thumb_opp (rad).
  [[nodiscard]] const Forces& forces() const noexcept { return forces_; }
  [[nodiscard]] std::array<std::uint16_t, kMotors> currents() const noexcept;
  [[nodiscard]] double thumb_opposition() const noexcept;

 private:
  /// What one command identifier (a motor, or all) waits for.
  struct Exchange {
    bool waiting{false};
    Command command;
    TimePoint deadline{};
  };
  /// The last target that a motor acknowledged.
  struct Told {
    bool known{false};
    std::int16_t counts{0};
    TimePoint when{};
  };

  // Session (session.cpp)
  Status start(TimePoint deadline);
  Status ask(Opcode opcode, std::int16_t value, std::uint8_t speed_percent, TimePoint deadline);
  Status await_states(TimePoint deadline);
  void end_session() noexcept;

  // Frames
  void pump() noexcept;
  bool take_frame(const CanFrame& frame) noexcept;
  void take_state(std::size_t motor, const State& state, TimePoint t) noexcept;
  void take_ack(const Ack& ack) noexcept;
  void check_times(TimePoint now, bool drained) noexcept;
  void take_timeout(Exchange& exchange) noexcept;
  void beat(TimePoint now) noexcept;
  IoStatus transmit(Command command, TimePoint now) noexcept;
  void count_parts() noexcept;
  void tell(TimePoint now, HandTelemetry& telemetry) const noexcept;
  void lose(std::string_view why) noexcept;

  // Commands
  [[nodiscard]] bool may_move(const HandCommand& command, TimePoint now) const noexcept;
  void move(const HandCommand& command, TimePoint now) noexcept;
  void request_stop() noexcept;
  void send_stop(TimePoint now) noexcept;

  CompactConfig config_;
  std::optional<transport::CanBus> bus_;  ///< empty: no session
  bool lost_{true};
  bool bus_gone_{true};
  CompactCounters counters_;
  std::uint64_t error_frames_before_{0}, bus_offs_before_{0};  ///< of earlier sessions
  transport::CanCounters bus_counters_;
  std::array<Exchange, kMotors + 1> exchanges_{};
  std::array<std::uint8_t, kMotors + 1> next_counter_{};
  std::array<Told, kMotors> told_{};
  int failures_in_a_row_{0};
  StopSequence stop_;
  StateWatch states_;
  Forces forces_;
  TimePoint t_forces_{};        ///< arrival of forces_; never: none since connect()
  bool moving_allowed_{false};  ///< the last command was a motion
  std::uint8_t heartbeat_counter_{0};
  TimePoint next_heartbeat_{};
};

}  // namespace embody::mia::compact
