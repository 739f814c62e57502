#include "daemon/evaluate/similarity_report.hpp"

#include <algorithm>
#include <utility>

#include "daemon/evaluate/print.hpp"

namespace embody::evaluate {
namespace {

using nlohmann::ordered_json;

/// Table "Mean average distance of contact surfaces" of the paper; one frame of each of its demonstrations.
struct PaperRow {
  const char* prefix;  // of our hand's name
  const char* hand;
  std::array<std::optional<double>, kFingers> mean_mm;
};
constexpr std::size_t kPaperFrames = 763;
constexpr std::array<PaperRow, 3> kPaper{{
    {"mia", "Mia hand", {12.2, 8.3, 17.4, 23.3, 30.2}},
    {"shadow", "Shadow dexterous hand", {5.2, 6.3, 5.6, 5.9, 9.8}},
    {"robotiq", "Robotiq 2F-140", {28.6, 13.4, {}, {}, {}}},
}};

bool starts_with(const std::string& text, std::string_view prefix) {
  const auto lower = [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; };
  return text.size() >= prefix.size() &&
         std::equal(prefix.begin(), prefix.end(), text.begin(), [&](char a, char b) { return a == lower(b); });
}

void print_row(std::string& text, const char* hand, const SimilarityRow& row) {
  print(text, "%-24.24s", hand);
  for (const auto& value : row.mean_mm) print(text, " %8s", number(value, "%.1f").c_str());
  print(text, " %8zu\n", row.frames);
}

ordered_json per_finger(const std::array<std::optional<double>, kFingers>& values) {
  ordered_json object;
  for (std::size_t f = 0; f < kFingers; ++f) object[kFingerNames[f]] = json_number(values[f]);
  return object;
}

}  // namespace

void SimilarityMean::add(const std::array<std::optional<double>, kFingers>& distances_m) noexcept {
  ++frames_;
  for (std::size_t f = 0; f < kFingers; ++f) {
    if (!distances_m[f]) continue;
    sums_m_[f] += *distances_m[f];
    ++counts_[f];
  }
}

SimilarityRow SimilarityMean::row(std::string hand) const {
  SimilarityRow row;
  row.hand = std::move(hand);
  row.frames = frames_;
  for (std::size_t f = 0; f < kFingers; ++f) {
    if (counts_[f] > 0) row.mean_mm[f] = 1e3 * sums_m_[f] / static_cast<double>(counts_[f]);
  }
  return row;
}

std::optional<SimilarityRow> paper_similarity(const std::string& hand) {
  for (const PaperRow& row : kPaper) {
    if (starts_with(hand, row.prefix)) return SimilarityRow{row.hand, row.mean_mm, kPaperFrames};
  }
  return std::nullopt;
}

std::string similarity_text(const std::vector<SimilarityRow>& rows) {
  std::string text;
  print(text, "mean distance mm        ");
  for (const char* name : kFingerNames) print(text, " %8s", name);
  print(text, " %8s\n", "frames");
  for (const SimilarityRow& row : rows) {
    print_row(text, row.hand.c_str(), row);
    if (const auto paper = paper_similarity(row.hand)) {
      print_row(text, "  paper", *paper);
    } else {
      print(text, "  not in the paper\n");
    }
  }
  text +=
      "The paper compares meshes of the robot hands with the MANO model over one frame of each of its demonstrations; "
      "here simple pads are compared with the configured hand model over the frames of one recording.\n";
  return text;
}

std::string similarity_json(const std::vector<SimilarityRow>& rows) {
  ordered_json hands = ordered_json::array();
  for (const SimilarityRow& row : rows) {
    ordered_json object{{"hand", row.hand}, {"frames", row.frames}};
    object["mean_mm"] = per_finger(row.mean_mm);
    const auto paper = paper_similarity(row.hand);
    object["paper_mm"] = paper ? per_finger(paper->mean_mm) : ordered_json(nullptr);
    hands.push_back(std::move(object));
  }
  return ordered_json{{"hands", std::move(hands)}}.dump(-1, ' ', false, ordered_json::error_handler_t::replace);
}

}  // namespace embody::evaluate
