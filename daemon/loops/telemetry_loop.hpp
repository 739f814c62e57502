#pragma once
// What the real-time loops leave behind becomes statistics, log lines and DDS topics. Normal scheduling.
#include <array>
#include <memory>
#include <mutex>
#include <string>

#include "core/embodiment/embodiment_mapping.hpp"
#include "core/robot/ur_kinematics.hpp"
#include "daemon/app/histogram.hpp"
#include "daemon/dds/publisher.hpp"
#include "daemon/loops/marker_watch.hpp"

namespace embody {

/// Stages whose duration is measured, along the arm's path and then the fingers' (docs/demo.md).
enum class Stage : std::uint8_t { kDecode, kHandPose, kPhaseWait, kArm, kWrite, kTotal, kFingerWait, kFingerSolve };
inline constexpr std::array<const char*, 8> kStageNames{"decode", "hand_pose", "phase_wait",  "arm",
                                                        "write",  "total",     "finger_wait", "fingers"};

/// Statistics at one moment; a copy for whoever asks.
struct TelemetrySnapshot {
  safety::ModeState mode;
  double tracker_hz{0.0};
  double arm_hz{0.0};   ///< commands to the arm per second
  double hand_hz{0.0};  ///< motion commands to the hand per second
  double fingers_hz{0.0};
  std::array<Histogram, kStageNames.size()> latency;  ///< by Stage
  std::array<double, kFingers> residual_mean_m{};     ///< mean over all frames since start
  std::array<double, kFingers> residual_now_m{};
  double arm_error_m{0.0};  ///< measured flange to ungated target, now
  double arm_error_rad{0.0};
  double hand_error_rad{0.0};  ///< largest difference of a finger joint to its target, now
  ArmState arm;
  HandDeviceState hand;
  HandAction hand_action{HandAction::kHold};
  safety::HandHold hand_hold{safety::HandHold::kNoAnswer};
  std::uint32_t kept_joints{0};  ///< of the robot hand, bit per joint: keeps its last sure target
  std::array<FingerQuality, kFingers> quality{};
  std::array<double, kFingers> confidence{};
  double hand_confidence{0.0};
  MarkersView markers;
  std::uint64_t dds_published{0};
  std::uint64_t dds_failed{0};
};

class TelemetryLoop {
 public:
  /// `hand` names and completes the hand's joints for the topics, `glove` names the markers, `arm` tells where the
  /// flange is.
  TelemetryLoop(Edges& edges, DdsPublisher publisher, EmbodimentMapping hand, const hand::GloveLayout& glove,
                const robot::UrGeometry& arm);
  /// Until edges.stop.
  void run();
  /// Any thread.
  [[nodiscard]] TelemetrySnapshot snapshot() const;

 private:
  void take();
  void take_timings();
  void watch_markers(TimePoint now);
  [[nodiscard]] Histogram& latency(Stage stage) { return data_.latency[static_cast<std::size_t>(stage)]; }
  void measure_errors();
  void measure_rates(TimePoint now);
  void log_mode();
  void log_hand_hold();
  void log_hand_condition();
  void publish(TimePoint now);
  void publish_joint_states();
  void publish_status();
  void publish_markers();

  Edges& edges_;
  DdsPublisher publisher_;
  EmbodimentMapping hand_;
  std::vector<std::string> joint_names_;

  TelemetrySnapshot data_;
  Pose X_BEd_{Pose::Identity()};
  FingerReport fingers_;
  HandReport hand_report_;
  MarkerWatch markers_;
  robot::UrGeometry arm_;
  bool new_pose_{false};
  bool new_fingers_{false};
  bool new_arm_{false};
  std::uint32_t logged_epoch_{0};
  std::array<double, kFingers> residual_sum_m_{};
  std::array<std::uint64_t, kFingers> residual_count_{};
  TimePoint t_rates_{};
  std::array<std::uint64_t, 4> rate_counts_{};
  TimePoint t_status_{};
  TimePoint t_markers_{};
  TimePoint t_telemetry_{};  ///< of the hand, published last
  std::uint64_t published_reply_{0};
  HandCondition logged_condition_{HandCondition::kUnknown};
  std::uint64_t published_markers_{0};
  bool unsure_{false};

  mutable std::mutex mutex_;
  TelemetrySnapshot shared_;
};

}  // namespace embody
