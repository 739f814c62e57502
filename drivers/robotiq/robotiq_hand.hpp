#pragma once
// A Robotiq 2F-140 (or 2F-85) gripper on a serial line, Modbus RTU, 115200 baud 8N1.
#include <atomic>
#include <functional>
#include <string>
#include <string_view>

#include "core/hal/hand_driver.hpp"
#include "drivers/robotiq/modbus.hpp"
#include "drivers/robotiq/registers.hpp"
#include "drivers/transport/unique_fd.hpp"

namespace embody::robotiq {

struct RobotiqConfig {
  std::string device{"/dev/ttyUSB0"};
  int slave{9};                       ///< Modbus address, 1..247; 9 as delivered
  std::string joint{"finger_joint"};  ///< motor of the hand file
  double rate_hz{50.0};               ///< commands per second
  Duration reply_timeout{std::chrono::milliseconds(40)};
  Duration frame_gap{std::chrono::milliseconds(2)};  ///< silence between frames; the standard asks for 1.75 ms
  int lost_after_failures{5};                        ///< failed exchanges in a row that end the session
  int speed{255};                                    ///< rSP, 0..255: 30 to 250 mm/s (2F-140)
  int force{64};                                     ///< rFR, 0..255: 10 to 125 N (2F-140)
  bool combined_exchange{false};                     ///< command and status in one exchange (function 23)
  PositionScale scale;
};

/// What happened since the object was made.
struct RobotiqCounters {
  Counter requests;     ///< frames sent
  Counter replies;      ///< good answers
  Counter statuses;     ///< of these: with a status
  Counter timeouts;     ///< answers that did not come in time, or were not intact
  Counter crc_errors;   ///< of these: bytes came, but no frame whose CRC fits
  Counter exceptions;   ///< requests that the gripper refused
  Counter faults;       ///< times that the gripper reported a fault that was not there before
  Counter expired;      ///< queued motions dropped because their time had passed
  Counter withheld;     ///< queued motions dropped because the gripper was not known to be activated
  Counter stops;        ///< stop exchanges started
  Counter activations;  ///< activations started
};

/// Half duplex: one request is under way at a time. write() queues a cycle - the target if it changed, and at least
/// once a second, then a status request - and replaces what an older cycle has not sent yet. read() takes bytes, sends
/// what is next and watches the time-outs: call it when the descriptor is readable and at least every 20 ms.
///
/// The gripper must be activated once after power-up, and that opens and closes its fingers. So nothing here activates
/// it but an explicit activate() or request_activation(); connect() only reads. A motion is sent only if a status of
/// the last 250 ms says that the gripper is activated and has no fault: to a gripper that has lost its power meanwhile,
/// the same bytes would be an activation. (That a restart takes it longer than 250 ms was not tried on hardware.)
///
/// kMove is refused when expired, not finite, of a wrong joint count, while stopped, and while why_not() has a reason.
/// kHold and kStop are never refused and drop motion that has not been sent. On kHold, the gripper finishes the last
/// position that it was told, and an activation under way goes on.
/// kStop latches before anything is sent; then "stop where you are" (up to three times until acknowledged), and if that
/// fails or the gripper is not known to be activated, a reset, which takes the motor's power and the activation away
/// and ends an activation under way. The latch opens on connect(), or on a kMove after a kHold once the stop exchange
/// is over. A kStop that was never acknowledged starts again with the next kStop. A gripper that is left alone finishes
/// its last position; it has no watchdog that stops it.
class RobotiqHand final : public HandDriver {
 public:
  explicit RobotiqHand(RobotiqConfig config);
  ~RobotiqHand() override;

  Result<HandInfo> connect() override;
  IoStatus read(HandDeviceState& state) noexcept override;
  IoStatus write(const HandCommand& command, TimePoint now) noexcept override;

  /// Asks for an activation: THE FINGERS OPEN AND CLOSE. From any thread. The next write() takes it up unless it is a
  /// kStop, the stop is latched, or the request is older than half a second; a new session forgets it. Nothing happens
  /// when the gripper is activated and free of faults.
  void request_activation() noexcept;
  /// The same for the owner of the driver, waiting until it is over. `cancelled` is asked at each turn; then the
  /// gripper is reset, which ends the activation where the fingers are. Errors: kRefused (stopped, fault, cancelled),
  /// kTimeout, kDisconnected.
  Status activate(Duration limit = std::chrono::seconds(10), const std::function<bool()>& cancelled = {});

