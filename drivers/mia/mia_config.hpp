#pragma once
// What can be set about a Mia hand, and what can be counted.
#include <optional>
#include <string>

#include "core/base/result.hpp"
#include "core/base/time.hpp"
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

/// What happened on the line since the object was made. To be read by the thread that calls read() and write().
struct MiaCounters {
  std::uint64_t commands{0};     ///< frames sent
  std::uint64_t acks{0};         ///< good ACKs
  std::uint64_t timeouts{0};     ///< ACK or data that did not come in time
  std::uint64_t retries{0};      ///< commands sent a second time
  std::uint64_t late_acks{0};    ///< ACKs that nobody waited for (any more)
  std::uint64_t mismatches{0};   ///< other lines that were not what was waited for
  std::uint64_t replies{0};      ///< position replies
  std::uint64_t implausible{0};  ///< position replies thrown away because the hand cannot have moved there
  std::uint64_t expired{0};      ///< queued motions dropped because their time had passed
  std::uint64_t stops{0};        ///< stop exchanges started
  std::uint64_t restarts{0};     ///< times that the hand was found to have restarted
};

}  // namespace embody::mia
