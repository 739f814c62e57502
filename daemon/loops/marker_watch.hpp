#pragma once
// What the markers of the glove did in the last second, for people: one row per marker, and sentences about labels that
// are probably wrong. Pure bookkeeping over the reports of the finger loop.
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "core/hand/glove_layout.hpp"
#include "daemon/loops/edges.hpp"

namespace embody {

/// One marker of the glove. Fractions are of the frames of the last second.
struct MarkerRow {
  std::string label;
  std::string finger;  ///< "thumb" to "little", "back", or empty: the glove names it but nothing uses it
  std::string point;   ///< "tip", "middle", "point 2" and so on; "top", "left", "right" on the back
  bool seen{false};    ///< in the newest frame
  double seen_fraction{0.0};
  hand::MarkerVerdict verdict{hand::MarkerVerdict::kNone};  ///< of the newest frame
  std::string source;                                       ///< kRelabelled: the label whose measurement is used here
  std::optional<double> residual_m;                         ///< distance to the model, where one was fitted
  Eigen::Vector3d p_W{0.0, 0.0, 0.0};                       ///< as measured under this label; meaningless unless seen
};

/// The three markers on the back of the hand. Edges: top-left, top-right, left-right.
struct BackRow {
  /// Of the newest frame: a name of TriadState; of a sensor without such markers "fits", "does not fit" or "not seen".
  std::string state;
  bool ambiguous{false};                         ///< the triangle does not tell two of its markers apart
  std::array<std::optional<double>, 3> edges_m;  ///< measured, where both ends are seen
  std::array<double, 3> reference_m{};           ///< zeros: not known
  double fit_error_m{0.0};
};

struct MarkersView {
  std::uint64_t frame_number{0};
  TimePoint t_capture{};
  std::size_t frames{0};  ///< in the last second
  bool valid{false};      ///< the pose of the hand is known
  std::vector<MarkerRow> rows;
  BackRow back;
  std::array<FingerQuality, kFingers> quality{};
  std::array<double, kFingers> confidence{};
  double hand_confidence{0.0};
  std::vector<std::string> findings;  ///< sentences about what is probably wrong; empty: nothing
};

class MarkerWatch {
 public:
  explicit MarkerWatch(const hand::GloveLayout& glove) : glove_(glove) {}

  /// Call it at regular intervals, also when `report` is the same as before: frames that stay away are news.
  void add(const FingerReport& report, TimePoint now);
  [[nodiscard]] MarkersView view() const;

 private:
  struct Sample {
    TimePoint t{};
    MarkerTally tally;
  };
  static constexpr Duration kSpacing = std::chrono::milliseconds(100);
  static constexpr Duration kWindow = std::chrono::seconds(1);

  [[nodiscard]] std::uint32_t frames() const;
  [[nodiscard]] double fraction_seen(std::size_t slot) const;
  [[nodiscard]] bool often(std::size_t slot, hand::MarkerVerdict verdict) const;
  [[nodiscard]] bool often(hand::TriadState state) const;
  [[nodiscard]] MarkerRow row(std::size_t slot) const;
  void describe_back(MarkersView& view) const;
  void find(MarkersView& view) const;
  void find_labels(std::vector<std::string>& findings) const;
  void find_back(std::vector<std::string>& findings) const;
  [[nodiscard]] std::string label(std::size_t slot) const;

  hand::GloveLayout glove_;
  FingerReport newest_;
  std::array<std::size_t, kMaxMarkers> relabelled_from_{};  ///< newest source of each slot that was relabelled
  std::array<std::uint8_t, 3> back_source_{0, 1, 2};        ///< the same for the triangle on the back
  std::deque<Sample> samples_;                              ///< oldest first; spans the window
};

}  // namespace embody
