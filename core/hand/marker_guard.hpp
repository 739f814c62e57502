#pragma once
// Which finger markers of a frame are what their labels say.
#include <optional>

#include "core/hand/finger_problem.hpp"
#include "core/hand/marker_track.hpp"

namespace embody::hand {

enum class MarkerVerdict : std::uint8_t {
  kNone,        ///< no finger marker of the glove
  kMissing,     ///< not seen
  kUsed,        ///< believed
  kRelabelled,  ///< the measurement of another slot is used: the two labels are swapped
  kJumped,      ///< not believed: farther from where it was than a finger moves; believed again when it lasts
  kGhost,       ///< not believed: no posture of the hand explains it
};
inline constexpr std::array<const char*, 6> kMarkerVerdictNames{"none",       "missing", "used",
                                                                "relabelled", "jumped",  "ghost"};

/// The finger markers of one frame in the hand's own frame M.
struct CheckedMarkers {
  CheckedMarkers() noexcept { p_M.fill(Eigen::Vector3d::Zero()); }

  std::array<Eigen::Vector3d, kMaxMarkers> p_M;      ///< by slot, m; meaningless unless usable
  std::array<MarkerVerdict, kMaxMarkers> verdict{};  ///< by slot
  std::array<std::uint8_t, kMaxMarkers> source{};    ///< slot whose measurement is used here
  std::array<double, kMaxMarkers> residual_m{};      ///< distance to the model after the fit; 0 when not fitted

  [[nodiscard]] bool usable(std::size_t slot) const noexcept {
    return verdict[slot] == MarkerVerdict::kUsed || verdict[slot] == MarkerVerdict::kRelabelled;
  }
};

/// A marker that is not believed although it stays where it is: is there a posture in which it is there?
struct MarkerTrial {
  std::size_t slot{0};
  Finger finger{Finger::kThumb};
  std::size_t point{0};
  Eigen::Vector3d p_M{0.0, 0.0, 0.0};
};

/// Largest distance of any marker to its point (m) in the posture that fits best once the trial's marker is among them,
/// in place of one of the same point. One solve from `problem.start_rad` in the problem's range, without temporal
/// prior; infinite when it fails. No heap.
[[nodiscard]] double posture_residual_m(FingerProblem problem, const MarkerTrial& trial, int max_iterations,
                                        double tolerance) noexcept;

/// Follows every finger marker in M and says which measurement is which marker. Labels that jumped to each other's
/// predicted places are exchanged, for as long as they stay exchanged; a label that jumped elsewhere is left out until
/// it returns or a posture explains where it stays. Once per frame, in the order of the frames:
///   step(frame, pose, out);  fit the usable markers of `out`;  explain() for every marker of a fitted or held finger;
///   if trial(): answer(posture_residual_m(...)).
/// No heap; some 2 us for ten markers; at most one trial per frame.
class MarkerGuard {
 public:
  /// Reach of the fingers from `model`: the straight finger and a margin.
  MarkerGuard(const HandModel& model, const GloveLayout& glove, const MarkerGuardConfig& config = {}) noexcept;

  /// Fills `out` but for the residuals, which become zero. With an invalid hand pose everything is missing. Frame
  /// numbers do not matter; a capture time that stands still or runs backwards counts as 10 ms.
  void step(const MarkerFrame& frame, const HandPose& hand_pose, CheckedMarkers& out) noexcept;
  /// Where the model has the marker of `slot` after the fit, M, m. Sets its residual in `out` when it was usable.
  void explain(std::size_t slot, const Eigen::Vector3d& model_M, CheckedMarkers& out) noexcept;
  /// The one question of this frame, if any.
  [[nodiscard]] const std::optional<MarkerTrial>& trial() const noexcept { return trial_; }
  /// Its answer. Without one it is asked again.
  void answer(double residual_m) noexcept;

  /// How much farther from the model than at first the markers are now: mean over all of them, the first five seconds
  /// against the last two or so, m; 0 until then. Large values that last: the glove slipped.
  [[nodiscard]] double slip_m() const noexcept;

 private:
  static constexpr std::size_t kMost = decltype(GloveLayout::finger_markers)::capacity();
  static constexpr std::size_t kNobody = kMost;
  // Index in what follows: of markers, as in GloveLayout::finger_markers; "label" i: measurement with marker i's label.
  struct Entry {
    FingerMarker marker;
    MarkerTrack track;
    std::size_t source{0};    // label that is used
    bool seen{false};         // the label is
    bool taken{false};        // the label is in use
    bool placed{false};       // the marker has a label
    double advantage_m{0.0};  // of its own label's place over the exchanged one's
    std::uint32_t trials{0};
    Eigen::Vector3d p_M{0.0, 0.0, 0.0};  // of the label
  };

  void step_time(TimePoint t_capture) noexcept;
  [[nodiscard]] double gate_m(std::size_t i, std::size_t k) const noexcept;
  void read(const MarkerFrame& frame, const HandPose& hand_pose) noexcept;
  void follow_reference() noexcept;
  void keep_sources() noexcept;
  void exchange() noexcept;
  void place_rest() noexcept;
  void place(std::size_t marker, std::size_t label) noexcept;
  void drop_unexplained() noexcept;
  void ask() noexcept;
  void undo_exchanges() noexcept;
  void judge_slip() noexcept;
  void report(CheckedMarkers& out) const noexcept;

  MarkerGuardConfig config_;
  StaticVector<Entry, kMost> entries_;
  std::array<std::uint8_t, kMaxMarkers> entry_of_slot_{};  // kNobody: none
  TimePoint t_last_{};
  Duration dt_{0};
  double gate_m_{0.0};
  std::optional<MarkerTrial> trial_;
  std::size_t asked_{0};
  std::size_t explained_{0};  // markers of this frame that were
  double sum_m_{0.0};         // of their residuals
  Duration learnt_{0};
  double first_m_{0.0};
  double recent_m_{0.0};
};

}  // namespace embody::hand
