#include "core/hand/hand_state_filter.hpp"

#include <algorithm>

namespace embody::hand {
namespace {

// Speeds as parts of `motion_rad_s`.
constexpr double kRest = 1.0 / 3.0;       // up to here: lag_at_rest, no prediction
constexpr double kPredicted = 2.0 / 3.0;  // from here on: the whole prediction

/// 0 up to `from`, 1 from `to` on, linear between.
double ramp(double value, double from, double to) noexcept {
  if (value >= to) return 1.0;
  return value <= from ? 0.0 : (value - from) / (to - from);
}

Eigen::Index offset(std::size_t finger) noexcept {
  return static_cast<Eigen::Index>(kFingerOffset[finger]);
}

/// Rotation-vector speed of the fastest joint; equals its turning speed while the joint keeps its axis.
double fastest(const Vector9& qd_rad_s) noexcept {
  return std::max({qd_rad_s.head<3>().norm(), qd_rad_s.segment<3>(3).norm(), qd_rad_s.tail<3>().norm()});
}

}  // namespace

HandStateFilter::HandStateFilter(const HandModel& model, const HandStateFilterConfig& config) noexcept
    : model_(model), config_(config) {
  config_.lag_at_rest = std::max(config.lag_at_rest, Duration{0});
  config_.lag_in_motion = std::clamp(config.lag_in_motion, Duration{0}, config_.lag_at_rest);
  config_.motion_rad_s = std::max(config.motion_rad_s, 0.0);
  config_.predict = std::max(config.predict, Duration{0});
  config_.predict_limit_rad = std::max(config.predict_limit_rad, 0.0);
  off_ = config_.lag_at_rest == Duration{0} && config_.predict == Duration{0};
}

void HandStateFilter::step(HandState& state) noexcept {
  if (off_) return;
  const bool usable = state.valid && state.q_rad.allFinite();
  const Duration dt = state.t_capture - t_last_;
  if (!usable || !started_ || dt > kLongestGap || dt < -kLongestGap) {
    restart(state);
    started_ = usable;
    return;
  }
  if (dt > Duration{0}) t_last_ = state.t_capture;
  for (std::size_t f = 0; f < kFingers; ++f) {
    auto q_rad = state.q_rad.segment<static_cast<int>(kFingerAngles)>(offset(f));
    if (dt > Duration{0}) advance(tracks_[f], q_rad, to_seconds(dt), lag_[f]);
    q_rad = tracks_[f].q_out_rad;
    const auto finger = static_cast<Finger>(f);
    const FingerChain chain = model_.chain(finger, tracks_[f].q_out_rad);
    state.p_M[f] = {model_.point(finger, 0, chain), model_.point(finger, 1, chain)};
    state.distal_M[f] = model_.distal(finger, chain);
  }
}

void HandStateFilter::restart(const HandState& state) noexcept {
  t_last_ = state.t_capture;
  lag_.fill(Duration{0});
  for (std::size_t f = 0; f < kFingers; ++f) {
    Track& track = tracks_[f];
    track.q_measured_rad = state.q_rad.segment<static_cast<int>(kFingerAngles)>(offset(f));
    track.q_rad = track.q_out_rad = track.q_measured_rad;
    track.qd_rad_s.fill(Vector9::Zero());
  }
}

/// lag_at_rest, lag_in_motion, and between them the lag whose inverse is linear in the speed.
double HandStateFilter::lag_s(double speed_rad_s) const noexcept {
  constexpr double kLeast_s = 1e-3;  // stands for zero on the way there
  const double rest_s = to_seconds(config_.lag_at_rest);
  const double motion_s = to_seconds(config_.lag_in_motion);
  const double part = ramp(speed_rad_s, kRest * config_.motion_rad_s, config_.motion_rad_s);
  if (part == 0.0) return rest_s;
  if (part == 1.0) return motion_s;
  const double a = std::max(rest_s, kLeast_s);
  const double b = std::max(motion_s, kLeast_s);
  return a * b / (part * a + (1.0 - part) * b);
}

void HandStateFilter::advance(Track& track, const Vector9& q_rad, double dt_s, Duration& lag) const noexcept {
  // Exponential filters with gain dt / (lag + dt). The first stage never forms the quotient (change of q) / dt.
  const double speed_lag_s = to_seconds(kSpeedLag);
  Vector9 change = q_rad - track.q_measured_rad;
  for (Vector9& qd_rad_s : track.qd_rad_s) {
    qd_rad_s = (speed_lag_s * qd_rad_s + change) / (speed_lag_s + dt_s);
    change = dt_s * qd_rad_s;
  }
  track.q_measured_rad = q_rad;
  const double speed_rad_s = fastest(track.qd_rad_s.back());
  const double filter_s = lag_s(speed_rad_s);
  track.q_rad = (filter_s * track.q_rad + dt_s * q_rad) / (filter_s + dt_s);

  const double predict_s =
      ramp(speed_rad_s, kRest * config_.motion_rad_s, kPredicted * config_.motion_rad_s) * to_seconds(config_.predict);
  track.q_out_rad = track.q_rad;
  for (Eigen::Index i = 0; predict_s > 0.0 && i < 9; i += 3) {
    const Eigen::Vector3d turn = predict_s * track.qd_rad_s.front().segment<3>(i);
    const double angle_rad = turn.norm();
    const double scale = angle_rad > config_.predict_limit_rad ? config_.predict_limit_rad / angle_rad : 1.0;
    track.q_out_rad.segment<3>(i) += scale * turn;
  }
  lag = from_seconds(filter_s - predict_s);
}

}  // namespace embody::hand
