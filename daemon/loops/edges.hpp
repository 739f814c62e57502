#pragma once
// What flows between the threads. Created once in wiring; each edge has one writer and one reader.
#include <atomic>

#include "core/hal/arm_driver.hpp"
#include "core/hal/hand_driver.hpp"
#include "core/hal/hand_tracker.hpp"
#include "core/hal/types.hpp"
#include "core/safety/mode_machine.hpp"
#include "daemon/handoff/baton.hpp"
#include "daemon/handoff/event_ring.hpp"
#include "daemon/handoff/latest.hpp"
#include "daemon/handoff/wake.hpp"

namespace embody {

/// A frame together with the hand pose estimated from it.
struct TrackedFrame {
  std::uint64_t sequence{0};  ///< of HandPose; a gap is a skipped frame
  MarkerFrame frame;
  HandPose pose;
};

/// What the arm loop shows of one tick.
struct ArmReport {
  ArmState state;
  ArmCommand command;
  Pose X_BEd{Pose::Identity()};  ///< ungated target
  safety::ModeState mode;
};

/// What the hand loop shows of one cycle.
struct HandReport {
  HandDeviceState state;
  HandCommand command;
};

/// What the finger loop shows of one frame.
struct FingerReport {
  HandState state;
  FingerTarget target;
};

/// Times along the path of one hand pose into the first arm command that used it.
struct ArmTiming {
  TimePoint t_arrival{};  ///< marker frame read from the kernel
  TimePoint t_decoded{};
  TimePoint t_estimated{};  ///< pose published
  TimePoint t_tick{};       ///< robot package that used it was read
  TimePoint t_computed{};
  TimePoint t_written{};  ///< command handed to the kernel
};

/// Times along the path of one frame into a hand command.
struct FingerTiming {
  TimePoint t_arrival{};
  TimePoint t_taken{};  ///< finger loop started on it
  TimePoint t_solved{};
  std::array<double, kFingers> residual_m{};
  std::array<std::uint8_t, kFingers> visible_markers{};
};

/// Counters of the loops: written by one thread each, read by any.
struct LoopCounters {
  std::atomic<std::uint64_t> frames_received{0};
  std::atomic<std::uint64_t> frames_used{0};  ///< of these: with a valid, plausible hand pose
  std::atomic<std::uint64_t> poses_invalid{0};
  std::atomic<std::uint64_t> finger_frames{0};
  std::atomic<std::uint64_t> finger_skipped{0};
  std::atomic<std::uint64_t> robot_packages{0};
  std::atomic<std::uint64_t> robot_packages_skipped{
      0};                                          ///< missing in the robot's time stamps, or passed over in a backlog
  std::atomic<std::uint64_t> poses_superseded{0};  ///< never seen by the arm loop: a newer one came first
  std::atomic<std::uint64_t> arm_commands{0};
  std::atomic<std::uint64_t> arm_commands_dropped{0};  ///< expired or the kernel's buffer was full
  std::atomic<std::uint64_t> hand_commands{0};
  std::atomic<std::uint64_t> hand_replies{0};
  std::atomic<std::uint64_t> hand_cycles_late{0};  ///< periods passed over
};

/// Progress of each loop for the watchdog: counts returned waits.
struct Heartbeats {
  std::atomic<std::uint64_t> arm{0};
  std::atomic<std::uint64_t> tracker{0};
  std::atomic<std::uint64_t> hand{0};
  std::atomic<std::uint64_t> fingers{0};
  std::atomic<std::uint64_t> watchdog{0};
};

struct Edges {
  // tracker ->
  Latest<TrackedFrame> frame_to_fingers;
  Latest<HandPose> pose_to_arm;
  Latest<HandPose> pose_to_telemetry;
  Wake fingers_wake;
  // fingers ->
  Latest<FingerTarget> target_to_hand;
  Latest<FingerReport> fingers_to_telemetry;
  EventRing<FingerTiming, 256> finger_timings;
  // arm ->
  Latest<safety::ModeState> mode_to_hand;
  Latest<safety::ModeState> mode_to_main;
  Latest<safety::ModeState> mode_to_telemetry;
  Latest<ArmReport> arm_to_telemetry;
  EventRing<ArmTiming, 1024> arm_timings;
  // hand ->
  Latest<HandReport> hand_to_telemetry;
  // main -> arm
  EventRing<safety::Request, 64> requests;

  LoopCounters counters;
  Heartbeats heartbeats;
  std::atomic<bool> hand_ready{false};    ///< the hand has answered in this session
  std::atomic<bool> arm_finished{false};  ///< after stop: the arm loop has ended
  std::atomic<bool> arm_still{false};     ///< then: the arm was disarmed or gone, not given up on
  std::atomic<bool> failed{false};        ///< a thread for upkeep ended by an exception
  std::atomic<bool> watchdog_bit{false};  ///< a loop was found hung; latched
  std::atomic<bool> stop{false};          ///< all loops end
};

using TrackerBaton = Baton<HandTracker, TrackerInfo>;
using ArmBaton = Baton<ArmDriver, ArmInfo>;
using HandBaton = Baton<HandDriver, HandInfo>;

}  // namespace embody
