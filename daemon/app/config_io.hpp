#pragma once
// Configuration files: find, read, print, document. Everything here allocates; nothing runs on a real-time thread.
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.hpp"
#include "daemon/app/config.hpp"

namespace embody::config {

inline constexpr std::size_t kMaxConfigBytes = std::size_t{64} * 1024;  ///< of one file; a larger one is refused

/// The main configuration file: `given` (from --config) if not empty, else $EMBODY_CONFIG, /etc/embody/embody.toml,
/// <folder of the program>/../share/embody/embody.toml, the source tree's config/embody.toml. A file that is named but
/// missing is an error, not a reason to look further. Errors: kNotFound, with the places that were tried.
[[nodiscard]] Result<std::filesystem::path> find_config(const std::string& given);

/// Folders that hold the shipped data files, most important first; only those that exist.
[[nodiscard]] std::vector<std::filesystem::path> data_folders();

/// Reads a configuration file and the files that it includes. On failure the error is one sentence that starts with
/// FILE:LINE: (the first problem in the file, and how many more there are). Errors: kNotFound, kPermission, kMalformed.
[[nodiscard]] Result<EmbodyConfig> load_config(const std::filesystem::path& path);

/// The same for text in memory. `name` stands for the file in messages; relative paths start at `folder`.
[[nodiscard]] Result<EmbodyConfig> parse_config(std::string_view text, const std::string& name,
                                                const std::filesystem::path& folder);

/// A subject file alone, with defaults for what it does not name: what `[subject] file = PATH` means. Errors as
/// load_config().
[[nodiscard]] Result<SubjectConfig> load_subject(const std::filesystem::path& path);

/// A hand file: by its path, or by the name of one that is shipped ("mia"). Errors as load_config(), kNotFound.
[[nodiscard]] Result<HandConfig> load_hand(const std::string& name);

/// The text of a subject file: load_subject() of it gives the same values.
[[nodiscard]] std::string print_toml(const SubjectConfig& subject);

/// Every key with its value, as TOML without includes: load_config() of this text gives the same values.
[[nodiscard]] std::string print_toml(const EmbodyConfig& config);

/// The reference of all keys (docs/config.md).
[[nodiscard]] std::string document_config();

/// Unit that a key name ends in, for people: "m/s" for `speed_m_s`, "" for a number without unit.
[[nodiscard]] std::string_view unit_of(std::string_view key) noexcept;

/// A key and the table that it belongs to ("" for the top).
struct KeyName {
  std::string table;
  std::string key;
};
[[nodiscard]] const std::vector<KeyName>& all_keys();

}  // namespace embody::config
