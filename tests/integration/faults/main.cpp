// The fault matrix: makes each fault happen to the real daemon, checks what comes of it and writes docs/faults.md.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <fstream>
#include <sstream>

#include "tests/integration/faults/page.hpp"

namespace {

using namespace embody;
using namespace embody::faults;

struct Options {
  std::string programs, output, check;
  std::vector<std::string> only;
  bool quick{false}, list{false}, log{false};
  int runs{3};
};

bool chosen(const Row& row, const Options& options) {
  if (!options.only.empty()) return std::find(options.only.begin(), options.only.end(), row.name) != options.only.end();
  return !options.quick || row.quick;
}

/// A row that breaks a rule while the machine was held up runs again: it has shown nothing about the daemon.
Entry run(Cell& cell, const Row& row, int most_runs) {
  constexpr Duration kHeldUp = std::chrono::milliseconds(30);
  constexpr std::uint64_t kLateCycles = 10;
  Entry entry{&row, {}, 0};
  do {
    entry.result = run_row(cell, row);
    ++entry.runs;
    std::fputs(print_line(entry).c_str(), stdout);
    std::fflush(stdout);
  } while ((!entry.result.failures.empty() || entry.result.over_bound) && entry.runs < most_runs &&
           (entry.result.longest_gap > kHeldUp || entry.result.late_cycles > kLateCycles));
  return entry;
}

struct Matrix {
  std::vector<Section> sections;
  CellLimits limits;
  bool kept{true};  ///< no rule is broken
};

/// Groups with the same devices, which follow each other, share a cell.
Status run_all(const std::vector<Group>& groups, const Options& options, Matrix& matrix) {
  std::unique_ptr<Cell> cell;
  const Group* before = nullptr;
  for (const Group& group : groups) {
    Section section{&group, {}};
    for (const Row& row : group.rows) {
      if (!chosen(row, options)) continue;
      const bool same = before != nullptr && before->tracker == group.tracker && before->hand == group.hand;
      if (!cell || !same) {
        cell.reset();
        auto started = Cell::start(group.tracker, group.hand, options.programs);
        if (!started) return started.error();
        cell = std::move(*started);
        matrix.limits = cell->limits();
        std::printf("-- %s\n", group.devices.c_str());
      }
      before = &group;
      section.entries.push_back(run(*cell, row, options.runs));
      const bool kept = section.entries.back().result.failures.empty();
      matrix.kept = matrix.kept && kept;
      const std::string log = cell->new_log();
      if (options.log || !kept) std::printf("%s\n", log.c_str());
      if (!kept) cell.reset();  // the next row is not to suffer for this one
    }
    if (!section.entries.empty()) matrix.sections.push_back(std::move(section));
  }
  return {};
}

int check(const std::string& file, const std::vector<Group>& groups) {
  std::ifstream in(file);
  std::stringstream page;
  page << in.rdbuf();
  const std::string difference = compare_page(page.str(), groups);
  std::printf("%s%s\n", difference.c_str(),
              difference.empty() ? "the page has every row" : "run fault_matrix --output");
  return difference.empty() ? 0 : 1;
}

int run_program(int argc, char** argv) {
  CLI::App app{"Makes faults happen to the real daemon and writes what came of them"};
  Options options;
  options.programs = EMBODY_BINARY_DIR;
  app.add_option("--programs", options.programs, "Folder of embodyd")->capture_default_str();
  app.add_option("--output", options.output, "Write the page here");
  app.add_option("--check", options.check, "Run nothing: does this page have every row?");
  app.add_option("--only", options.only, "Only these rows");
  app.add_option("--runs", options.runs, "Most runs of a row while the machine is held up")->capture_default_str();
  app.add_flag("--quick", options.quick, "A short selection");
  app.add_flag("--list", options.list, "Only the names");
  app.add_flag("--log", options.log, "Print the daemon's log after each row");
  CLI11_PARSE(app, argc, argv);

  const std::vector<Group> groups = all_groups();
  if (options.list) {
    for (const Group& group : groups) {
      for (const Row& row : group.rows) std::printf("%-26s %s\n", row.name.c_str(), row.fault.c_str());
    }
    return 0;
  }
  if (!options.check.empty()) return check(options.check, groups);
  Matrix matrix;
  if (const Status done = run_all(groups, options, matrix); !done) {
    std::fprintf(stderr, "fault_matrix: %s\n", done.error().detail.c_str());
    return 1;
  }
  if (!options.output.empty()) std::ofstream(options.output) << print_page(matrix.sections, matrix.limits);
  std::printf("%s\n", matrix.kept ? "every rule was kept" : "a rule was broken");
  return matrix.kept ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run_program(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "fault_matrix: %s\n", error.what());
    return 1;
  }
}
