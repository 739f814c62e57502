#pragma once
// The matrix for people: docs/faults.md, and lines on the terminal while it runs.
#include "tests/integration/faults/run_row.hpp"

namespace embody::faults {

struct Entry {
  const Row* row{nullptr};
  RowResult result;
  int runs{1};  ///< more than one: the machine was busy with something else
};

struct Section {
  const Group* group{nullptr};
  std::vector<Entry> entries;
};

/// One line for the terminal, and one for each broken rule.
[[nodiscard]] std::string print_line(const Entry& entry);
/// The whole page.
[[nodiscard]] std::string print_page(const std::vector<Section>& sections, const CellLimits& limits);
/// What of the rows of `groups` is missing in a page, or there without being known; empty: nothing.
[[nodiscard]] std::string compare_page(const std::string& page, const std::vector<Group>& groups);

}  // namespace embody::faults
