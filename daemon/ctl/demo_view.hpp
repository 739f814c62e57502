#pragma once
// What the demo shows: a live table and a summary, from the daemon's status and the lab's report (JSON texts).
#include <string>

namespace embody::ctl {

/// What the demo itself knows.
struct DemoProgress {
  double elapsed_s{0.0};  ///< of the playback
  double duration_s{0.0};
  int re_engagements{0};  ///< holds and stops after which the demo engaged again, as an operator would
  int resets{0};          ///< stops that the demo reset
};

/// The live table. Members that are missing show as a dash.
[[nodiscard]] std::string live_table(const std::string& status, const DemoProgress& progress);
/// The same in one line, for outputs that are no terminal.
[[nodiscard]] std::string live_line(const std::string& status, const DemoProgress& progress);

/// The summary for programs: one JSON object with the keys that docs/demo.md lists. `played_s`: time over which the
/// rates are means; `status_before` and `status_after` are from its ends.
[[nodiscard]] std::string summary_json(const std::string& report, const std::string& status_before,
                                       const std::string& status_after, double played_s, const DemoProgress& progress);
/// The summary for people.
[[nodiscard]] std::string summary_text(const std::string& summary);

}  // namespace embody::ctl
