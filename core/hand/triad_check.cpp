#include "core/hand/triad_check.hpp"

#include <algorithm>
#include <cmath>

namespace embody::hand {
namespace {

// No glove carries its back markers closer or farther apart.
constexpr double kShortestEdgeMetres = 0.005;
constexpr double kLongestEdgeMetres = 0.5;
constexpr std::uint32_t kLongestRun = 1U << 20;  // of a mean: bounds its counter

// All orders of three labels; the first keeps them.
constexpr std::array<std::array<std::uint8_t, 3>, 6> kOrders{
    {{0, 1, 2}, {1, 0, 2}, {2, 1, 0}, {0, 2, 1}, {1, 2, 0}, {2, 0, 1}}};

/// Edge between the markers i and j, 0..2.
double edge(const TriadEdges& edges_m, std::size_t i, std::size_t j) noexcept {
  return edges_m[i + j - 1];
}

TriadEdges reordered(const TriadEdges& edges_m, const std::array<std::uint8_t, 3>& order) noexcept {
  return {edge(edges_m, order[0], order[1]), edge(edges_m, order[0], order[2]), edge(edges_m, order[1], order[2])};
}

/// Greatest difference of an edge; infinite for what is not a number.
double distance(const TriadEdges& a, const TriadEdges& b) noexcept {
  double greatest = 0.0;
  for (std::size_t i = 0; i < 3; ++i) {
    const double difference = std::abs(a[i] - b[i]);
    if (!(difference <= greatest)) greatest = difference;
  }
  return std::isfinite(greatest) ? greatest : HUGE_VAL;
}

bool plausible(const TriadEdges& edges_m) noexcept {
  return std::all_of(edges_m.begin(), edges_m.end(),
                     [](double edge_m) { return edge_m >= kShortestEdgeMetres && edge_m <= kLongestEdgeMetres; });
}

struct Choice {
  std::size_t order{0};
  double error_m{HUGE_VAL};
};

/// The order of the labels that fits best. Labels are exchanged only where this is better, by `margin_m`, than to keep
/// them and than any other exchange.
Choice best_order(const TriadEdges& edges_m, const TriadEdges& reference_m, double margin_m) noexcept {
  std::array<double, kOrders.size()> error_m{};
  for (std::size_t i = 0; i < kOrders.size(); ++i) error_m[i] = distance(reordered(edges_m, kOrders[i]), reference_m);
  const auto best = static_cast<std::size_t>(std::min_element(error_m.begin(), error_m.end()) - error_m.begin());
  for (std::size_t i = 0; i < kOrders.size(); ++i) {
    if (i != best && !(error_m[i] >= error_m[best] + margin_m)) return {0, error_m[0]};
  }
  return {best, error_m[best]};
}

}  // namespace

TriadEdges edges_of(const Triad& p) noexcept {
  return {(p[0] - p[1]).norm(), (p[0] - p[2]).norm(), (p[1] - p[2]).norm()};
}

TriadCheck::TriadCheck(const TriadEdges& edges_m, const TriadConfig& config) noexcept : config_(config) {
  const bool given = std::all_of(edges_m.begin(), edges_m.end(), [](double e) { return e > 0.0 && std::isfinite(e); });
  if (given) know(edges_m);
}

TriadState TriadCheck::missing() noexcept {
  error_m_ = 0.0;
  return state_ = TriadState::kMissing;
}

TriadState TriadCheck::step(Triad& p) noexcept {
  edges_m_ = edges_of(p);
  error_m_ = 0.0;
  source_ = kOrders[0];
  if (!known_) return learn();
  const Choice choice = best_order(edges_m_, reference_m_, 0.5 * config_.tolerance_m);
  const TriadEdges used_m = reordered(edges_m_, kOrders[choice.order]);
  double sum_m2 = 0.0;
  for (std::size_t i = 0; i < 3; ++i) sum_m2 += (used_m[i] - reference_m_[i]) * (used_m[i] - reference_m_[i]);
  error_m_ = std::sqrt(sum_m2 / 3.0);
  if (choice.error_m <= config_.tolerance_m) {
    run_ = Run{};
    source_ = kOrders[choice.order];
    const Triad labelled = p;
    for (std::size_t i = 0; i < 3; ++i) p[i] = labelled[source_[i]];
    return state_ = choice.order == 0 ? TriadState::kGood : TriadState::kRelabelled;
  }
  run_.add(edges_m_, config_.agreement_m);
  return state_ = run_.frames >= config_.changed_frames ? TriadState::kChanged : TriadState::kWrong;
}

TriadState TriadCheck::learn() noexcept {
  if (!plausible(edges_m_)) {
    run_ = Run{};
    return state_ = TriadState::kWrong;
  }
  run_.add(edges_m_, config_.agreement_m);
  state_ = TriadState::kLearning;
  if (run_.frames >= config_.learn_frames) {
    know(run_.mean_m);
    state_ = TriadState::kGood;
  }
  return state_;
}

void TriadCheck::know(TriadEdges edges_m) noexcept {
  reference_m_ = edges_m;
  known_ = true;
  run_ = Run{};
  ambiguous_ = false;
  for (std::size_t i = 1; i < kOrders.size(); ++i) {
    ambiguous_ |= distance(reordered(edges_m, kOrders[i]), edges_m) < config_.tolerance_m;
  }
}

void TriadCheck::Run::add(const TriadEdges& edges_m, double agreement_m) noexcept {
  if (frames == 0 || !(distance(edges_m, mean_m) <= agreement_m)) {
    *this = {edges_m, 1};
    return;
  }
  if (frames < kLongestRun) ++frames;
  for (std::size_t i = 0; i < 3; ++i) mean_m[i] += (edges_m[i] - mean_m[i]) / static_cast<double>(frames);
}

}  // namespace embody::hand
