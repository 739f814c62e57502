#pragma once
// The simulated lab: a QTM server that plays a recording, a UR controller and a robot hand, with real bytes.
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "daemon/app/config.hpp"
#include "daemon/app/models.hpp"
#include "daemon/simlab/follow_report.hpp"
#include "daemon/simlab/simulated_hand.hpp"

namespace embody::sim {

struct LabConfig {
  std::string recording;   ///< TSV file
  double duration_s{0.0};  ///< of the recording that is played; 0: all
  bool loop{false};        ///< begin again after the last frame, for ever
  std::string address{"127.0.0.1"};
  std::uint16_t qtm_port{0};  ///< 0: a free one
  std::uint16_t ur_port{0};
  std::uint16_t ur_primary_port{0};
  std::uint16_t ur_dashboard_port{0};
  std::string mia_link;                               ///< path of a symlink to the hand's pseudo-terminal; empty: none
  std::optional<mia::Generation> mia_generation;      ///< firmware of a Mia; empty: what the configuration expects
  Eigen::Vector3d start_offset_m{-0.05, 0.03, 0.08};  ///< flange at the start, off the recording's first target (B)
};

/// A fault of one device, for people.
struct FaultHelp {
  std::string device;
  std::string words;
  std::string meaning;
};

/// Is a fault, device first, one that the lab would understand?
using FaultCheck = std::function<Status(std::string_view command)>;

/// play(), fault() and report_json() belong to one thread.
class Lab {
 public:
  /// Loads the recording and places the arm. Errors: of the recording (kMalformed, ...), kInvalidArgument when its
  /// first pose is out of the arm's reach, or when a device of the configuration cannot be simulated.
  static Result<std::unique_ptr<Lab>> create(const config::EmbodyConfig& config, const LabConfig& lab);

  Status start();
  /// All three devices have a client that talks.
  [[nodiscard]] bool all_devices_in_use() const;
  void play();
  /// When play() was called first.
  [[nodiscard]] std::optional<TimePoint> t_play() const noexcept { return t_play_; }
  [[nodiscard]] bool finished() const { return qtm_.finished(); }

  [[nodiscard]] const QtmServer& qtm() const { return qtm_; }
  [[nodiscard]] const UrController& ur() const { return ur_; }
  [[nodiscard]] const SimulatedHand& hand() const { return *hand_; }
  [[nodiscard]] std::uint16_t qtm_port() const { return qtm_.port(); }
  [[nodiscard]] std::string mia_device() const { return hand_->device(); }
  [[nodiscard]] std::size_t frame_count() const noexcept { return recording_.frames.size(); }
  [[nodiscard]] double rate_hz() const noexcept { return recording_.rate_hz; }

  /// Makes a fault happen: the device (qtm, ur or the hand's name), a blank, and words of its simulator, e.g.
  /// "qtm hide index_tip". fault_help() lists all. Errors: of the simulator, in its words; kInvalidArgument (device).
  Status fault(const std::string& command);
  [[nodiscard]] std::vector<FaultHelp> fault_help() const;
  /// For one series of faults, in the order in which they are to happen: names of markers and labels are those that
  /// the recording has, and those before have left. Nothing happens. @pre start() succeeded
  [[nodiscard]] FaultCheck fault_check() const;

  /// Judgement and counts as one JSON object.
  [[nodiscard]] std::string report_json() const;
  /// Devices, their clients and states, and the playback, as one JSON object.
  [[nodiscard]] std::string status_json() const;

 private:
  Lab(const config::ArmConfig& arm, Models models, recording::Recording recording, const LabConfig& lab,
      const Vector6& q_start_rad, std::unique_ptr<SimulatedHand> hand);
  [[nodiscard]] FollowReport judge_now(const std::vector<SentFrame>& sent) const;

  Models models_;
  bool loop_;
  recording::Recording recording_;
  QtmServer qtm_;
  UrController ur_;
  std::unique_ptr<SimulatedHand> hand_;
  std::optional<TimePoint> t_play_;
};

}  // namespace embody::sim
