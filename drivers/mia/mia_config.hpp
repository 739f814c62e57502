#pragma once
// What can be set about a Mia hand, and what can be counted.
#include <optional>
#include <string>

#include "core/base/result.hpp"
#include "core/base/time.hpp"
#include "core/hal/counter.hpp"
#include "drivers/mia/telemetry.hpp"
#include "drivers/mia/transmission.hpp"

namespace embody::mia {

/// How a hand's firmware talks.
enum class Generation : std::uint8_t {
  kAcknowledging,  ///< one command at a time, each acknowledged, readings on request (vendor's ROS 2 driver)
  kStreaming,      ///< commands are only sent, readings stream by themselves (vendor's ROS 1 driver)
};

/// In which unit positions travel.
enum class Space : std::uint8_t {
  kMotor,  ///< counts; our transmission turns them into angles
  kJoint,  ///< hundredths of a rad; the hand's own calibration does. Acknowledging firmware only
};

struct MiaConfig {
  std::string device{"/dev/ttyUSB0"};
  std::optional<Generation> generation;  ///< empty: connect() finds out
  Space space{Space::kMotor};
  Duration ack_timeout{std::chrono::milliseconds(20)};  ///< for the ACK, and again for the data after it
  int speed_percent{60};                                ///< 0..99; 100 % of the range is 90 units of the vendor
  int lost_after_timeouts{5};                           ///< consecutive ones that end the session
  Duration silence_limit{std::chrono::seconds(1)};      ///< streaming: no line for so long ends the session
  std::array<double, kMotors> min_rad{0.0, -1.4, 0.0};  ///< motor limits; targets are clamped to them
  std::array<double, kMotors> max_rad{1.1345, 1.4, 1.396};
  Transmission transmission;
  TelemetryConfig telemetry;
  /// The operator's standing word that the position counters are right even after the hand restarted. Off: after a
  /// restart nothing moves until MiaHand::confirm_calibration().
  bool motion_after_restart{false};
};

/// Errors: kInvalidArgument, a sentence that names the value.
[[nodiscard]] Status check(const MiaConfig& config) noexcept;

/// What happened on the line since the object was made.
struct MiaCounters {
  Counter commands;     ///< frames sent
  Counter acks;         ///< good ACKs
  Counter timeouts;     ///< ACK or data that did not come in time
  Counter retries;      ///< commands sent a second time
  Counter resyncs;      ///< times that the line was left alone until late answers had come
  Counter late_acks;    ///< ACKs that nobody waited for (any more)
  Counter mismatches;   ///< other lines that were not what was waited for
  Counter replies;      ///< position replies
  Counter implausible;  ///< position replies thrown away because the hand cannot have moved there
  Counter expired;      ///< queued motions dropped because their time had passed
  Counter stops;        ///< stop exchanges started
  Counter restarts;     ///< times that the hand was found to have restarted (its supply may have dropped)
};

}  // namespace embody::mia
