#pragma once
// A Mia hand that exists only as a pseudo-terminal: speaks the real bytes, moves with a first-order lag.
#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.hpp"
#include "core/base/time.hpp"
#include "drivers/mia/mia_config.hpp"

namespace embody::sim {

struct MiaSimulatorConfig {
  std::string link;                                             ///< path of a symlink to the device; empty: none
  mia::Generation generation{mia::Generation::kAcknowledging};  ///< which commands and replies it knows
  Duration ack_delay{std::chrono::milliseconds(2)};
  Duration ack_jitter{0};  ///< added to the delay, uniform from zero
  double lag_s{0.04};
  bool half_duplex{true};  ///< a command that comes before the ACK of the last one is dropped and counted
  bool acks_all{true};     ///< acknowledges every frame, known or not; off: a streaming hand acknowledges nothing
  double stream_hz{50.0};  ///< of each data stream that the host switches on
  std::array<double, mia::kMotors> start_counts{0.0, 0.0, 0.0};  ///< thumb, index, MRL
  /// Where closing meets an object.
  std::array<double, mia::kMotors> contact_counts{std::numeric_limits<double>::infinity(),
                                                  std::numeric_limits<double>::infinity(),
                                                  std::numeric_limits<double>::infinity()};
  double strain_noise{4.5};                            ///< standard deviation, raw units
  Duration boot_time{std::chrono::milliseconds(200)};  ///< deaf and mute after a restart
  Duration calibration_time{std::chrono::milliseconds(2000)};
  std::uint64_t seed{1};
  std::size_t log_capacity{60'000};  ///< samples; the newest are kept (100 per second)
  mia::Transmission transmission;    ///< for the joint angles of the log
};

/// A hand with the firmware of the vendor's ROS 1 driver: streams, no readings on request, no stop command.
[[nodiscard]] inline MiaSimulatorConfig older_mia() {
  MiaSimulatorConfig config;
  config.generation = mia::Generation::kStreaming;
  config.half_duplex = false;
  return config;
}

/// One line of the motion log.
struct MiaSample {
  TimePoint t{};
  std::array<double, mia::kMotors> q_rad{};  ///< j_thumb_fle, j_index_fle, j_mrl_fle
};

struct MiaSimulatorCounters {
  std::uint64_t commands{0};          ///< complete frames received
  std::uint64_t motions{0};           ///< of these: position and speed commands (zero speed is not a motion)
  std::uint64_t reads{0};             ///< of these: one-shot reads
  std::uint64_t stops{0};             ///< of these: stop all
  std::uint64_t unknown{0};           ///< of these: acknowledged without effect (pings are among them)
  std::uint64_t dropped_as_early{0};  ///< came before the ACK of the last one
  std::uint64_t skipped_bytes{0};     ///< rubbish between frames
  std::uint64_t acks{0};              ///< sent, garbled ones included
  std::uint64_t grasps{0};            ///< of commands: automatic grasps and their references
  std::uint64_t calibrations{0};      ///< of commands
  std::uint64_t stores{0};            ///< of commands: writes to the EEPROM
  std::uint64_t restarts{0};
};

/// One thread between start() and stop(). Every function may be called from any thread, but start() and stop() only
/// from one. As on the device, a position command is finished even if the host has gone.
class MiaSimulator {
 public:
  explicit MiaSimulator(const MiaSimulatorConfig& config);
  ~MiaSimulator();  ///< stop()
  MiaSimulator(const MiaSimulator&) = delete;
  MiaSimulator& operator=(const MiaSimulator&) = delete;

  /// Creates the pseudo-terminal and the symlink. After unplug() it plugs the hand in again, at the pose it has.
  /// Errors: kRefused (something other than a symlink is at `link`), kInvalidArgument, kIo.
  Status start();
  /// Ends the thread, closes the device and removes the symlink if it is still ours.
  void stop() noexcept;
  /// Path of the device ("/dev/pts/N"); empty before start().
  [[nodiscard]] std::string device() const;

  [[nodiscard]] MiaSimulatorCounters counters() const;
  [[nodiscard]] std::array<double, mia::kMotors> motor_counts() const;  ///< where the motors are
  [[nodiscard]] std::array<double, mia::kMotors> joint_angles_rad() const;
  [[nodiscard]] std::vector<MiaSample> log() const;  ///< oldest first

  // Faults.
  void mute(bool on);            ///< obeys, but sends nothing
  void drop_next(unsigned n);    ///< the next n lines are not sent
  void garble_next(unsigned n);  ///< the next n lines are sent with '#' in place of everything but first byte and LF
  void unplug();                 ///< the host sees a hang-up; returns when that is so
  /// By name: "unplug", "plug", and those of MiaDevice::fault(). Errors: kInvalidArgument, with the names that exist.
  Status fault(std::string_view text);

 private:
  class Device;
  std::unique_ptr<Device> device_;
};

/// The faults by name, for people. One line each: its words, blanks up to column 32, what it does.
[[nodiscard]] std::string mia_fault_help();

}  // namespace embody::sim
