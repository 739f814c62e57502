#pragma once
// Files that a command writes: whole or not at all.
#include <string>

#include "core/base/result.hpp"

namespace embody::ctl {

/// Writes `text` beside `path` and puts it there in one step. Errors: kRefused (`path` exists and `overwrite` is
/// false), kPermission, kNotFound (no such folder), kIo.
[[nodiscard]] Status save_text(const std::string& text, const std::string& path, bool overwrite);

/// Before long work: would save_text() to `path` be refused as things are? Errors as save_text().
[[nodiscard]] Status check_output(const std::string& path, bool overwrite);

}  // namespace embody::ctl
