#pragma once
// The similarity of robot hands to the human hand as people and programs read it: the paper's table, and ours.
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "core/hal/types.hpp"

namespace embody::evaluate {

struct SimilarityRow {
  std::string hand;                                     ///< EmbodimentConfig::name
  std::array<std::optional<double>, kFingers> mean_mm;  ///< over all frames; nothing for a finger without pads
  std::size_t frames{0};
};

/// Adds up frames of one hand (core/embodiment/similarity.hpp), metres in, millimetres out.
class SimilarityMean {
 public:
  void add(const std::array<std::optional<double>, kFingers>& distances_m) noexcept;
  [[nodiscard]] SimilarityRow row(std::string hand) const;

 private:
  std::array<double, kFingers> sums_m_{};
  std::array<std::size_t, kFingers> counts_{};
  std::size_t frames_{0};
};

/// The row of the paper's table for the same hand: "mia", "shadow..." or "robotiq...", in any case of letters.
[[nodiscard]] std::optional<SimilarityRow> paper_similarity(const std::string& hand);

/// A table for people: each hand, below it the paper's figures where it has some, and what differs.
[[nodiscard]] std::string similarity_text(const std::vector<SimilarityRow>& rows);

/// One JSON object; null where there is no figure.
[[nodiscard]] std::string similarity_json(const std::vector<SimilarityRow>& rows);

}  // namespace embody::evaluate
