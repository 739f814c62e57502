#pragma once
// What became of each marker of the glove, as text for people, from the daemon's answer to `markers` (docs/control.md).
#include <string>

namespace embody::ctl {

/// One row per marker, the back of the hand, and a sentence for each label that is probably wrong. Members that are
/// missing show as a dash. Never throws for bad text.
[[nodiscard]] std::string markers_table(const std::string& json_text);

/// The same in one line: how many are seen, which are not used and why, and the sentences.
[[nodiscard]] std::string markers_line(const std::string& json_text);

}  // namespace embody::ctl
