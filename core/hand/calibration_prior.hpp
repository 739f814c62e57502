#pragma once
// What anatomy says about finger angles before any marker was seen, as beliefs about directions in angle space: the
// recording has a habit (the mean of that direction, known within `habit_sd_rad`), single frames are spread about it,
// and joints have soft ranges. The calibration's nuisance angles lean on this where markers say nothing (twist, the
// share of the end joint). Without habits, hundreds of frames would multiply a guess about the mean posture into
// certainty.
#include "core/base/static_vector.hpp"
#include "core/hand/hand_model.hpp"

namespace embody::hand {

inline constexpr std::size_t kAngleBeliefs = 10;
using Habit = Eigen::Matrix<double, static_cast<int>(kAngleBeliefs), 1>;  ///< rad, one per belief

/// direction . q ~ N(habit, spread^2), habit ~ N(mean, habit_sd^2); outside of lower..upper a soft stop pushes back.
struct AngleBelief {
  Vector9 direction{Vector9::Zero()};
  double mean_rad{0.0};
  double habit_sd_rad{1.0};
  double spread_rad{1.0};
  double lower_rad{-1e9};
  double upper_rad{1e9};
  bool voluntary{false};  ///< how far people move there is their choice: `spread_rad` is only a first guess
};

class AnglePrior {
 public:
  /// Gradient and Gauss-Newton matrices of half the cost.
  struct Model {
    Vector9 gradient;
    Matrix9 hessian;
    Matrix9 smooth_hessian;                                              // without soft stops
    Eigen::Matrix<double, 9, static_cast<int>(kAngleBeliefs)> coupling;  // angles with habits
    Habit habit_gradient;
    Habit habit_hessian;  // a diagonal
  };

  /// Of a right hand's finger; a left hand's is its mirror image. Sources: Kapandji 2007 (ranges), Buchholz et al. 1992
  /// (axes), Rijpkema & Girard 1991 (end joint = 2/3 of the middle joint).
  AnglePrior(Finger finger, Side side) noexcept;

  /// Minus two times the log density of the angles given the habit, without its constant.
  [[nodiscard]] double cost(const Vector9& q_rad, const Habit& habit_rad) const noexcept;
  [[nodiscard]] Model linearise(const Vector9& q_rad, const Habit& habit_rad) const noexcept;
  [[nodiscard]] const Habit& habit_mean_rad() const noexcept { return habit_mean_rad_; }
  [[nodiscard]] const Habit& habit_sd_rad() const noexcept { return habit_sd_rad_; }
  /// Angles of which every belief about an axis of a joint says its habit.
  [[nodiscard]] Vector9 angles(const Habit& habit_rad) const noexcept;
  /// Flexion of the whole finger, summed over its joints, and sideways motion of its first joint.
  [[nodiscard]] double flexion_rad(const Vector9& q_rad) const noexcept;
  [[nodiscard]] double abduction_rad(const Vector9& q_rad) const noexcept { return beliefs_[1].direction.dot(q_rad); }
  void set_spread(std::size_t belief, double spread_rad) noexcept { beliefs_[belief].spread_rad = spread_rad; }
  /// Three axes for each joint (the first flexes, the second goes sideways), then the coupling; the thumb has none.
  [[nodiscard]] const StaticVector<AngleBelief, kAngleBeliefs>& beliefs() const noexcept { return beliefs_; }

 private:
  void add_belief(const AngleBelief& belief) noexcept;
  void add_joint(std::size_t joint, const Eigen::Vector3d& axis, const AngleBelief& belief) noexcept;

  StaticVector<AngleBelief, kAngleBeliefs> beliefs_;
  Habit habit_mean_rad_{Habit::Zero()};
  Habit habit_sd_rad_{Habit::Ones()};
};

}  // namespace embody::hand
