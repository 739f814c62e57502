#pragma once
// One of the files that a configuration includes, on its own. Internal to parsing.
#include <filesystem>

#include "core/base/result.hpp"

namespace embody::config {

/// T is SubjectConfig or HandConfig, with defaults for what the file does not name. Errors as load_config().
template <class T>
[[nodiscard]] Result<T> load_part(const std::filesystem::path& path);

}  // namespace embody::config
