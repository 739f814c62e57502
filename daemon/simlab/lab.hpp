#pragma once
// The simulated lab: a QTM server that plays a recording, a UR10e controller and a Mia hand, with real bytes.
#include <atomic>
#include <memory>
#include <string>

#include "daemon/app/config.hpp"
#include "daemon/app/models.hpp"
#include "daemon/simlab/follow_report.hpp"

namespace embody::sim {

struct LabConfig {
  std::string recording;   ///< TSV file
  double duration_s{0.0};  ///< of the recording that is played; 0: all
  std::string address{"127.0.0.1"};
  std::uint16_t qtm_port{0};  ///< 0: a free one
  std::uint16_t ur_port{0};
  std::uint16_t ur_primary_port{0};
  std::uint16_t ur_dashboard_port{0};
  std::string mia_link;                               ///< path of a symlink to the hand's pseudo-terminal; empty: none
  Eigen::Vector3d start_offset_m{-0.05, 0.03, 0.08};  ///< flange at the start, off the recording's first target (B)
};

class Lab {
 public:
  /// Loads the recording and places the arm. Errors: of the recording (kMalformed, ...), kInvalidArgument when its
  /// first pose is out of the arm's reach.
  static Result<std::unique_ptr<Lab>> create(const config::EmbodyConfig& config, const LabConfig& lab);

  Status start();
  /// All three devices have a client that talks.
  [[nodiscard]] bool all_devices_in_use() const;
  void play();
  [[nodiscard]] bool finished() const { return qtm_.finished(); }

  [[nodiscard]] std::uint16_t qtm_port() const { return qtm_.port(); }
  [[nodiscard]] const UrController& ur() const { return ur_; }
  [[nodiscard]] std::string mia_device() const { return mia_.device(); }
  [[nodiscard]] std::size_t frame_count() const noexcept { return recording_.frames.size(); }
  [[nodiscard]] double rate_hz() const noexcept { return recording_.rate_hz; }

  /// Makes a fault happen: "qtm disconnect", "qtm pause MS", "qtm hide MARKER", "qtm show MARKER",
  /// "qtm swap MARKER MARKER", "qtm ghost MARKER on|off", "ur protective_stop", "ur emergency_stop", "ur clear_stop",
  /// "ur disconnect", "ur freeze on|off", "ur program on|off", "mia unplug", "mia plug", "mia mute on|off". Errors:
  /// kInvalidArgument.
  Status fault(const std::string& command);

  /// Judgement and counts as one JSON object.
  [[nodiscard]] std::string report_json() const;

 private:
  Lab(const config::ArmConfig& arm, Models models, recording::Recording recording, const LabConfig& lab,
      const Vector6& q_start_rad);

  Models models_;
  recording::Recording recording_;
  QtmServer qtm_;
  UrController ur_;
  MiaSimulator mia_;
};

}  // namespace embody::sim
