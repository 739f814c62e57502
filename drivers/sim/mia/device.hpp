#pragma once
// What a Mia hand does with the bytes it gets: no thread, no file, no clock. Time is an argument.
#include <deque>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/sim/mia/body.hpp"

namespace embody::sim {

/// Time never runs backwards: an earlier `now` counts as the latest one seen.
class MiaDevice {
 public:
  MiaDevice(const MiaSimulatorConfig& config, TimePoint now);

  using Byte = char;  ///< of receive()

  /// Takes bytes of the host that arrived at `now`.
  void receive(std::span<const char> bytes, TimePoint now);
  /// Moves on to `now`; returns what the hand has to say until then.
  std::string advance(TimePoint now);
  /// Moves on to `now` and says nothing: what falls due meanwhile is said by the next advance().
  void move_to(TimePoint now);
  /// When advance() will next have something to say; nothing: not before the host speaks.
  [[nodiscard]] std::optional<TimePoint> next_event() const noexcept;
  /// The host has gone: half a frame and replies under way are forgotten; motion and streams go on.
  void forget_host() noexcept;

  [[nodiscard]] std::array<double, mia::kMotors> motor_counts() const noexcept { return body_.motor_counts(); }
  [[nodiscard]] std::array<double, mia::kMotors> joint_angles_rad() const noexcept { return body_.joint_angles_rad(); }
  [[nodiscard]] std::vector<MiaSample> log() const { return body_.log(); }
  [[nodiscard]] MiaSimulatorCounters counters() const noexcept;

  void mute(bool on) noexcept { faults_.mute = on; }
  void drop_next(unsigned n) noexcept { faults_.drop = n; }
  void garble_next(unsigned n) noexcept { faults_.garble = n; }
  /// The hand restarts: deaf and mute for a while, streams off, motors standing, counters zero.
  void restart(TimePoint now);
  /// One fault by name: "drop n" and "garble n" (lines), "drop_ack n", "echo_wrong n" (ACK of another command),
  /// "deaf n" (commands not heard), "rubbish n" (bytes), "delay ms", "jitter ms", "mute on|off", "half_duplex on|off",
  /// "reboot", "streams off", "undervoltage on|off" (restarts whenever a motor is to move), "stall MOTOR on|off",
  /// "contact MOTOR counts|off", with MOTOR thumb, index or mrl. Errors: kInvalidArgument.
  Status fault(std::string_view text, TimePoint now);

 private:
  struct Pending {
    TimePoint due{};
    mia::Command command{};
  };
  struct Faults {
    bool mute{false};
    bool undervoltage{false};
    unsigned drop{0};
    unsigned drop_ack{0};
    unsigned garble{0};
    unsigned echo_wrong{0};
    unsigned deaf{0};
    unsigned rubbish{0};
  };

  [[nodiscard]] bool knows(mia::Request::Kind kind, char first) const noexcept;
  void execute(const mia::Command& command, const mia::Request& request);
  void switch_stream(char channel, bool on) noexcept;
  void answer(const mia::Command& command, std::string& out);
  bool say(std::string_view line, std::string& out);
  [[nodiscard]] Duration delay();
  Status set_motor_fault(std::string_view name, std::string_view motor, std::string_view value);

  MiaSimulatorConfig config_;
  MiaBody body_;
  mia::CommandAssembler commands_;
  std::deque<Pending> pending_;
  TimePoint next_stream_;
  TimePoint booted_at_;
  std::string streams_;  ///< channels that are on
  std::mt19937_64 random_;
  MiaSimulatorCounters counters_;
  Faults faults_;
};

}  // namespace embody::sim
