#pragma once
// What is wrong with the labels of a simulated QTM: hidden, exchanged, or stuck to something that is not the marker.
#include <Eigen/Core>
#include <optional>
#include <utility>
#include <vector>

#include "core/hal/types.hpp"

namespace embody::sim {

/// Labels are counted as the markers of the recording; at first each shows its own marker.
class LabelFaults {
 public:
  explicit LabelFaults(std::size_t labels) : faults_(labels) {
    for (std::size_t i = 0; i < labels; ++i) faults_[i].shows = i;
  }

  [[nodiscard]] std::size_t size() const noexcept { return faults_.size(); }
  void set_hidden(std::size_t label, bool hidden) { faults_[label].hidden = hidden; }
  /// Each label follows the other's marker from now on.
  void swap(std::size_t a, std::size_t b) { std::swap(faults_[a].shows, faults_[b].shows); }
  /// The label stays 0.1 m above where its marker is seen next.
  void set_ghost(std::size_t label, bool on) {
    faults_[label].ghost = on;
    faults_[label].p_W_ghost.reset();
  }

  /// What the label says in this frame of the recording.
  [[nodiscard]] Marker measurement(std::size_t label, const std::vector<Marker>& frame) {
    Fault& fault = faults_[label];
    if (fault.hidden) return {};
    Marker marker = frame[fault.shows];
    if (!fault.ghost) return marker;
    if (!fault.p_W_ghost && marker.visible) fault.p_W_ghost = marker.p_W + Eigen::Vector3d(0.0, 0.0, kGhostDistance_m);
    if (fault.p_W_ghost) marker.p_W = *fault.p_W_ghost;
    marker.visible = fault.p_W_ghost.has_value();
    return marker;
  }

 private:
  static constexpr double kGhostDistance_m = 0.1;

  struct Fault {
    std::size_t shows{0};  // marker of the recording that the label follows
    bool hidden{false};
    bool ghost{false};
    std::optional<Eigen::Vector3d> p_W_ghost;  // known from the first frame of the fault on in which the marker is seen
  };
  std::vector<Fault> faults_;
};

}  // namespace embody::sim
