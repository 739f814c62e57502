#pragma once
// The simulated hand without its protocol: motors, sensors, counters, and a log of its motion. Time is an argument.
#include <optional>
#include <random>
#include <vector>

#include "drivers/mia/codec.hpp"
#include "drivers/mia/grasp_codec.hpp"
#include "drivers/sim/mia/mia_simulator.hpp"
#include "drivers/sim/mia/motor.hpp"

namespace embody::sim {

class MiaBody {
 public:
  MiaBody(const MiaSimulatorConfig& config, TimePoint now);

  void move_to(TimePoint now);
  /// Time of the last move_to().
  [[nodiscard]] TimePoint now() const noexcept { return now_; }

  /// Does what `request` asks of motors; true when it set one in motion. While the hand calibrates, nothing does.
  bool execute(const mia::Request& request);
  void halt() noexcept;
  /// Every motor to its share of the way between the references of a grasp.
  bool perform_grasp(const mia::Request& request);
  void set_references(const mia::Request& request, const mia::GraspReferences& references) noexcept;
  [[nodiscard]] mia::GraspReferences references(const mia::Request& request) const noexcept;
  void begin_calibration();
  /// The hand restarts: motors stand still, counters are zero.
  void restart() noexcept;
  [[nodiscard]] MiaMotor& motor(std::size_t i) noexcept { return motors_[i]; }

  /// The line that a channel (P S C A J j) has to say.
  [[nodiscard]] std::optional<mia::DataLine> data_line(char channel);

  [[nodiscard]] std::array<double, mia::kMotors> motor_counts() const noexcept;
  [[nodiscard]] std::array<double, mia::kMotors> joint_angles_rad() const noexcept;
  [[nodiscard]] std::vector<MiaSample> log() const;

 private:
  void record(TimePoint t);
  void integrate(TimePoint t) noexcept;
  [[nodiscard]] std::array<double, mia::kMotors> counters() const noexcept;
  [[nodiscard]] std::array<double, mia::kMotors> joint_speeds_rad_s() const noexcept;
  [[nodiscard]] std::array<int, mia::kMotors> currents() const noexcept;
  [[nodiscard]] std::array<int, mia::kStrainFields> strain();

  static constexpr std::size_t kGrasps = 8;
  MiaSimulatorConfig config_;
  std::array<MiaMotor, mia::kMotors> motors_;
  std::array<int, mia::kMotors> limit_percent_{50, 50, 50};  ///< of the current
  std::array<std::array<mia::GraspReferences, kGrasps>, mia::kMotors> references_{};
  TimePoint now_;
  TimePoint next_sample_;
  std::optional<TimePoint> calibrated_at_;
  std::mt19937_64 random_;
  std::vector<MiaSample> log_;
  std::size_t log_begin_{0};
};

}  // namespace embody::sim
