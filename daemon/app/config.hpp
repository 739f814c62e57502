#pragma once
// The configuration of the daemon: plain structs with defaults, each visited by parser, printer and documentation
// (config_field.hpp). The keys are documented in docs/config.md, which is generated from this file.
#include <array>
#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "core/hal/types.hpp"
#include "daemon/app/config_devices.hpp"
#include "daemon/app/config_field.hpp"
#include "daemon/app/config_operator.hpp"

namespace embody::config {

inline constexpr int kSchema = 1;  ///< raised when, after a release, a key changes its meaning or disappears

/// Where things stand in the robot cell.
struct CellConfig {
  std::array<double, 3> p_WB_m{0.7, 0.2, 0.0};
  std::array<double, 3> r_WB_rad{0.0, 0.0, 0.0};
  std::array<double, 3> p_EP_m{0.0, 0.0, 0.05};
  std::array<double, 3> r_EP_rad{kPi / 2, 0.0, 0.0};

  template <class V>
  void visit(V& v) {
    v.field("p_WB_m", p_WB_m, Range{-100, 100}, "Arm base B in the motion-capture world W: position.");
    v.field("r_WB_rad", r_WB_rad, Range{-2 * kPi, 2 * kPi},
            "Arm base B in the motion-capture world W: rotation vector (axis times angle).");
    v.field("p_EP_m", p_EP_m, Range{-1, 1}, "Robot hand P in the arm's flange E: position.");
    v.field("r_EP_rad", r_EP_rad, Range{-2 * kPi, 2 * kPi},
            "Robot hand P in the arm's flange E: rotation vector. The default turns y_P to z_E and z_P to -y_E.");
  }
};

struct SafetyConfig {
  milliseconds hold_after{50};
  milliseconds resume_within{200};
  int resume_frames{5};
  milliseconds stop_after{1000};
  milliseconds mode_timeout{100};
  milliseconds command_lifetime{20};
  milliseconds finger_timeout{500};
  double min_hand_confidence{0.1};
  milliseconds unreachable_grace{200};
  milliseconds arming_grace{300};

  template <class V>
  void visit(V& v) {
    v.field("hold_after_ms", hold_after, Range{5, 1000}, "Tracking input older than this: the arm decelerates.");
    v.field("resume_within_ms", resume_within, Range{0, 1000},
            "Input that returns within this time, while the arm still decelerates, goes on; later it stays in hold.");
    v.field("resume_frames", resume_frames, Range{1, 100}, "Good frames in a row that count as returned input.");
    v.field("stop_after_ms", stop_after, Range{50, 60000}, "Input lost for this long: mode stopped, needs a reset.");
    v.field("mode_timeout_ms", mode_timeout, Range{20, 1000},
            "A mode older than this counts as holding for the hand: the arm loop is late or dead.");
    v.field("command_lifetime_ms", command_lifetime, Range{2, 500}, "A driver refuses a command older than this.");
    v.field("finger_timeout_ms", finger_timeout, Range{50, 5000}, "Finger angles older than this are not followed.");
    v.field("min_hand_confidence", min_hand_confidence, Range{0, 1},
            "A robot finger keeps its last target while the confidence in a human finger that it follows is below "
            "this; the robot hand holds while that in the back of the human hand is. 0: everything is followed.");
    v.field("unreachable_grace_ms", unreachable_grace, Range{0, 5000},
            "The hand may leave the workspace or the arm's reach for this long before the arm holds.");
    v.field("arming_grace_ms", arming_grace, Range{50, 5000},
            "Time that the program on the robot gets to start following.");
  }
  [[nodiscard]] std::string problem() const;
};

enum class RealtimeMode : std::uint8_t { kEnforce, kTry, kOff };
inline constexpr std::array<const char*, 3> kRealtimeModeNames{"enforce", "try", "off"};

/// SCHED_FIFO priorities of the threads; network interrupts run at 50.
struct PriorityConfig {
  int watchdog{48};
  int arm{46};
  int tracker{44};
  int hand{42};
  int fingers{40};

  template <class V>
  void visit(V& v) {
    v.field("watchdog", watchdog, Range{1, 98}, "Supervises the others: the highest.");
    v.field("arm", arm, Range{1, 98}, "Arm loop.");
    v.field("tracker", tracker, Range{1, 98}, "Tracker loop.");
    v.field("hand", hand, Range{1, 98}, "Hand loop.");
    v.field("fingers", fingers, Range{1, 98}, "Finger optimisation: the lowest.");
  }
  [[nodiscard]] std::string problem() const;
};

/// Processors that a thread may run on; empty = all.
struct CpuConfig {
  std::vector<int> watchdog;
  std::vector<int> arm;
  std::vector<int> tracker;
  std::vector<int> hand;
  std::vector<int> fingers;

