#include "drivers/mia/exchange.hpp"

namespace embody::mia {
namespace {

constexpr int kTries = 2;
constexpr int kQuietTimeouts = 3;

}  // namespace

void Exchange::start(const Outgoing& outgoing, TimePoint now, Duration timeout) noexcept {
  outgoing_ = outgoing;
  timeout_ = timeout;
  waiting_ = Waiting::kAck;
  t_first_sent_ = t_sent_ = now;
  deadline_ = now + timeout;
  tries_ = 1;
  owed_ = 0;
}

Exchange::Event Exchange::take_line(std::string_view line, TimePoint now) noexcept {
  if (waiting_ == Waiting::kData && is_data(line)) {
    waiting_ = Waiting::kNothing;
    late_by_ = Duration::zero();
    return Event::kData;
  }
  if (!is_acknowledgement(line)) return Event::kStranger;
  const bool ours = acknowledges(line, outgoing_.command);
  if (waiting_ == Waiting::kQuiet && ours) {
    late_by_ = now - t_first_sent_;
    if (--owed_ == 0) waiting_ = Waiting::kNothing;
  }
  if (waiting_ != Waiting::kAck || !ours) return Event::kLateAck;
  if (expects_data()) {
    waiting_ = Waiting::kData;
    deadline_ = now + timeout_;
    return Event::kNothing;
  }
  waiting_ = Waiting::kNothing;
  late_by_ = Duration::zero();
  return Event::kAcknowledged;
}

Exchange::Event Exchange::take_time(TimePoint now) noexcept {
  if (waiting_ == Waiting::kNothing || now < deadline_) return Event::kNothing;
  const bool was_draining = draining();
  waiting_ = Waiting::kNothing;
  return was_draining ? Event::kNothing : Event::kTimedOut;
}

bool Exchange::retry(TimePoint now) noexcept {
  if (tries_ >= kTries) return false;
  ++tries_;
  waiting_ = Waiting::kAck;
  t_sent_ = now;
  deadline_ = now + timeout_;
  return true;
}

void Exchange::resynchronise(TimePoint now) noexcept {
  owed_ = tries_;
  waiting_ = Waiting::kQuiet;
  deadline_ = now + kQuietTimeouts * timeout_;
}

bool Exchange::expects_data() const noexcept {
  switch (outgoing_.purpose) {
    case Purpose::kPositions:
    case Purpose::kJointPositions:
    case Purpose::kCurrents:
    case Purpose::kForces:
      return true;
    case Purpose::kMotion:
    case Purpose::kStopAll:
    case Purpose::kZeroSpeed:
      return false;
  }
  return false;
}

bool Exchange::is_data(std::string_view line) const noexcept {
  switch (outgoing_.purpose) {
    case Purpose::kPositions:
      return parse_triple(line, TripleLine::kPosition).has_value();
    case Purpose::kJointPositions:
      return parse_joint_positions(line).has_value();
    case Purpose::kCurrents:
      return parse_triple(line, TripleLine::kCurrent).has_value();
    case Purpose::kForces:
      return parse_strain_gauges(line).has_value();
    default:
      return false;
  }
}

}  // namespace embody::mia
