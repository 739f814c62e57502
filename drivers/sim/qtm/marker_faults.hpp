#pragma once
// What goes wrong with the markers of a simulated QTM: what the cameras miss or misplace, and what the identification
// makes of the rest.
#include <Eigen/Core>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.hpp"
#include "drivers/sim/qtm/fault_words.hpp"
#include "drivers/sim/qtm/frame_encoder.hpp"
#include "drivers/sim/qtm/motion.hpp"

namespace embody::sim {

/// Two stages: faults of markers (by the names of the motion) act on what the cameras see, faults of labels on the list
/// and on which marker each label follows. Ticks count the frames since the start of the measurement.
class MarkerFaults {
 public:
  explicit MarkerFaults(const Motion& motion);

  [[nodiscard]] const std::vector<std::string>& labels() const noexcept { return labels_; }
  /// The markers that `triad_loss` hides.
  void set_triad(std::vector<std::size_t> markers) { triad_ = std::move(markers); }

  /// True for the kinds that act() takes.
  [[nodiscard]] static bool handles(FaultKind kind) noexcept;
  /// The fault acts from tick `tick` on. Error kNotFound: no such marker or label; kInvalidArgument: a label of that
  /// name exists already, or too many; the last label cannot be removed.
  [[nodiscard]] Status act(const Fault& fault, std::size_t tick);
  /// The ticks start at 0 again: a new measurement. Faults that are counted in frames end, the others stay.
  void restart();

  /// What the cameras see of the motion's frame (first stage), in place. To be called once per tick.
  void see(std::size_t tick, std::vector<Marker>& markers);
  /// Factor on all lengths that QTM sends.
  [[nodiscard]] double scale() const noexcept { return scale_; }
  /// What the identification makes of it (second stage, without scale()): fills the labelled and the unlabelled markers
  /// of `frame`.
  void identify(std::size_t tick, const std::vector<Marker>& seen, FrameData& frame) const;

 private:
  struct MarkerState {
    bool hidden{false};
    bool ghost{false};
    std::size_t missing_until{0};  // tick
    std::size_t unlabelled_until{0};
    std::uint32_t unlabelled_id{0};
    std::size_t gap_frames{0};  // missing at the start of every gap period
    std::size_t gap_start{0};   // tick
    Eigen::Vector3d step_m{0.0, 0.0, 0.0};
    std::optional<Eigen::Vector3d> p_W_ghost;  // known once the marker has been seen
  };

  [[nodiscard]] std::optional<std::size_t> marker(std::string_view name) const;
  [[nodiscard]] std::optional<std::size_t> label(std::string_view name) const;
  [[nodiscard]] Status act_on_marker(const Fault& fault, std::size_t tick);
  [[nodiscard]] Status act_on_labels(const Fault& fault);
  [[nodiscard]] bool missing(const MarkerState& state, std::size_t tick) const noexcept;

  std::vector<std::string> names_;  // of the motion
  std::size_t gap_period_;          // ticks
  std::vector<MarkerState> markers_;
  std::vector<std::size_t> triad_;
  std::size_t all_missing_until_{0};
  double scale_{1.0};
  std::uint32_t next_id_{1000};

  std::vector<std::string> labels_;
  std::vector<std::optional<std::size_t>> shows_;  // marker that each label follows
};

}  // namespace embody::sim
