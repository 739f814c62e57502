#pragma once
// Did the simulated robot follow the recorded hand? Judged from the recording and the plants' own logs alone; nothing
// that the daemon says is used.
#include <string>
#include <vector>

#include "daemon/app/models.hpp"
#include "drivers/recording/recording.hpp"
#include "drivers/sim/qtm/qtm_server.hpp"
#include "drivers/sim/ur/ur_controller.hpp"

namespace embody::sim {

/// What counts as following.
struct FollowCriteria {
  robot::UrGeometry arm = robot::kUr10e;
  Duration settle{std::chrono::seconds(3)};        ///< after the robot began to track, the clutch offset shrinks
  Duration start_within{std::chrono::seconds(5)};  ///< of the start of playback: tracking must have begun
  Duration largest_lag{std::chrono::milliseconds(250)};
  double arm_p95_m{0.015};
  double arm_p95_rad{0.08};
  double hand_p95_rad{0.15};
  double path_ratio_min{0.9};
  double path_ratio_max{1.1};
  Duration planned{0};       ///< length of the recording; 0: whatever was sent
  double engaged_min{0.95};  ///< part of the judged time in which the control program tracked
};

/// Errors are 95th percentiles at the constant lag that makes them smallest.
struct FollowReport {
  bool followed{false};
  std::string reason;  ///< first criterion that failed
  double judged_s{0.0};
  double first_tracking_s{-1.0};  ///< after the start of playback; negative: never
  double engaged_fraction{0.0};
  double arm_lag_s{0.0};
  double arm_error_m{0.0};
  double arm_error_rad{0.0};
  double hand_lag_s{0.0};
  double hand_error_rad{0.0};
  double path_ratio{0.0};  ///< flange path of the plant / of the ungated target
  double largest_joint_speed_rad_s{0.0};
};

/// The ungated target of one sent frame: what the robot would do without limits, filters and delays.
struct TargetSample {
  TimePoint t{};  ///< frame sent
  Pose X_BE{Pose::Identity()};
  std::array<double, kMaxHandJoints> q_hand_rad{};
};

/// Where the plant of the robot hand was, in the order of the hand file's motors.
struct HandSample {
  TimePoint t{};
  std::size_t count{0};  ///< motors
  std::array<double, kMaxHandJoints> q_rad{};
};

/// Runs the models over the recording's frames that were sent.
[[nodiscard]] std::vector<TargetSample> ungated_targets(const Models& models, const recording::Recording& recording,
                                                        const std::vector<SentFrame>& sent);

[[nodiscard]] FollowReport judge(const std::vector<TargetSample>& targets, const std::vector<UrSample>& arm,
                                 const std::vector<HandSample>& hand, const FollowCriteria& criteria = {});

}  // namespace embody::sim
