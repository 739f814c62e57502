#include "drivers/mia/motion_watch.hpp"

#include <algorithm>
#include <cmath>

namespace embody::mia {
namespace {

// 90 units of the vendor are full speed; counts per second and unit from its reductions (65.4167 rad/s at the motor).
constexpr std::array<double, kMotors> kFullSpeed_counts_s{90.0 * 65.4167 / 11.3895, 90.0 * 65.4167 / 8.673,
                                                          90.0 * 65.4167 / 7.0074};
constexpr double kSpeedMargin = 2.0;
constexpr double kSlack_counts = 15.0;  ///< noise, play, and the age of a reading
constexpr double kCoast_s = 0.05;       ///< a motor that is called back goes on for so long
constexpr double kZero_counts = 5.0;    ///< in joint space a zeroed counter is only known to some counts
constexpr double kOffZero_counts = 10.0;
constexpr double kSteady_counts = 1.0;
constexpr int kPatience = 3;

bool near(const std::array<double, kMotors>& a, const std::array<double, kMotors>& b, double tolerance) noexcept {
  return std::equal(a.begin(), a.end(), b.begin(), [=](double x, double y) { return std::abs(x - y) <= tolerance; });
}

}  // namespace

MotionWatch::MotionWatch(int speed_percent) noexcept : speed_percent_(speed_percent) {}

bool MotionWatch::begin(const std::array<double, kMotors>& counts, TimePoint now) noexcept {
  const bool restarted = known_ && zeroed(counts, now - t_last_);
  known_ = true;
  courses_ = {};
  implausible_in_a_row_ = 0;
  last_ = reference_ = counts;
  t_last_ = t_reference_ = now;
  return restarted;
}

void MotionWatch::told(std::size_t motor, double counts) noexcept {
  MotorCourse& course = courses_[motor];
  const bool under_way = course.course == Course::kToTarget || course.course == Course::kStopping;
  course = {Course::kToTarget, counts, under_way ? std::min(course.least, counts) : counts,
            under_way ? std::max(course.most, counts) : counts};
}

void MotionWatch::told_to_stop() noexcept {
  // Until the next reading it may be anywhere on the way to the target.
  for (MotorCourse& course : courses_) {
    const bool under_way = course.course == Course::kToTarget || course.course == Course::kStopping;
    course.course = under_way ? Course::kStopping : Course::kStopped;
  }
}

MotionWatch::Verdict MotionWatch::take(const std::array<double, kMotors>& counts, TimePoint now) noexcept {
  // Broken digits do not come twice alike.
  const bool repeated = implausible_in_a_row_ > 0 && near(counts, doubtful_, kSlack_counts);
  if (!repeated && plausible(counts, now - t_last_) && !zeroed(counts, now - t_last_)) {
    accept(counts, now);
    return Verdict::kPlausible;
  }
  doubtful_ = counts;
  return ++implausible_in_a_row_ >= kPatience || repeated ? Verdict::kRestarted : Verdict::kImplausible;
}

void MotionWatch::accept(const std::array<double, kMotors>& counts, TimePoint now) noexcept {
  implausible_in_a_row_ = 0;
  last_ = counts;
  t_last_ = now;
  for (MotorCourse& course : courses_) {
    course.least = course.most = course.target;
    if (course.course == Course::kStopping) course.course = Course::kStopped;
  }
  if (!near(counts, reference_, kSteady_counts)) {
    reference_ = counts;
    t_reference_ = now;
    return;
  }
  if (!still()) return;
  for (MotorCourse& course : courses_) {  // what an earlier host had begun is over
    if (course.course == Course::kUnknown) course.course = Course::kStopped;
  }
}

/// Outside of the way from the last reading to the targets since then by more than `slack`.
bool MotionWatch::off_course(std::size_t motor, double counts, double slack) const noexcept {
  const MotorCourse& course = courses_[motor];
  const double here = last_[motor];
  if (course.course == Course::kUnknown) return false;
  if (course.course == Course::kStopped) return std::abs(counts - here) > slack;
  return counts < std::min(here, course.least) - slack || counts > std::max(here, course.most) + slack;
}

bool MotionWatch::plausible(const std::array<double, kMotors>& counts, Duration elapsed) const noexcept {
  for (std::size_t i = 0; i < kMotors; ++i) {
    const double speed = 0.01 * speed_percent_ * kFullSpeed_counts_s[i];
    const double reach = courses_[i].course == Course::kUnknown ? kFullSpeed_counts_s[i] : speed;
    if (std::abs(counts[i] - last_[i]) > kSpeedMargin * reach * to_seconds(elapsed) + kSlack_counts) return false;
    if (off_course(i, counts[i], kSlack_counts + speed * kCoast_s)) return false;
  }
  return true;
}

/// All counters at zero at once, although a motor was elsewhere and had no business there, or was too far away.
bool MotionWatch::zeroed(const std::array<double, kMotors>& counts, Duration elapsed) const noexcept {
  if (!near(counts, {}, kZero_counts)) return false;
  for (std::size_t i = 0; i < kMotors; ++i) {
    if (std::abs(last_[i]) <= kOffZero_counts) continue;
    const double farthest = kFullSpeed_counts_s[i] * to_seconds(elapsed) + kSlack_counts;
    if (courses_[i].course == Course::kUnknown ? std::abs(last_[i]) > farthest : off_course(i, 0.0, kOffZero_counts)) {
      return true;
    }
  }
  return false;
}

}  // namespace embody::mia
