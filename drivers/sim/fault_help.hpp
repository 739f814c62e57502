#pragma once
// One line of the list of faults that a simulated device offers.
#include <algorithm>
#include <string>
#include <string_view>

namespace embody::sim {

/// Words of the fault, at least two blanks, what it does.
inline void add_fault_help(std::string& help, std::string_view words, std::string_view meaning) {
  constexpr std::size_t kColumn = 32;
  help.append(words).append(std::max(words.size() + 2, kColumn) - words.size(), ' ').append(meaning).append("\n");
}

}  // namespace embody::sim
