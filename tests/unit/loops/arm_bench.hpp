#pragma once
// An arm loop over a fake arm, driven by a script.
#include <gtest/gtest.h>

#include "daemon/loops/arm_loop.hpp"
#include "tests/unit/loops/fakes.hpp"
#include "tests/unit/teleop/arm_rig.hpp"

namespace embody::test {

/// Times so long that a busy machine changes nothing.
inline ArmLoopConfig patient() {
  ArmLoopConfig config;
  config.command_lifetime = std::chrono::seconds(10);
  config.arming_grace = std::chrono::seconds(10);
  return config;
}
inline safety::ModeConfig patient_modes() {
  safety::ModeConfig config;
  config.hold_after = std::chrono::seconds(10);
  config.stop_after = std::chrono::seconds(20);
  return config;
}

/// An arm loop with a fake arm, a tracker that is there, and a hand that has answered. Scripts run on the loop's
/// thread, once for each read() of the arm.
class ArmBench {
 public:
  explicit ArmBench(const ArmLoopConfig& config = patient(), const safety::ModeConfig& modes = patient_modes(),
                    teleop::Clutch clutch = teleop::Clutch::kAbsolute)
      : tracker_baton(tracker),
        arm_baton(arm),
        cell(cell_config(clutch)),
        loop(arm_baton, tracker_baton, cell, modes, config, edges) {
    tracker.fd = arm.fd = ready.get();
    tracker_baton.pass_to_loop(*tracker.connect());
    arm.state.condition = ArmCondition::kReady;
    arm.state.controller_time = std::chrono::seconds(3);
    arm.state.q_rad = usual_posture();
    edges.hand_ready = true;
    X_BE_goal = robot::forward_kinematics(usual_posture());
  }
  /// From the goal of the flange to the pose of the hand that means it, captured now.
  void publish_pose() {
    HandPose pose;
    pose.valid = valid;
    pose.streak = 100;
    pose.jumps = jumps;
    pose.sequence = ++poses;
    pose.t_capture = pose.t_arrival = transport::now();
    pose.X_WM = cell.X_BW.inverse() * X_BE_goal * cell.X_EP * cell.X_PM;
    edges.pose_to_arm.publish(pose);
  }
  void ask(safety::RequestKind kind) { edges.requests.push({kind, ++requests}); }
  /// Ends the loop the way the daemon does: it runs on until the arm stands still.
  void shut_down() {
    if (edges.stop) return;
    ask(safety::RequestKind::kShutdown);
    edges.stop = true;
  }
  safety::ModeState mode() {
    edges.mode_to_main.update();
    return edges.mode_to_main.get();
  }
  /// Connects and runs the loop to its end on a thread of its own; returns its heap uses.
  std::uint64_t run() {
    arm_baton.pass_to_loop(*arm.connect());
    WatchedThread thread(edges.stop, [this] { loop.run(); });
    EXPECT_TRUE(thread.started());
    return thread.join();
  }

  EventFd ready{true};
  FakeTracker tracker;
  FakeArm arm;
  Edges edges;
  TrackerBaton tracker_baton;
  ArmBaton arm_baton;
  teleop::ArmControllerConfig cell;
  Pose X_BE_goal{Pose::Identity()};
  std::uint64_t poses{0};
  std::uint32_t jumps{0};
  bool valid{true};
  std::uint32_t requests{0};
  ArmLoop loop;
};

/// A pose with every package, an engage request with the tenth, and `after(n)` decides about each later package.
template <class After>
std::function<IoStatus()> engaged_script(ArmBench& bench, After after) {
  return [&bench, after, n = 0]() mutable {
    ++n;
    bench.publish_pose();
    if (n == 10) bench.ask(safety::RequestKind::kEngage);
    return n <= 10 ? IoStatus::kDone : after(n);
  };
}

}  // namespace embody::test
