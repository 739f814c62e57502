#pragma once
// Are the three markers on the back of the hand the ones that they are labelled as? Judged by the distances between
// them, which hardly change while the glove sits.
#include "core/hal/types.hpp"
#include "core/hand/glove_layout.hpp"

namespace embody::hand {

enum class TriadState : std::uint8_t {
  kLearning,    ///< the shape is not known yet: taken from the first frames that agree; poses are valid, not checked
  kGood,        ///< fits the known shape
  kRelabelled,  ///< fits once the labels are exchanged; the pose is made from the exchanged labels
  kMissing,     ///< a marker of the three is not seen, or they span no plane
  kWrong,       ///< does not fit, however the labels are exchanged
  kChanged,     ///< does not fit and has kept its new shape: a marker moved on the glove; calibrate again
};
inline constexpr std::array<const char*, 6> kTriadStateNames{"learning", "good",  "relabelled",
                                                             "missing",  "wrong", "changed"};

struct TriadConfig {
  double tolerance_m{0.004};  ///< an edge may differ from the known shape by so much (a real triad breathes by 1 mm)
  double agreement_m{0.001};  ///< frames agree when their edges differ from the mean of the run by less than this
  std::uint32_t learn_frames{20};     ///< that have to agree before a shape is taken as known
  std::uint32_t changed_frames{100};  ///< that have to agree on another shape before it is called changed
};

/// Edges are top-left, top-right, left-right, as in GloveLayout::back_edges_m.
using TriadEdges = std::array<double, 3>;
/// Top, left, right.
using Triad = std::array<Eigen::Vector3d, 3>;

[[nodiscard]] TriadEdges edges_of(const Triad& p) noexcept;

/// Steps once per frame. Never changes a known shape, calibrated or learnt. No heap, about 0.1 us.
class TriadCheck {
 public:
  /// Edges that are not all positive and finite are learnt.
  explicit TriadCheck(const TriadEdges& edges_m, const TriadConfig& config = {}) noexcept;

  /// Judges the three points of one frame (m, any frame of reference) and, when their labels are exchanged, puts them
  /// in order. The points are to be used when the answer is kLearning, kGood or kRelabelled.
  TriadState step(Triad& p) noexcept;
  /// The frame has no triad. What was learnt so far stays.
  TriadState missing() noexcept;

  [[nodiscard]] TriadState state() const noexcept { return state_; }
  [[nodiscard]] bool usable() const noexcept { return state_ <= TriadState::kRelabelled; }
  [[nodiscard]] bool learning() const noexcept { return !known_; }
  /// The shape is such that an exchange of two labels is not told from the shape itself (nearly isosceles).
  [[nodiscard]] bool ambiguous() const noexcept { return ambiguous_; }
  /// Root mean square difference of the edges (in the order that is used) from the known shape, m; 0 while learning and
  /// while missing.
  [[nodiscard]] double error_m() const noexcept { return error_m_; }
  /// Known shape, m; zeros while learning.
  [[nodiscard]] const TriadEdges& reference_m() const noexcept { return reference_m_; }
  /// Edges of the last frame as they were labelled, m.
  [[nodiscard]] const TriadEdges& edges_m() const noexcept { return edges_m_; }
  /// [i]: whose label (0 top, 1 left, 2 right) marker i carried in the last frame that was judged.
  [[nodiscard]] const std::array<std::uint8_t, 3>& source() const noexcept { return source_; }

 private:
  // Consecutive frames with about the same edges.
  struct Run {
    TriadEdges mean_m{};
    std::uint32_t frames{0};
    void add(const TriadEdges& edges_m, double agreement_m) noexcept;
  };

  TriadState learn() noexcept;
  void know(TriadEdges edges_m) noexcept;

  TriadConfig config_;
  TriadEdges reference_m_{};
  TriadEdges edges_m_{};
  Run run_;
  std::array<std::uint8_t, 3> source_{0, 1, 2};
  TriadState state_{TriadState::kMissing};
  double error_m_{0.0};
  bool known_{false};
  bool ambiguous_{false};
};

}  // namespace embody::hand
