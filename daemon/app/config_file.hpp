#pragma once
// Files of the configuration: bounded reading and the search for data files.
#include <filesystem>
#include <string>

#include "core/base/result.hpp"

namespace embody::config {

/// Whole content of a regular file of at most kMaxConfigBytes. Errors: kNotFound, kPermission, kMalformed, kIo.
[[nodiscard]] Result<std::string> read_file(const std::filesystem::path& path);

/// `name` itself when absolute, else the first of folder/name and data_folders()/name that exists. Error: kNotFound.
[[nodiscard]] Result<std::filesystem::path> find_data_file(const std::string& name,
                                                           const std::filesystem::path& folder);

/// A path that leaves room for a message: only its end when it is longer than 100 bytes.
[[nodiscard]] std::string shorten_path(const std::string& path);

}  // namespace embody::config
