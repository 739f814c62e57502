#pragma once
// Whole files: read with a bound, written whole or not at all.
#include <string>
#include <string_view>

#include "core/base/result.hpp"

namespace embody::transport {

/// The content of a file of at most `most_bytes`; never waits on a pipe or device. `what` is the kind of file that is
/// expected, like "a QTM motion export (.tsv)", for the sentence that says why not. Errors: kNotFound, kPermission,
/// kIo, kInvalidArgument (a folder, a pipe, ...), kUnsupported (larger).
[[nodiscard]] Result<std::string> load_text(const std::string& path, std::size_t most_bytes, const char* what);

/// Writes `text` beside `path` and puts it there in one step; through a symbolic link to where it points. What is no
/// file (a pipe, /dev/stdout) is written to as it stands. Errors: kRefused (`path` exists and `overwrite` is false),
/// kInvalidArgument (no name, a folder), kPermission, kNotFound (no such folder), kIo.
[[nodiscard]] Status save_text(std::string_view text, const std::string& path, bool overwrite);

/// Before long work: would save_text() to `path` be refused as things are? Errors as save_text().
[[nodiscard]] Status check_output(const std::string& path, bool overwrite);

}  // namespace embody::transport
