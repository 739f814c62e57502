#pragma once
// Everything of the simulated QTM but its connections: motion, markers, bodies, parameters, measurement, and the faults
// of these. No sockets, no clock.
#include <optional>
#include <vector>

#include "core/base/time.hpp"
#include "drivers/sim/qtm/fault_words.hpp"
#include "drivers/sim/qtm/frame_encoder.hpp"
#include "drivers/sim/qtm/marker_faults.hpp"
#include "drivers/sim/qtm/measurement.hpp"
#include "drivers/sim/qtm/parameters_xml.hpp"
#include "drivers/sim/qtm/playback.hpp"
#include "drivers/sim/qtm/qtm_config.hpp"

namespace embody::sim {

class Studio {
 public:
  /// Errors: those of check_motion() and RigidBody::define().
  [[nodiscard]] static Result<Studio> build(const QtmServerConfig& config, Motion motion);

  [[nodiscard]] const Motion& motion() const noexcept { return motion_; }
  [[nodiscard]] const QtmSetup& setup() const noexcept { return setup_; }
  [[nodiscard]] Measurement& measurement() noexcept { return measurement_; }
  [[nodiscard]] const Measurement& measurement() const noexcept { return measurement_; }

  /// False for the faults of connections, which are not the studio's.
  [[nodiscard]] static bool handles(FaultKind kind) noexcept;
  /// The fault acts from the next frame on. Errors: those of MarkerFaults::act().
  [[nodiscard]] Status act(const Fault& fault, TimePoint now);
  /// Tries a script out, without effect: its faults of markers and labels find what they name.
  [[nodiscard]] Status check(const std::vector<ScheduledFault>& script) const;

  /// The measurement has begun to run: the motion starts.
  void start(TimePoint now);
  /// The next frame is due at; nothing: no measurement runs.
  [[nodiscard]] std::optional<TimePoint> t_next() const noexcept;
  /// Count of the frames since the start, including the next one's predecessors that were lost.
  [[nodiscard]] std::size_t tick() const noexcept { return playback_.tick(); }

  enum class Step : std::uint8_t { kEnded, kLost, kFrame };
  /// The next frame: made, or lost by a fault, or there is none.
  Step step();
  /// The frame made last, its tick, and its place in the motion.
  [[nodiscard]] const FrameData& frame() const noexcept { return frame_; }
  [[nodiscard]] std::optional<std::size_t> frame_tick() const noexcept { return frame_tick_; }
  [[nodiscard]] std::size_t frame_index() const noexcept { return frame_index_; }

 private:
  Studio(const QtmServerConfig& config, Motion motion);
  [[nodiscard]] Status define_bodies(const QtmServerConfig& config);
  void make_frame(std::size_t index);

  Motion motion_;
  bool loop_;
  QtmSetup setup_;
  MarkerFaults faults_;
  std::vector<RigidBody> bodies_;
  Measurement measurement_;
  Playback playback_;
  bool frozen_frame_number_{false};
  FrameData frame_;
  std::optional<std::size_t> frame_tick_;
  std::size_t frame_index_{0};
  std::vector<Marker> seen_;
};

}  // namespace embody::sim
