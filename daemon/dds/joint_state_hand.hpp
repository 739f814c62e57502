#pragma once
// A robot hand behind somebody else's driver (Shadow, Barrett), reached by DDS: commands and states are
// sensor_msgs/msg/JointState, so that a ROS 2 node of the same domain can be the other end.
#include <memory>
#include <string>
#include <vector>

#include "core/hal/hand_driver.hpp"

namespace embody::dds {

struct JointStateHandConfig {
  int domain{0};  ///< which DdsPublisher of this process has opened
  std::string command_topic{"rt/embody/right/hand_command"};
  std::string state_topic{"rt/joint_states"};
  std::vector<std::string> joints;                            ///< motors of the hand file, in its order
  double rate_hz{50.0};                                       ///< most commands per second
  Duration state_timeout{std::chrono::milliseconds(500)};     ///< without a state, the session is over
  Duration connect_timeout{std::chrono::milliseconds(3000)};  ///< to find the other end
  bool stop_publishes_position{true};                         ///< kStop: tells the hand to stay where it is
};

/// What happened since the object was made.
struct JointStateHandCounters {
  Counter states;     ///< whole ones
  Counter partial;    ///< messages with some of our joints
  Counter broken;     ///< messages with impossible positions
  Counter repeated;   ///< whole ones with the time stamp of the last: the sender's source stands still
  Counter commands;   ///< handed to DDS
  Counter stops;      ///< of these: the position at a stop
  Counter throttled;  ///< commands dropped because they came faster than rate_hz
  Counter failed;     ///< commands that DDS did not take
};

/// What the other end must do itself, because nothing here can:
/// - own the hardware: calibration, limits of position, speed, force and temperature, and its own emergency stop;
/// - use the names and angles of the hand file (rad). Shadow's J0 is J1 + J2: a node that publishes J1 and J2 has to
/// add
///   them up. A left Barrett hand has fingers 1 and 2 exchanged (docs/robot_hands.md);
/// - stop or hold when no command came for a while, and ignore commands whose header.stamp is old: kHold and a dead
///   daemon are silence on the topic, and a target that was handed over is finished;
/// - not move when it starts. We publish nothing before the first kMove.
/// Not tried with the hardware or the stack of either vendor.
///
/// States are taken by Cyclone's receive thread and passed on wait-free: read() neither locks nor allocates. write() of
/// a kMove calls dds_write(): it serialises into a buffer that Cyclone recycles or allocates, takes Cyclone's locks,
/// and sends the datagram in the calling thread. It never waits for a reader (max_blocking_time 0), but this is no call
/// for a real-time thread: run the hand loop of such a hand without SCHED_FIFO.
///
/// kMove is refused when expired, not finite, of a wrong joint count, or while stopped. kHold publishes nothing. kStop
/// latches and, if the present connection has moved the hand, publishes the last measured position once (or nothing, as
/// configured): that is not a standstill at once, the hand goes back to where it was measured, at its own pace. The
/// latch opens on connect(), or on a kMove after a kHold. The destructor does what kStop does.
class JointStateHand final : public HandDriver {
 public:
  explicit JointStateHand(JointStateHandConfig config);
  ~JointStateHand() override;

  /// Waits until somebody reads the commands and a whole state has come. Errors: kInvalidArgument; kRefused (the domain
  /// is not open in this process, or would open a socket without source filter); kTimeout (nobody there, or a sentence
  /// that names the missing joint); kIo.
  Result<HandInfo> connect() override;
  IoStatus read(HandDeviceState& state) noexcept override;
  IoStatus write(const HandCommand& command, TimePoint now) noexcept override;

  [[nodiscard]] const JointStateHandCounters& counters() const noexcept { return counters_; }
  [[nodiscard]] bool stopped() const noexcept { return latched_; }

 private:
  class Session;

  void publish_stop() noexcept;
  [[nodiscard]] bool may_move(const HandCommand& command, TimePoint now) const noexcept;
  bool take_states() noexcept;
  void lose(std::string_view why) noexcept;

  JointStateHandConfig config_;
  JointStateHandCounters counters_;
  std::unique_ptr<Session> session_;  ///< empty: no session; counts in counters_, and so goes before it
  bool lost_{true};
  bool latched_{false};
  bool hold_seen_{false};
  bool moved_{false};
  TimePoint next_command_{};
};

}  // namespace embody::dds
