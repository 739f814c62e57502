#pragma once
// Motor currents and fingertip forces of a Mia hand: raw numbers of its converters, nobody documents their units.
#include <array>
#include <cstdint>
#include <string_view>

#include "core/base/result.hpp"
#include "core/base/time.hpp"
#include "core/hal/hand_telemetry.hpp"
#include "drivers/mia/codec.hpp"

namespace embody::mia {

/// Which strain gauge a field of the 'a' line is. Thumb, index and middle finger have two each, ring and little none.
enum class StrainField : std::uint8_t {
  kUnused,
  kThumbNormal,
  kThumbTangential,
  kIndexNormal,
  kIndexTangential,
  kMrlNormal,
  kMrlTangential,
};

struct TelemetryConfig {
  /// Ask for one reading, currents and forces in turn, in so many write()s; 0: never. At 20 Hz, four make 5 readings a
  /// second: 4 % of the acknowledging firmware's line. Streaming firmware: 0 or not 0, the hand has its own pace.
  unsigned every_cycles{4};
  bool currents{true};
  bool forces{true};
  /// Order of the wire. The default is that of the vendor's ROS 2 driver; the ROS 1 driver names normal and tangential
  /// the other way round. Not checked on hardware.
  std::array<StrainField, kStrainFields> strain_fields{StrainField::kMrlTangential,   StrainField::kIndexNormal,
                                                       StrainField::kIndexTangential, StrainField::kThumbTangential,
                                                       StrainField::kThumbNormal,     StrainField::kMrlNormal,
                                                       StrainField::kUnused,          StrainField::kUnused};
  std::array<int, kStrainFields> strain_offset{};  ///< raw, order of the wire; tare() replaces them
};

/// Every sensor at most once, all six named. Errors: kInvalidArgument.
[[nodiscard]] Status check(const TelemetryConfig& config) noexcept;

struct FingerForce {
  int normal{0};
  int tangential{0};
};

struct MiaTelemetry {
  std::uint64_t current_samples{0};          ///< counts readings of this connection
  std::uint64_t force_samples{0};            ///< the same
  TimePoint t_currents{};                    ///< arrival
  TimePoint t_forces{};                      ///< arrival
  std::array<int, kMotors> current{};        ///< 0..1024, order of Motor
  std::array<int, kStrainFields> strain{};   ///< raw, order of the wire
  std::array<FingerForce, kMotors> force{};  ///< less the offsets, order of Motor (MRL: the middle finger has them)
  std::array<int, kStrainFields> offset{};   ///< what is taken off
  std::uint64_t tares{0};                    ///< completed ones
};

using Forces = std::array<FingerForce, kMotors>;
/// Readings by finger, in the order of Motor.
[[nodiscard]] Forces forces_of(const std::array<int, kStrainFields>& strain,
                               const std::array<StrainField, kStrainFields>& fields) noexcept;
/// Enters forces that arrived at `t`: thumb, index and middle finger.
void tell_forces(const Forces& forces, TimePoint t, HandTelemetry& telemetry) noexcept;

/// Keeps the newest readings and chooses what to ask for next. No I/O, no heap.
class TelemetryReader {
 public:
  explicit TelemetryReader(const TelemetryConfig& config) noexcept;

  /// A new session: counts start again, offsets stay.
  void begin() noexcept;
  /// Once per write().
  void count_cycle() noexcept;
  /// Channel to ask for now ('C' or 'A'), or '\0'. Asking takes the turn.
  [[nodiscard]] char next_channel() noexcept;
  /// The hand did not answer; a channel that is silent three times in a row is not asked again before the next
  /// connect().
  void missed(char channel) noexcept;
  [[nodiscard]] bool wants(char channel) const noexcept;

  /// True when `line` is a reading; it is then kept.
  bool take(std::string_view line, TimePoint now) noexcept;
  /// From the next kTareSamples readings on, the mean of these is zero force.
  void tare() noexcept;
  static constexpr int kTareSamples = 8;

  [[nodiscard]] const MiaTelemetry& data() const noexcept { return data_; }
  /// Enters readings that are not older than kFresh at `now`.
  void tell(TimePoint now, HandTelemetry& telemetry) const noexcept;
  /// A channel that should speak has not done so since `since`.
  [[nodiscard]] bool silent(TimePoint since) const noexcept;
  static constexpr Duration kFresh = std::chrono::seconds(2);

 private:
  void take_strain(const std::array<int, kStrainFields>& strain) noexcept;

  TelemetryConfig config_;
  MiaTelemetry data_;
  unsigned cycles_{0};
  bool due_{false};
  bool forces_next_{false};
  std::array<int, 2> missed_{};  ///< in a row: currents, forces
  int tare_left_{0};
  std::array<int, kStrainFields> tare_sum_{};
};

}  // namespace embody::mia
