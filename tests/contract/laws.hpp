#pragma once
// What the contracts of all device interfaces share: the device's side of a test, and the laws about time and words.
#include <gtest/gtest.h>

#include <functional>
#include <random>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.hpp"
#include "core/base/time.hpp"
#include "core/hal/device.hpp"

namespace embody::test {

inline constexpr unsigned kContractSeed = 20;
inline constexpr Duration kPatience = std::chrono::seconds(5);      ///< for what has no bound of its own
inline constexpr Duration kSlack = std::chrono::milliseconds(700);  ///< added to every bound: the machine is busy
inline constexpr Duration kLongestConnect = std::chrono::seconds(6);

/// A driver's settings: as delivered, or such that a busy machine does not end sessions in tests of other things.
enum class Pace { kDelivered, kPatient };

/// A simulated device and the line to it. All functions from the test's thread.
class Cell {
 public:
  Cell() = default;
  Cell(const Cell&) = delete;
  Cell& operator=(const Cell&) = delete;
  virtual ~Cell() = default;

  /// The line breaks so that both ends see it. After that nobody can connect.
  virtual void cut() = 0;
  /// The line is whole again for the next connection, and the device speaks again.
  virtual void restore() = 0;
  /// The device says nothing any more; the line stays.
  virtual void hush() = 0;
  /// The driver hears rubbish.
  virtual void babble(std::mt19937& random) = 0;

  Duration hang_up_bound{0};  ///< after cut() the session is over within this, with the settings as delivered
  Duration silence_bound{0};  ///< after hush()
  bool reads_in_place{true};  ///< read() takes no heap
  bool writes_in_place{true};
  std::string no_line;  ///< why there is no line that could be cut; empty: there is one
};

/// Random bytes, 1 to `most` of them.
[[nodiscard]] std::vector<std::byte> rubbish(std::mt19937& random, std::size_t most);
/// A path that no other test process uses.
[[nodiscard]] std::string unique_path(const std::string& name);
/// Waits until `done`; false after `limit`.
[[nodiscard]] bool eventually(const std::function<bool()>& done, Duration limit = kPatience);

/// Text for a person: some words in one line.
void expect_sentence(std::string_view text);

/// What many calls in a row took.
struct Effort {
  Duration time{0};
  std::uint64_t allocations{0};
};
[[nodiscard]] Effort effort_of(const std::function<void()>& calls);

/// `connect` succeeds. It has a second try, as in the daemon: a busy machine may miss the time of one answer. What was
/// wrong with the first one is printed.
void expect_recovery(const std::function<Status()>& connect);

/// `connect` fails with a sentence, soon enough.
void expect_absent(const std::function<Status()>& connect);

}  // namespace embody::test
