#pragma once
// A Prensilia Mia hand on a serial line, or on another wire that carries its protocol.
#include <string>

#include "core/hal/hand_driver.hpp"
#include "drivers/mia/codec.hpp"
#include "drivers/mia/hand_line.hpp"
#include "drivers/mia/transmission.hpp"

namespace embody::mia {

struct MiaConfig {
  std::string device{"/dev/ttyUSB0"};
  Duration ack_timeout{std::chrono::milliseconds(20)};  ///< for the ACK, and again for the data after it
  int speed_percent{60};                                ///< 0..99; 100 % of the range is 90 units of the vendor
  int lost_after_timeouts{5};                           ///< consecutive ones that end the session
  std::array<double, kMotors> min_rad{0.0, -1.4, 0.0};  ///< motor limits; targets are clamped to them
  std::array<double, kMotors> max_rad{1.1345, 1.4, 1.396};
  Transmission transmission;
};

/// What happened on the line since the object was made. To be read by the thread that calls read() and write().
struct MiaCounters {
  std::uint64_t commands{0};    ///< frames sent
  std::uint64_t acks{0};        ///< good ACKs
  std::uint64_t timeouts{0};    ///< ACK or data that did not come in time
  std::uint64_t mismatches{0};  ///< lines that were not what was waited for
  std::uint64_t replies{0};     ///< position replies
  std::uint64_t expired{0};     ///< queued motions dropped because their time had passed
  std::uint64_t stops{0};       ///< stop exchanges started
};

/// Half duplex: one command is under way at a time; the next leaves when the ACK (and data) has come or timed out.
/// write() queues a cycle - the motors whose count changed, each at least once a second, then a position request - and
/// replaces what an older cycle has not sent yet. read() takes bytes, sends what is next and watches the time-outs:
/// call it when the descriptor is readable and at least every 20 ms.
///
/// kMove is refused when expired, not finite, of a wrong joint count, or while stopped. kHold and kStop are never
/// refused: they only make the hand quieter, and both drop motion that has not been sent. (The hand itself finishes the
/// last position command it acknowledged.)
/// kStop latches before anything is sent; then the stop command (up to four times until acknowledged) and, for firmware
/// that does not know it, zero speed to each motor. The latch opens on connect(), or on a kMove after a kHold once the
/// stop exchange is over. A kStop that was never acknowledged starts again with the next kStop.
class MiaHand final : public HandDriver {
 public:
  /// On the serial line `config.device`.
  explicit MiaHand(MiaConfig config);
  /// On the wire that `open` opens; `config.device` is its name for people.
  MiaHand(MiaConfig config, OpenLine open);
  ~MiaHand() override;

  Result<HandInfo> connect() override;
  IoStatus read(HandDeviceState& state) noexcept override;
  IoStatus write(const HandCommand& command, TimePoint now) noexcept override;

  [[nodiscard]] const MiaCounters& counters() const noexcept { return counters_; }
  [[nodiscard]] bool stopped() const noexcept { return stop_.latched; }
  /// Passive joint j_thumb_opp at the last position reply (rad).
  [[nodiscard]] double thumb_opposition() const noexcept;

 private:
  enum class Waiting : std::uint8_t { kNothing, kAck, kData };
  enum class Sent : std::uint8_t { kMotor, kRead, kStopAll, kZeroSpeed };
  enum class StopPhase : std::uint8_t { kOver, kStopAll, kZeroSpeed };

  /// The one command under way.
  struct Bus {
    Waiting waiting{Waiting::kNothing};
    Command command{};
    Sent sent{Sent::kRead};
    std::size_t motor{0};
    int counts{0};
    TimePoint t_sent{};
    TimePoint deadline{};
    int timeouts_in_a_row{0};
  };
  /// What waits for its turn.
  struct Motion {
    bool pending{false};
    int counts{0};
    TimePoint t_expires{};
  };
  struct Cycle {
    std::array<Motion, kMotors> motion{};
    bool read_pending{false};
    std::size_t next_slot{0};  ///< motors, then the position request: each in turn, so that none starves
  };
  /// The last position command that a motor acknowledged.
  struct Told {
    bool known{false};
    int counts{0};
    TimePoint when{};
  };
  struct StopState {
    bool latched{false};
    bool hold_seen{false};
    bool acknowledged{false};
    StopPhase phase{StopPhase::kOver};
    int tries{0};
    std::size_t motor{0};
    std::size_t zero_speed_acks{0};
  };
  struct Reply {
    bool ready{false};
    std::array<double, kMotors> counts{};
    TimePoint t_arrival{};
    std::uint64_t number{0};
    int missed_in_a_row{0};
  };

  // Session
  Result<HandInfo> probe();
  void end_session() noexcept;
  void hang_up() noexcept;

  // Bus
  void pump() noexcept;
  void take_line(std::string_view line, TimePoint now) noexcept;
  void take_ack(TimePoint now) noexcept;
  void take_timeout() noexcept;
  void send_next(TimePoint now) noexcept;
  bool send_slot(std::size_t slot, TimePoint now) noexcept;
  void transmit(const Command& command, Sent what, TimePoint now) noexcept;

  // Stop
  void request_stop() noexcept;
  void send_stop_step(TimePoint now) noexcept;
  void finish_stop_step(bool acknowledged) noexcept;

  // Commands
  [[nodiscard]] bool may_move(const HandCommand& command, TimePoint now) const noexcept;
  void queue_move(const HandCommand& command, TimePoint now) noexcept;
  void drop_motion() noexcept;

  MiaConfig config_;
  OpenLine open_;
  std::unique_ptr<HandLine> line_;  ///< empty: no session
  MiaCounters counters_;
  bool lost_{true};     ///< the session is over
  bool hung_up_{true};  ///< and the line with it
  Bus bus_;
  Cycle cycle_;
  std::array<Told, kMotors> told_{};
  StopState stop_;
  Reply reply_;
};

}  // namespace embody::mia