  /// Why a kMove would be refused now, as a sentence; empty when it would not. By the thread that calls write().
  [[nodiscard]] std::string_view why_not() const noexcept;
  /// As of the last answer.
  [[nodiscard]] const GripperStatus& status() const noexcept { return status_.last; }
  [[nodiscard]] bool stopped() const noexcept { return stop_.latched; }
  [[nodiscard]] bool activating() const noexcept { return activation_.phase != ActivationPhase::kOver; }
  [[nodiscard]] const RobotiqCounters& counters() const noexcept { return counters_; }

 private:
  enum class Sent : std::uint8_t { kStatus, kMotion, kStop, kActivation };
  enum class ActivationPhase : std::uint8_t { kOver, kReset, kStart, kWatch };

  /// The one request under way.
  struct Bus {
    bool waiting{false};
    bool heard{false};  ///< a byte came since the request
    modbus::Request request;
    Sent sent{Sent::kStatus};
    TimePoint t_sent{};
    TimePoint deadline{};
    TimePoint quiet_until{};  ///< no request before
    int failures_in_a_row{0};
    std::uint8_t exception{0};  ///< of the last failure, 0 for silence
  };
  struct Motion {
    bool pending{false};
    int counts{0};
    TimePoint t_expires{};
  };
  struct Cycle {
    Motion motion;
    bool status_pending{false};
    bool status_is_due{false};  ///< a motion was sent last: the status goes first
  };
  /// The last target that the gripper acknowledged.
  struct Told {
    bool known{false};
    int counts{0};
    TimePoint when{};
  };
  struct Stop {
    bool latched{false};
    bool hold_seen{false};
    bool acknowledged{false};
    bool under_way{false};
    int tries{0};
  };
  struct ActivationState {
    ActivationPhase phase{ActivationPhase::kOver};
    TimePoint deadline{};
  };
  struct StatusState {
    GripperStatus last;
    TimePoint when{};
    bool fresh{false};     ///< read() has not passed it on
    bool believed{false};  ///< no reset was sent since
    std::uint64_t number{0};
  };

  // Session
  Result<HandInfo> probe();
  void end_session() noexcept;
  void lose(std::string_view why) noexcept;

  // Bus
  void pump() noexcept;
  void drain() noexcept;
  void take_reply(const modbus::Reply& reply, TimePoint now) noexcept;
  void take_status(const modbus::Reply& reply, TimePoint now) noexcept;
  void take_failure(std::uint8_t exception) noexcept;
  void tell(HandTelemetry& telemetry) const noexcept;
  void send_next(TimePoint now) noexcept;
  bool send_motion(TimePoint now) noexcept;
  void transmit(const modbus::Request& request, Sent what, TimePoint now) noexcept;
  [[nodiscard]] modbus::Request status_request() const noexcept;
  [[nodiscard]] modbus::Request command_request(const GripperCommand& command, bool with_status) const noexcept;

  // Stop and activation
  void request_stop() noexcept;
  void send_stop(TimePoint now) noexcept;
  void finish_stop(bool acknowledged) noexcept;
  void take_up_activation(HandAction action, TimePoint now) noexcept;
  void send_activation_step(TimePoint now) noexcept;
  void watch_activation(TimePoint now) noexcept;

  // Commands
  [[nodiscard]] bool may_move(const HandCommand& command, TimePoint now) const noexcept;
  [[nodiscard]] bool known_activated(TimePoint now) const noexcept;
  void queue_move(const HandCommand& command, TimePoint now) noexcept;

  RobotiqConfig config_;
  transport::UniqueFd fd_;
  modbus::Assembler incoming_;
  RobotiqCounters counters_;
  bool lost_{true};     ///< the session is over
  bool hung_up_{true};  ///< and the line with it
  Bus bus_;
  Cycle cycle_;
  Told told_;
  Stop stop_;
  ActivationState activation_;
  StatusState status_;
  std::atomic<Duration::rep> activation_asked_{0};  ///< when, since the clock's epoch; 0: not
};

}  // namespace embody::robotiq
