#include "core/hand/calibration_prior.hpp"

#include <algorithm>

namespace embody::hand {
namespace {

using Eigen::Index;
using Eigen::Vector3d;

constexpr double kSoftStopRad = 0.1;  // spread between people of where a joint's range ends
constexpr double kCouplingRatio = 2.0 / 3.0;

/// An axis that people do not move at will: what it does comes from the build of the joint.
AngleBelief passive(double habit_sd, double spread) noexcept {
  AngleBelief belief;
  belief.habit_sd_rad = habit_sd;
  belief.spread_rad = spread;
  return belief;
}

AngleBelief voluntary(double mean, double habit_sd, double spread, double lower, double upper) noexcept {
  return {Vector9::Zero(), mean, habit_sd, spread, lower, upper, true};
}

}  // namespace

AnglePrior::AnglePrior(Finger finger, Side side) noexcept {
  if (finger == Finger::kThumb) {
    // Along the thumb, its nail's normal, and the axis of flexion, in the flat hand.
    const Vector3d along = Vector3d(-.80, -.25, .54).normalized();
    const Vector3d flexion = Vector3d(.25, .65, .70).cross(along).normalized();
    const Vector3d nail = along.cross(flexion);
    add_joint(0, flexion, voluntary(.10, .12, .35, -1.2, 1.2));
    add_joint(0, nail, voluntary(.0, .12, .35, -1.2, 1.2));
    add_joint(0, along, passive(.05, .08));
    add_joint(1, flexion, voluntary(.20, .10, .35, -.4, 1.2));
    add_joint(1, nail, passive(.03, .05));
    add_joint(1, along, passive(.03, .03));
    add_joint(2, flexion, voluntary(.30, .10, .40, -.5, 1.5));
    add_joint(2, nail, passive(.03, .03));
    add_joint(2, along, passive(.03, .03));
  } else {
    const Vector3d x = Vector3d::UnitX(), y = Vector3d::UnitY(), z = Vector3d::UnitZ();
    add_joint(0, z, voluntary(.40, .40, .50, -.5, 1.75));
    add_joint(0, y, voluntary(.0, .10, .15, -.6, .6));
    add_joint(0, x, passive(.03, .03));
    add_joint(1, z, voluntary(.40, .40, .50, -.1, 2.0));
    add_joint(1, y, passive(.03, .03));
    add_joint(1, x, passive(.03, .03));
    AngleBelief end = voluntary(.30, 1.0, 2.0, -.15, 1.6);
    end.voluntary = false;  // it follows the middle joint, below
    add_joint(2, z, end);
    add_joint(2, y, passive(.03, .03));
    add_joint(2, x, passive(.03, .03));
    AngleBelief coupling = passive(.05, .08);
    coupling.direction(8) = 1.0;
    coupling.direction(5) = -kCouplingRatio;
    add_belief(coupling);
  }
  if (side == Side::kLeft) {
    for (AngleBelief& belief : beliefs_) mirror_angles(belief.direction);
  }
}

void AnglePrior::add_belief(const AngleBelief& belief) noexcept {
  habit_mean_rad_(static_cast<Index>(beliefs_.size())) = belief.mean_rad;
  habit_sd_rad_(static_cast<Index>(beliefs_.size())) = belief.habit_sd_rad;
  beliefs_.push_back(belief);
}

void AnglePrior::add_joint(std::size_t joint, const Vector3d& axis, const AngleBelief& belief) noexcept {
  AngleBelief about = belief;
  about.direction.segment<3>(3 * static_cast<Index>(joint)) = axis;
  add_belief(about);
}

double AnglePrior::flexion_rad(const Vector9& q_rad) const noexcept {
  double sum = 0.0;
  for (const std::size_t joint : {0U, 1U, 2U}) sum += beliefs_[3 * joint].direction.dot(q_rad);
  return sum;
}

Vector9 AnglePrior::angles(const Habit& habit_rad) const noexcept {
  Vector9 q = Vector9::Zero();
  for (Index i = 0; i < 9; ++i) q += habit_rad(i) * beliefs_[static_cast<std::size_t>(i)].direction;
  return q;
}

double AnglePrior::cost(const Vector9& q_rad, const Habit& habit_rad) const noexcept {
  double cost = 0.0;
  for (std::size_t i = 0; i < beliefs_.size(); ++i) {
    const AngleBelief& belief = beliefs_[i];
    const double angle = belief.direction.dot(q_rad);
    const double off = (angle - habit_rad(static_cast<Index>(i))) / belief.spread_rad;
    const double beyond = (angle - std::clamp(angle, belief.lower_rad, belief.upper_rad)) / kSoftStopRad;
    cost += off * off + beyond * beyond;
  }
  return cost;
}

AnglePrior::Model AnglePrior::linearise(const Vector9& q_rad, const Habit& habit_rad) const noexcept {
  Model model;
  model.gradient.setZero();
  model.hessian.setZero();
  model.smooth_hessian.setZero();
  model.coupling.setZero();
  model.habit_gradient.setZero();
  model.habit_hessian.setZero();
  for (std::size_t i = 0; i < beliefs_.size(); ++i) {
    const auto row = static_cast<Index>(i);
    const AngleBelief& belief = beliefs_[i];
    const double angle = belief.direction.dot(q_rad);
    const double weight = 1.0 / (belief.spread_rad * belief.spread_rad);
    const double slope = weight * (angle - habit_rad(row));
    const double beyond = angle - std::clamp(angle, belief.lower_rad, belief.upper_rad);
    const double stop = beyond == 0.0 ? 0.0 : 1.0 / (kSoftStopRad * kSoftStopRad);
    model.gradient += (slope + stop * beyond) * belief.direction;
    const Matrix9 square = belief.direction * belief.direction.transpose();
    model.hessian += (weight + stop) * square;
    model.smooth_hessian += weight * square;
    model.coupling.col(row) = -weight * belief.direction;
    model.habit_gradient(row) = -slope;
    model.habit_hessian(row) = weight;
  }
  return model;
}

}  // namespace embody::hand
