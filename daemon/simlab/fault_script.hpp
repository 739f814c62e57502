#pragma once
// Faults of the lab at given times: a text, read whole before anything starts. Pure functions over text.
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.hpp"
#include "core/base/time.hpp"

namespace embody::sim {

inline constexpr std::size_t kMostScriptBytes = std::size_t{64} * 1024;
inline constexpr std::size_t kMostScriptLines = 1000;

struct ScriptedFault {
  Duration at{0};       ///< since the start of the playback
  std::string command;  ///< the device, a blank, and the words of its simulator
  std::size_t line{0};  ///< in the file, from 1
};

/// Reads lines "AT_SECONDS DEVICE FAULT..."; a '#' in front makes a comment, blank lines count for nothing. The result
/// is in the order of time, of equal times in that of the file; so is `check` called. Error kMalformed, "NAME:LINE:"
/// and what is wrong: the grammar, a control character, what `check` says, more than 1000 lines, more than 64 KiB (no
/// line).
[[nodiscard]] Result<std::vector<ScriptedFault>> parse_script(
    std::string_view text, const std::string& name, const std::function<Status(std::string_view command)>& check);

/// Reads such a file. Errors: also kNotFound, kPermission, kIo, kInvalidArgument (a folder, a pipe).
[[nodiscard]] Result<std::vector<ScriptedFault>> load_script(
    const std::string& path, const std::function<Status(std::string_view command)>& check);

/// What is due of a script.
class ScriptReader {
 public:
  explicit ScriptReader(std::vector<ScriptedFault> faults = {}) : faults_(std::move(faults)) {}

  /// The next fault whose time has come, at `since_play`; null when there is none. Valid as long as the reader.
  [[nodiscard]] const ScriptedFault* take(Duration since_play) noexcept;
  /// Time of the next fault; Duration::max() at the end.
  [[nodiscard]] Duration next() const noexcept;
  [[nodiscard]] std::size_t done() const noexcept { return done_; }
  [[nodiscard]] std::size_t size() const noexcept { return faults_.size(); }

 private:
  std::vector<ScriptedFault> faults_;
  std::size_t done_{0};
};

}  // namespace embody::sim
