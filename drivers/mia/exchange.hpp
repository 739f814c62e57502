#pragma once
// The one command that is under way to an acknowledging hand: no I/O, no clock. Half duplex: the next command waits for
// the ACK of this one (and its data), for its time-out, or, after two time-outs, until the line is quiet.
#include "core/base/time.hpp"
#include "drivers/mia/codec.hpp"

namespace embody::mia {

/// What a command is for.
enum class Purpose : std::uint8_t { kMotion, kPositions, kJointPositions, kCurrents, kForces, kStopAll, kZeroSpeed };

struct Outgoing {
  Command command{};
  Purpose purpose{Purpose::kPositions};
  std::size_t motor{0};  ///< of kMotion and kZeroSpeed
  int value{0};          ///< of kMotion, in the unit of the wire
};

class Exchange {
 public:
  enum class Event : std::uint8_t {
    kNothing,       ///< keep waiting
    kAcknowledged,  ///< over: the ACK came, and no data follows it
    kData,          ///< over: this line is the data
    kTimedOut,      ///< over, unless retry() is called now
    kLateAck,       ///< this line is an ACK, but not ours (any more)
    kStranger,      ///< this line is something else
  };

  void start(const Outgoing& outgoing, TimePoint now, Duration timeout) noexcept;
  Event take_line(std::string_view line, TimePoint now) noexcept;
  /// A line and its time-out may come in one turn: lines first.
  Event take_time(TimePoint now) noexcept;

  /// After kTimedOut: the same command once more. False when it had its second chance already.
  bool retry(TimePoint now) noexcept;
  /// After kTimedOut: leaves the line alone until the answers that are owed have come, three time-outs at most. Without
  /// that, a late answer would be taken for that of the next, equal command.
  void resynchronise(TimePoint now) noexcept;
  /// Nothing is under way any more; late answers count as strangers.
  void abandon() noexcept { waiting_ = Waiting::kNothing; }

  [[nodiscard]] bool busy() const noexcept { return waiting_ != Waiting::kNothing; }
  [[nodiscard]] bool draining() const noexcept { return waiting_ == Waiting::kQuiet; }
  [[nodiscard]] TimePoint deadline() const noexcept { return deadline_; }
  [[nodiscard]] TimePoint t_sent() const noexcept { return t_sent_; }
  [[nodiscard]] const Outgoing& outgoing() const noexcept { return outgoing_; }
  /// How long after it was first sent the newest late answer to the command under way came; zero: none did.
  [[nodiscard]] Duration late_by() const noexcept { return late_by_; }

 private:
  enum class Waiting : std::uint8_t { kNothing, kAck, kData, kQuiet };
  [[nodiscard]] bool expects_data() const noexcept;
  [[nodiscard]] bool is_data(std::string_view line) const noexcept;

  Outgoing outgoing_;
  Waiting waiting_{Waiting::kNothing};
  Duration timeout_{0};
  TimePoint t_first_sent_{};
  TimePoint t_sent_{};
  TimePoint deadline_{};
  int tries_{0};
  int owed_{0};  ///< answers that may still come while draining
  Duration late_by_{0};
};

}  // namespace embody::mia
