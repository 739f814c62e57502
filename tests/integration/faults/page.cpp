#include "tests/integration/faults/page.hpp"

#include <algorithm>
#include <cstdarg>
#include <cstdio>
#include <set>
#include <sstream>

namespace embody::faults {
namespace {

__attribute__((format(printf, 1, 2))) std::string format(const char* pattern, ...) {
  char text[1024];
  va_list arguments;
  va_start(arguments, pattern);
  std::vsnprintf(text, sizeof text, pattern, arguments);
  va_end(arguments);
  return text;
}

double ms(Duration span) {
  return to_seconds(span) * 1e3;
}

bool stopped(const RowResult& result) {
  return !result.recovery.empty();
}

std::string joined(const std::vector<std::string>& words, const char* between) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : between) + word;
  return text;
}

std::string noticed(const RowResult& result) {
  return result.detected ? format("%.0f", ms(*result.detected)) : "-";
}

std::string arm_did(const Row& row, const RowResult& result) {
  const ArmOutcome& arm = result.arm;
  if (!stopped(result)) return "goes on";
  if (!arm.to_rest) return "not at rest";
  return format("%.2f rad/s; at rest after %.0f ms (%s %.0f)", arm.speed_rad_s, ms(*arm.to_rest),
                row.brake == Brake::kRobot ? "robot's own stop" : "bound", ms(arm.bound)) +
         format(", %.3f rad on", arm.travel_rad);
}

std::string hand_did(const RowResult& result) {
  if (!stopped(result)) return result.hand.commanded ? "goes on" : "rests";
  return format("%.3f rad on, %.0f ms", result.hand.excursion_rad, std::max(0.0, ms(result.hand.to_rest)));
}

std::string shown(const RowResult& result) {
  return joined(result.modes, " > ") + (result.cause.empty() ? "" : ": " + result.cause);
}

std::string way_back(const Row& row, const RowResult& result) {
  if (!stopped(result)) return "by itself";
  const std::string daemon = row.restarts_daemon ? "daemon started again, " : "";
  return daemon + result.recovery + format("; %.1f s", to_seconds(result.recovered_in));
}

/// What a person reads as one action: "tracker pause 500".
std::string actions(const std::vector<std::string>& list) {
  return list.empty() ? "-" : "`" + joined(list, "`, `") + "`";
}

std::string preface(const CellLimits& limits) {
  return "# What happens when something fails?\n\n"
         "Each row was made to happen to the real daemon (`embodyd`, a process of its own) against simulated devices "
         "that\n"
         "speak the real bytes, while arm and hand were moving fast. Nothing here was tried on hardware. The rows of "
         "a\n"
         "device set share one daemon: that the next row can run is the proof that no restart was needed, except "
         "where\n"
         "a row says so. Written by\n\n"
         "    build/release/fault_matrix --output docs/faults.md\n\n"
         "which fails when a row breaks a rule below; a short selection runs with the ordinary tests.\n\n"
         "## How to read it\n\n"
         "| column | meaning |\n|---|---|\n"
         "| fault | its name and what happens; in backquotes what the simulators are told, and what ends it |\n"
         "| noticed | ms until the daemon's status shows something else: its mode (exactly: the status says since "
         "when), or "
         "a device, marker or counter (looked at every 10 ms). - : nothing is shown, and nothing needs to be |\n"
         "| arm | fastest joint when the fault came; ms until every joint of the simulated robot is slower than 0.01 "
         "rad/s, from "
         "its own log of 500 samples a second; the bound; the largest way of a joint from the fault on |\n"
         "| hand | largest way of a joint after its last command, and ms until it stands still |\n"
         "| daemon | modes that it went through, and the cause that it shows |\n"
         "| way back | what an operator did after the fault was over, and how long that took |\n\n"
         "## Rules\n\n"
         "1. Where the arm has to stop it is at rest within: the time until the fault is noticed, or 50 ms where that "
         "is\n"
         "   shorter, + v/a + 140 ms. v is each joint's greatest speed, or that of its set-point, until then; a its "
         "limit\n"
         "   (" +
         format("%g, %g, %g, %g, %g, %g rad/s2). ", limits.acceleration_rad_s2[0], limits.acceleration_rad_s2[1],
                limits.acceleration_rad_s2[2], limits.acceleration_rad_s2[3], limits.acceleration_rad_s2[4],
                limits.acceleration_rad_s2[5]) +
         "Of the 140 ms, `servoj` (look-ahead 0.05 s, gain 600) takes 120 in the\n   simulator until the joints are "
         "slower "
         "than 0.01 rad/s behind a set-point that comes to rest, and 20 are the way of a\n   command and the last "
         "approach "
         "to it of the program on the robot. What the robot stops by itself takes the simulator 300 ms.\n"
         "2. The hand has no watchdog and finishes its last command: at most 0.15 rad.\n"
         "3. What comes back moves nothing: until the operator engages, no joint moves by more than 0.002 rad.\n"
         "4. No joint is ever faster than its limit, and none steps, while engaging either.\n"
         "5. What is no danger does not stop the arm.\n"
         "6. An operator can go on as in [modes.md](modes.md).\n\n" +
         format(
             "Settings: `hold_after_ms` %.0f, the product's; `stale_after_ms` %.0f and `watchdog_hz` %g are slower "
             "than the "
             "product's (100, 10), since\nthe machine that runs simulators and daemon together stalls. A row counts as "
             "failed 100 ms beyond its bound, and runs\nagain when the machine was held up meanwhile; the table shows "
             "what was measured.\n\n",
             to_seconds(limits.hold_after) * 1e3, to_seconds(limits.stale_after) * 1e3, limits.watchdog_hz);
}

