#include "core/hand/marker_track.hpp"

#include <algorithm>
#include <cmath>

namespace embody::hand {
namespace {

using Eigen::Vector3d;

constexpr double kSpeedHorizonSeconds = 0.05;  // constant speed is a prediction for this long
constexpr double kSpeedShare = 0.5;            // of the newest difference in the smoothed speed
constexpr Duration kLongestTime = std::chrono::hours(1);
constexpr Duration kUsualTime = std::chrono::seconds(5);  // memory of the usual residual
constexpr std::uint32_t kMostFrames = 1U << 30;

double distance_to_segment(const Vector3d& p, const Vector3d& a, const Vector3d& ab) noexcept {
  const double length2 = ab.squaredNorm();
  const double s = length2 > 0.0 ? std::clamp((p - a).dot(ab) / length2, 0.0, 1.0) : 0.0;
  return (p - a - s * ab).norm();
}

}  // namespace

void MarkerTrack::advance(Duration dt, bool seen, const MarkerGuardConfig& config) noexcept {
  unseen_ = std::min(unseen_ + dt, kLongestTime);
  gap_ = seen ? absent_ : Duration{0};
  absent_ = seen ? Duration{0} : std::min(absent_ + dt, kLongestTime);
  if (!seen) candidate_ = Candidate{};
  if (known_ && unseen_ > config.forget && absent_ > config.forget) restart();
}

void MarkerTrack::shift(const Vector3d& d_M) noexcept {
  p_M_ += d_M;
  model_M_ += d_M;
}

void MarkerTrack::restart() noexcept {
  known_ = ghost_ = modelled_ = false;
  unexplained_ = 0;
  candidate_ = Candidate{};
}

double MarkerTrack::distance_m(const Vector3d& p_M) const noexcept {
  if (!known_) return HUGE_VAL;
  const Vector3d travel = std::min(to_seconds(unseen_), kSpeedHorizonSeconds) * v_M_;
  const double by_speed_m = distance_to_segment(p_M, p_M_, travel);
  if (!modelled_) return by_speed_m;
  return std::min(by_speed_m, (p_M - model_M_ - offset_m_).norm());
}

Vector3d MarkerTrack::predicted_M() const noexcept {
  return p_M_ + std::min(to_seconds(unseen_), kSpeedHorizonSeconds) * v_M_;
}

bool MarkerTrack::goes_on(const Vector3d& p_M, double gate_m, Duration dt) const noexcept {
  return candidate_.frames > 0 && distance_to_segment(p_M, candidate_.p_M, to_seconds(dt) * candidate_.v_M) <= gate_m;
}

bool MarkerTrack::reachable(const Vector3d& p_M) const noexcept {
  return (p_M - knuckle_M_).norm() <= reach_m_;  // false for what is not a number
}

void MarkerTrack::believe(const Vector3d& p_M, const MarkerGuardConfig& config) noexcept {
  const double dt_s = to_seconds(unseen_);
  if (known_ && dt_s > 0.0 && dt_s <= kSpeedHorizonSeconds) {
    v_M_ += kSpeedShare * ((p_M - p_M_) / dt_s - v_M_);
    const double speed_m_s = v_M_.norm();
    if (speed_m_s > config.speed_m_s) v_M_ *= config.speed_m_s / speed_m_s;
  } else {
    v_M_.setZero();
  }
  if (!known_) modelled_ = false;
  p_M_ = p_M;
  unseen_ = Duration{0};
  known_ = true;
  ghost_ = false;
  candidate_ = Candidate{};
}

void MarkerTrack::doubt(const Vector3d& p_M, double gate_m, Duration dt, const MarkerGuardConfig& config) noexcept {
  unexplained_ = 0;
  if (goes_on(p_M, gate_m, dt)) {
    const double dt_s = to_seconds(dt);
    candidate_.v_M += kSpeedShare * ((p_M - candidate_.p_M) / dt_s - candidate_.v_M);
    candidate_.frames = std::min(candidate_.frames + 1, kMostFrames);
    candidate_.age = std::min(candidate_.age + dt, kLongestTime);
  } else {
    const bool doubted_before = candidate_.frames > 0;
    const bool lost_before = gap_ > Duration{0} || ghost_;
    candidate_ = Candidate{};
    candidate_.frames = 1;
    candidate_.needed = config.lasting;
    if (distance_m(p_M) <= gate_m + config.speed_m_s * to_seconds(unseen_)) {
      if (doubted_before) candidate_.needed = config.back_again;
      if (lost_before) candidate_.needed = config.returned;
    }
    ghost_ = false;
  }
  candidate_.p_M = p_M;
  ghost_ |= candidate_.frames >= config.ghost_frames && !reachable(p_M);
}

bool MarkerTrack::asks() const noexcept {
  return candidate_.frames > 0 && candidate_.age >= candidate_.needed && reachable(candidate_.p_M);
}

void MarkerTrack::answer(double residual_m, double usual_m, const MarkerGuardConfig& config) noexcept {
  ghost_ = !(residual_m <= usual_m + config.explained_m);
  if (ghost_) {  // the other markers of the finger move on: ask again later
    candidate_.needed = candidate_.age + std::max(candidate_.needed, config.ask_again);
    return;
  }
  p_M_ = candidate_.p_M;
  v_M_ = candidate_.v_M;
  unseen_ = Duration{0};
  known_ = true;
  modelled_ = false;  // the model's motion since is no guide to the new place
}

void MarkerTrack::explain(const Vector3d& model_M, Duration dt, const MarkerGuardConfig& config) noexcept {
  model_M_ = model_M;
  if (!believed()) return;
  modelled_ = true;
  offset_m_ = p_M_ - model_M;
  residual_m_ = offset_m_.norm();
  if (explained_ > Duration{0} && residual_m_ > usual_m_ + config.dropped_m) {
    unexplained_ = std::min(unexplained_ + 1, kMostFrames);
    return;
  }
  unexplained_ = 0;
  explained_ = std::min(explained_ + dt, kUsualTime);
  const double share = std::min(1.0, to_seconds(dt) / to_seconds(explained_));
  usual_m_ += share * (std::min(residual_m_, config.dropped_m) - usual_m_);
}

void MarkerTrack::drop(const MarkerGuardConfig& config) noexcept {
  ghost_ = true;
  unexplained_ = 0;
  candidate_ = Candidate{};
  candidate_.p_M = p_M_;
  candidate_.frames = 1;
  candidate_.needed = config.lasting;
  p_M_ = model_M_;
  v_M_.setZero();
  offset_m_.setZero();
}

}  // namespace embody::hand
