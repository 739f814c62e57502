#pragma once
// What flows between the threads. Created once in wiring; each edge has one writer and one reader.
#include <atomic>

#include "core/hal/arm_driver.hpp"
#include "core/hal/hand_driver.hpp"
#include "core/hal/hand_tracker.hpp"
#include "core/hal/types.hpp"
#include "core/hand/marker_guard.hpp"
#include "core/hand/triad_check.hpp"
#include "core/safety/hand_gate.hpp"
#include "core/safety/mode_machine.hpp"
#include "daemon/handoff/baton.hpp"
#include "daemon/handoff/event_ring.hpp"
#include "daemon/handoff/latest.hpp"
#include "daemon/handoff/wake.hpp"

namespace embody {

/// The markers on the back of the hand in one frame (core/hand/triad_check.hpp).
struct BackReport {
  bool checked{false};  ///< false: a sensor without such markers; nothing else is set
  bool ambiguous{false};
  hand::TriadState state{hand::TriadState::kMissing};
  std::array<std::uint8_t, 3> source{0, 1, 2};
  hand::TriadEdges reference_m{};  ///< zeros: not known
};

/// A frame together with the hand pose estimated from it.
struct TrackedFrame {
  std::uint64_t sequence{0};  ///< of HandPose; a gap is a skipped frame
  MarkerFrame frame;
  HandPose pose;
  BackReport back;
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
  safety::HandHold hold{safety::HandHold::kNoAnswer};
  std::uint32_t kept_joints{0};  ///< bit per joint that kept its last sure target
};

/// What became of each marker since the start: whoever looks now and then misses nothing.
struct MarkerTally {
  std::uint32_t frames{0};
  std::array<std::uint32_t, kMaxMarkers> seen{};  ///< by slot: frames in which the sensor measured it
  std::array<std::array<std::uint32_t, hand::kMarkerVerdictNames.size()>, kMaxMarkers> verdicts{};  ///< by slot
  std::array<std::uint32_t, hand::kTriadStateNames.size()> back{};

  void add(const TrackedFrame& tracked, const hand::CheckedMarkers& markers) noexcept {
    const MarkerFrame& frame = tracked.frame;
    ++frames;
    if (tracked.back.checked) ++back[static_cast<std::size_t>(tracked.back.state)];
    for (std::size_t slot = 0; slot < kMaxMarkers; ++slot) {
      if (slot < frame.count && frame.markers[slot].visible) ++seen[slot];
      ++verdicts[slot][static_cast<std::size_t>(markers.verdict[slot])];
    }
  }
};

/// What the finger loop shows of one frame.
struct FingerReport {
  HandState state;
  FingerTarget target;
  TrackedFrame tracked;
  hand::CheckedMarkers markers;
  MarkerTally tally;
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
  std::atomic<double> palm_scale{0.0};  ///< landmarks: PalmPoseEstimator::palm_scale()
  Latest<TrackedFrame> frame_to_fingers;
  Latest<HandPose> pose_to_arm;
  Latest<HandPose> pose_to_telemetry;
  Wake fingers_wake;
  // fingers ->
  std::array<std::atomic<Duration::rep>, kFingers> filter_lag_ns{};  ///< hand::HandStateFilter::lag()
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
  std::atomic<bool> hand_ready{false};    ///< the hand has answered in this connection
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