std::string summary(const std::vector<Section>& sections) {
  std::size_t rows = 0, stops = 0, restarts = 0;
  double excursion = 0.0, slack = 1e9;
  for (const Section& section : sections) {
    for (const Entry& entry : section.entries) {
      ++rows;
      if (!stopped(entry.result)) continue;
      ++stops;
      restarts += entry.row->restarts_daemon ? 1 : 0;
      excursion = std::max(excursion, entry.result.hand.excursion_rad);
      if (entry.result.arm.to_rest && entry.row->brake == Brake::kDaemon)
        slack = std::min(slack, ms(entry.result.arm.bound - *entry.result.arm.to_rest));
    }
  }
  return "## Summary\n\n" + format(
                                "%zu faults: the arm stopped in %zu and went on in %zu. The closest that it came to "
                                "its bound was %.0f ms; the\n"
                                "farthest that a hand went on was %.3f rad. %zu rows start the daemon again; all "
                                "others went on with the one\n"
                                "that met the fault.\n",
                                rows, stops, rows - stops, slack, excursion, restarts);
}

std::set<std::string> names_in(const std::string& page) {
  std::set<std::string> names;
  std::istringstream in(page);
  for (std::string line; std::getline(in, line);) {
    if (!line.starts_with("| **")) continue;
    names.insert(line.substr(4, line.find("**", 4) - 4));
  }
  return names;
}

}  // namespace

std::string print_line(const Entry& entry) {
  const RowResult& r = entry.result;
  std::string line = format("%-26s %5s ms | ", entry.row->name.c_str(), noticed(r).c_str()) + arm_did(*entry.row, r) +
                     " | " + hand_did(r) + " | " + shown(r) + " | " + way_back(*entry.row, r) + "\n";
  for (const std::string& failure : r.failures) line += "    BROKEN: " + failure + "\n";
  if (!r.failures.empty() || entry.runs > 1) {
    line += format("    run %d; this machine held us up for %.0f ms, the simulated controller for %llu cycles\n",
                   entry.runs, ms(r.longest_gap), static_cast<unsigned long long>(r.late_cycles));
  }
  return line;
}

std::string print_page(const std::vector<Section>& sections, const CellLimits& limits) {
  std::string page = preface(limits) + summary(sections);
  for (const Section& section : sections) {
    page += "\n## " + section.group->title + "\n\nWith " + section.group->devices +
            ".\n\n| fault | noticed (ms) | arm | hand | daemon | way back |\n|---|---|---|---|---|---|\n";
    for (const auto& [row, result, runs] : section.entries) {
      page += "| **" + row->name + "** " + row->fault + "; " +
              (row->before.empty() ? "" : actions(row->before) + ", then ") + actions(row->inject) +
              (row->clear.empty() ? "" : ", then " + actions(row->clear)) + " | " + noticed(result) + " | " +
              arm_did(*row, result) + " | " + hand_did(result) + " | " + shown(result) + " | " +
              way_back(*row, result) + (row->note.empty() ? "" : ". " + row->note) + " |\n";
    }
  }
  return page;
}

std::string compare_page(const std::string& page, const std::vector<Group>& groups) {
  std::set<std::string> known;
  for (const Group& group : groups) {
    for (const Row& row : group.rows) known.insert(row.name);
  }
  const std::set<std::string> there = names_in(page);
  std::string difference;
  for (const std::string& name : known) {
    if (!there.contains(name)) difference += "the page lacks " + name + "\n";
  }
  for (const std::string& name : there) {
    if (!known.contains(name)) difference += "the page has " + name + ", which is no row\n";
  }
  return difference;
}

}  // namespace embody::faults