  template <class V>
  void visit(V& v) {
    v.field("watchdog", watchdog, Range{0, 1023}, "Processors of the watchdog; empty = all.");
    v.field("arm", arm, Range{0, 1023}, "Processors of the arm loop.");
    v.field("tracker", tracker, Range{0, 1023}, "Processors of the tracker loop.");
    v.field("hand", hand, Range{0, 1023}, "Processors of the hand loop.");
    v.field("fingers", fingers, Range{0, 1023}, "Processors of the finger optimisation.");
  }
};

struct RealtimeConfig {
  RealtimeMode mode{RealtimeMode::kTry};
  bool lock_memory{true};
  PriorityConfig priority;
  CpuConfig cpus;

  template <class V>
  void visit(V& v) {
    v.choice("mode", mode, kRealtimeModeNames,
             "enforce: refuse to start without real-time rights; try: go on without and say so; off: do not ask.");
    v.field("lock_memory", lock_memory, "Keep all memory resident (mlockall).");
    v.section("priority", priority, "Real-time priority (SCHED_FIFO) of each thread.");
    v.section("cpus", cpus, "Processors that each thread may run on.");
  }
};

enum class OnMissing : std::uint8_t { kWait, kExit };
inline constexpr std::array<const char*, 2> kOnMissingNames{"wait", "exit"};

struct LinksConfig {
  OnMissing on_missing{OnMissing::kWait};
  seconds missing_timeout{10};
  milliseconds retry_first{250};
  milliseconds retry_longest{2000};

  template <class V>
  void visit(V& v) {
    v.choice("on_missing", on_missing, kOnMissingNames,
             "wait: try for ever to reach a missing device; exit: end after the time-out (exit code 69).");
    v.field("missing_timeout_s", missing_timeout, Range{1, 3600}, "Time-out of `on_missing = \"exit\"`.");
    v.field("retry_first_ms", retry_first, Range{10, 60000}, "Wait before the second attempt to connect; doubles.");
    v.field("retry_longest_ms", retry_longest, Range{10, 60000}, "Longest wait between two attempts.");
  }
  [[nodiscard]] std::string problem() const;
};

struct ControlConfig {
  std::string socket;
  bool group_access{false};

  template <class V>
  void visit(V& v) {
    v.field("socket", socket,
            "Path of the control socket. Empty: $RUNTIME_DIRECTORY/control.sock under systemd, else "
            "$XDG_RUNTIME_DIR/embody/control.sock, else /tmp/embody-UID/control.sock.");
    v.field("group_access", group_access,
            "Let the group of the daemon use the socket (0660 instead of 0600); always so under systemd.");
  }
};

struct DdsConfig {
  bool enabled{true};
  int domain{0};
  std::string interface { "lo" };
  std::vector<std::string> networks;

  template <class V>
  void visit(V& v) {
    v.field("enabled", enabled, "Publish topics.");
    v.field("domain", domain, Range{0, 232}, "DDS domain (ROS_DOMAIN_ID).");
    v.field("interface", interface, "Network interface of the topics; lo = this computer only.");
    v.field("networks", networks,
            "IPv4 networks (\"192.168.1.0/24\") whose datagrams are accepted. Empty: 127.0.0.0/8 and, for another "
            "interface than lo, the networks of its own addresses.");
  }
};

enum class LogLevel : std::uint8_t { kDebug, kInfo, kWarning, kError };
inline constexpr std::array<const char*, 4> kLogLevelNames{"debug", "info", "warning", "error"};

struct LogConfig {
  LogLevel level{LogLevel::kInfo};

  template <class V>
  void visit(V& v) {
    v.choice("level", level, kLogLevelNames, "What is logged.");
  }
};

struct EmbodyConfig {
  int schema{kSchema};
  TrackerConfig tracker;
  GloveConfig glove;
  SubjectConfig subject;
  RecordMappingConfig record_mapping;
  CellConfig cell;
  ArmConfig arm;
  HandConfig hand;
  SafetyConfig safety;
  RealtimeConfig realtime;
  LinksConfig links;
  ControlConfig control;
  DdsConfig dds;
  LogConfig log;

  /// Files that were read, the main one first. No key.
  std::vector<std::string> files;

  template <class V>
  void visit(V& v) {
    v.schema(schema, "Version of this format; every configuration file starts with it.");
    v.section("tracker", tracker, "The hand tracker.");
    v.section("glove", glove, "The marker glove.");
    v.section("subject", subject, "The person who wears it.");
    v.section("record_mapping", record_mapping, "From markers to the state of the human hand.");
    v.section("cell", cell, "Where things stand in the robot cell.");
    v.section("arm", arm, "The robot arm.");
    v.section("hand", hand, "The robot hand and the mapping of fingers to it.");
    v.section("safety", safety, "When motion ends.");
    v.section("realtime", realtime, "Scheduling.");
    v.section("links", links, "Connections to the devices.");
    v.section("control", control, "The control socket.");
    v.section("dds", dds, "Topics for observers.");
    v.section("log", log, "Log messages (standard error).");
  }
};

/// `config` with the times that a sensor slower than 100 Hz needs: resample_delay_ms of at least one and a half frame
/// periods, hold_after_ms of at least three, stop_after_ms of at least twice that: all within the ranges of these keys.
[[nodiscard]] EmbodyConfig adapted_to_sensor(EmbodyConfig config);

}  // namespace embody::config

namespace embody {
using config::EmbodyConfig;
}  // namespace embody
