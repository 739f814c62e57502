#pragma once
// A Prensilia Mia hand on a serial line, or on another wire that carries its protocol.
#include <atomic>
#include <functional>

#include "core/hal/hand_driver.hpp"
#include "drivers/mia/exchange.hpp"
#include "drivers/mia/hand_line.hpp"
#include "drivers/mia/mia_config.hpp"
#include "drivers/mia/motion_queue.hpp"
#include "drivers/mia/motion_watch.hpp"
#include "drivers/mia/stop_sequence.hpp"

namespace embody::mia {

/// Motors are moved by position commands only: the hand has no watchdog, and a position command ends by itself.
///
/// Acknowledging firmware: half duplex, one command is under way at a time (exchange.hpp). A lost one is sent once
/// more. write() queues a cycle - the motors whose target changed, each at least once a second, then a position request
/// - and replaces what an older cycle has not sent yet. Streaming firmware: commands leave one after the other, as the
/// wire takes them, each motor at least four times a second because nobody tells what arrived; positions come by
/// themselves. read() takes bytes, sends what is next and watches the time: call it when the descriptor is readable and
/// at least every 20 ms.
///
/// kMove is refused when expired, not finite, of a wrong joint count, while stopped, while the calibration is in doubt,
/// and while a streaming hand tells no positions. kHold and kStop are never refused: they only make the hand quieter,
/// and both drop motion that has not been sent. (The hand itself finishes the last position command it heard.) kStop
/// latches before anything is sent (stop_sequence.hpp); positions are then asked for until the hand stands still, and
/// if it does not within half a second it is stopped again. The latch opens on connect(), or on a kMove after a kHold
/// once the stop is over and the positions were read again.
///
/// When the hand was found to have restarted (motion_watch.hpp; its supply may have dropped), the session ends and the
/// calibration is in doubt: connect() succeeds, positions are read, but nothing moves until confirm_calibration().
class MiaHand final : public HandDriver {
 public:
  /// On the serial line `config.device`.
  explicit MiaHand(const MiaConfig& config);
  /// On the wire that `open` opens; `config.device` is its name for people.
  MiaHand(MiaConfig config, OpenLine open);
  ~MiaHand() override;

  Result<HandInfo> connect() override;
  IoStatus read(HandDeviceState& state) noexcept override;
  IoStatus write(const HandCommand& command, TimePoint now) noexcept override;

  /// Makes a connected hand calibrate its motor positions: **it moves**. Blocks until the positions have been still for
  /// a second, at most 30 s; the hand itself shows the end by its green light only. Call it in place of read() and
  /// write(), never while they run. Leaves the confirmation to the operator. Acknowledging firmware only. `cancelled`
  /// is asked ten times a second; then the hand is stopped (whether a stop ends a calibration was not tried on
  /// hardware). Errors: kDisconnected, kRefused (stopped, cancelled), kUnsupported, kTimeout.
  Status calibrate(const std::function<bool()>& cancelled = {});
  /// The operator has seen that the counters are right. From any thread.
  void confirm_calibration() noexcept { calibration_in_doubt_.store(false, std::memory_order_relaxed); }
  [[nodiscard]] bool calibration_in_doubt() const noexcept {
    return calibration_in_doubt_.load(std::memory_order_relaxed);
  }

  [[nodiscard]] const MiaCounters& counters() const noexcept { return counters_; }
  // The rest is for the thread that calls read() and write().
  [[nodiscard]] const MiaTelemetry& telemetry() const noexcept { return telemetry_.data(); }
  /// Takes the mean of the next readings for zero force.
  void tare() noexcept { telemetry_.tare(); }
  [[nodiscard]] Generation generation() const noexcept { return generation_; }
  [[nodiscard]] bool stopped() const noexcept { return stop_.latched(); }
  /// No motor has moved for 150 ms up to the last position reply.
  [[nodiscard]] bool standing_still() const noexcept { return watch_.still(); }
  /// Passive joint j_thumb_opp at the last position reply (rad).
  [[nodiscard]] double thumb_opposition() const noexcept;

 private:
  struct Reply {
    bool ready{false};
    std::array<double, kMotors> q_rad{};
    TimePoint t_arrival{};
    std::uint64_t number{0};
  };
  /// Of a streaming hand.
  struct Stream {
    TimePoint t_line{};                  ///< last line that could be read
    TimePoint t_position{};              ///< last position
    TimePoint t_asked{};                 ///< last sign of life that was asked for
    TimePoint t_answered{};              ///< first answer to that since the positions ended
    TimePoint t_wire_free{};             ///< when the wire has carried what was sent
    std::array<TimePoint, 2> t_armed{};  ///< currents and forces switched on
  };

  // Session (session.cpp)
  Result<HandInfo> start_session();
  [[nodiscard]] HandInfo describe(std::string_view firmware) const;
  void end_session() noexcept;
  void lose(std::string_view reason) noexcept;
  void hang_up() noexcept;
  void hand_restarted() noexcept;
  void doubt_calibration() noexcept;
  void tell(TimePoint now, HandTelemetry& telemetry) const noexcept;

  // Both generations
  void pump() noexcept;
  void turn(TimePoint now) noexcept;
  void take_positions(const std::array<double, kMotors>& counts, const std::array<double, kMotors>& q_rad,
                      TimePoint now) noexcept;
  [[nodiscard]] std::optional<Outgoing> next_motion(std::size_t motor, TimePoint now) noexcept;
  void transmit(const Outgoing& outgoing, TimePoint now) noexcept;
  void request_stop() noexcept;
  void finish_stop_step(bool acknowledged, TimePoint now) noexcept;
  void watch_stop(TimePoint now) noexcept;

  // Acknowledging firmware (acknowledging.cpp)
  void take_answer(std::string_view line, TimePoint now) noexcept;
  void take_ack(TimePoint now) noexcept;
  void take_data(std::string_view line, TimePoint now) noexcept;
  void take_timeout(TimePoint now) noexcept;
  void give_up() noexcept;
  void send_next(TimePoint now) noexcept;

  // Streaming firmware (streaming.cpp)
  void take_streamed(std::string_view line, TimePoint now) noexcept;
  void supervise_stream(TimePoint now) noexcept;
  void turn_streaming(TimePoint now) noexcept;
  bool send_streaming(TimePoint now) noexcept;

  // Commands
  [[nodiscard]] bool may_move(const HandCommand& command, TimePoint now) const noexcept;
  void queue_move(const HandCommand& command, TimePoint now) noexcept;
  void drop_motion() noexcept;

  MiaConfig config_;
  OpenLine open_;
  std::unique_ptr<HandLine> line_;  ///< empty: no session
  MiaCounters counters_;
  Generation generation_{Generation::kAcknowledging};
  bool lost_{true};        ///< the session is over
  bool hung_up_{true};     ///< and the line with it
  bool restarted_{false};  ///< why it is over
  std::atomic<bool> calibration_in_doubt_{false};

  MotionQueue queue_;
  MotionWatch watch_;
  StopSequence stop_;
  TelemetryReader telemetry_;
  Reply reply_;
  Exchange exchange_;
  Stream stream_;
  bool read_pending_{false};
  std::size_t next_slot_{0};  ///< motors, then the position request: each in turn, so that none starves
  int timeouts_in_a_row_{0};
  int missed_replies_{0};
  TimePoint t_session_{};  ///< began
  TimePoint t_written_{};
  TimePoint t_asked_{};      ///< last position request
  TimePoint t_stop_over_{};  ///< the last stop sequence had been sent
};

}  // namespace embody::mia
