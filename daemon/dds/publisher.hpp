#pragma once
// What embodyd shows on DDS: six topics with ROS 2-compatible names and types (docs/dds.md). Observation only: nothing
// is ever read from the network. Call everything from a normal (SCHED_OTHER) thread: creating the publisher starts
// Cyclone's threads, which inherit the caller's scheduling, and publishing allocates.
#include <chrono>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.hpp"
#include "core/hal/types.hpp"

namespace embody {

/// A point on CLOCK_REALTIME: what stamps on DDS are. The default value means "unknown" and is published as 0.
using WallTime = std::chrono::time_point<std::chrono::system_clock, Duration>;

/// `t` on the wall clock of this moment; "never" stays "unknown".
[[nodiscard]] WallTime to_wall_time(TimePoint t) noexcept;

struct DdsConfig {
  bool enabled{true};
  int domain{0};                   ///< 0 to 232; ROS 2 calls it ROS_DOMAIN_ID
  std::string interface { "lo" };  ///< name of the one network interface to use
  std::string side{"right"};       ///< part of the topic names: rt/embody/<side>/...
  /// IPv4 networks ("192.168.1.0/24", at most 16) whose datagrams are accepted. Empty: 127.0.0.0/8 and, for another
  /// interface than lo, the networks of its own addresses.
  std::vector<std::string> networks;
};

/// Published on rt/embody/status. Names are free, so that a new counter is no new wire format.
struct StatusSample {
  struct Counter {
    std::string name;
    std::uint64_t value{0};
  };
  struct Rate {
    std::string name;
    double rate_hz{0.0};
  };
  struct Latency {
    std::string name;
    std::uint64_t count{0};  ///< measurements behind the percentiles
    double p50_us{0.0};
    double p99_us{0.0};
    double p999_us{0.0};
    double max_us{0.0};
  };
  WallTime stamp{};
  std::string mode;
  std::string cause;
  std::uint32_t epoch{0};  ///< counts mode changes
  std::vector<Counter> counters;
  std::vector<Rate> rates;
  std::vector<Latency> latencies;
};

/// Published on rt/embody/<side>/markers.
struct MarkersSample {
  static constexpr std::uint8_t kBack = 254;
  static constexpr std::uint8_t kNoFinger = 255;

  struct Marker {
    std::string name;
    std::uint8_t finger{kNoFinger};  ///< index of Finger, kBack or kNoFinger
    bool seen{false};
    std::uint8_t verdict{0};  ///< hand::MarkerVerdict
    std::string source;
    Eigen::Vector3d p_W{0.0, 0.0, 0.0};
    double residual_m{-1.0};  ///< negative: not fitted
  };
  std::uint64_t frame_number{0};
  WallTime t_capture{};
  std::vector<Marker> markers;
  std::string back;
  double back_fit_error_m{0.0};
  std::vector<std::string> findings;
};

/// Owns the DDS domain, its participant and the writers. Writers are reliable, keep the last ten samples and never
/// wait for a reader: a sample that cannot be handed over at once is dropped and counted.
class DdsPublisher {
 public:
  struct Counters {
    std::uint64_t published{0};  ///< samples handed to the network
    std::uint64_t failed{0};     ///< samples dropped: inconsistent arguments, or Cyclone refused them
  };

  /// Joins the domain. With `enabled` false the publisher exists and publishes nothing. Call it before other threads
  /// open UDP sockets: every UDP socket that appears meanwhile gets the source filter.
  /// Errors: an impossible configuration, an unknown interface, a real-time calling thread, a domain already open in
  /// this process, no free participant port, or a socket that takes no source filter (then nothing stays open).
  static Result<DdsPublisher> create(const DdsConfig& config);

  DdsPublisher(DdsPublisher&&) noexcept;
  DdsPublisher& operator=(DdsPublisher&&) noexcept;
  ~DdsPublisher();

  /// `position_rad` has one value per name; `velocity_rad_s` too, or none. Returns false when the sample was dropped.
  bool publish_joint_states(std::span<const std::string> names, std::span<const double> position_rad,
                            std::span<const double> velocity_rad_s, WallTime stamp);
  /// Pose of the hand in the frame `frame_id` ("mocap" for the motion-capture world).
  bool publish_hand_pose(const Pose& X_WM, std::string_view frame_id, WallTime stamp);
  /// Stamps of `hand` are mapped to the wall clock here.
  bool publish_hand_state(const HandState& hand);
  bool publish_markers(const MarkersSample& sample);
  /// What the robot hand measures; `joints` names its motors.
  bool publish_hand_telemetry(const HandDeviceState& hand, std::span<const std::string> joints);
  bool publish_status(const StatusSample& status);

  [[nodiscard]] Counters counters() const noexcept;
  /// UDP sockets that carry the source filter; 0 when disabled.
  [[nodiscard]] std::size_t filtered_sockets() const noexcept;

 private:
  class Impl;
  explicit DdsPublisher(std::unique_ptr<Impl> impl) noexcept;
  std::unique_ptr<Impl> impl_;  // null: disabled
};

}  // namespace embody
