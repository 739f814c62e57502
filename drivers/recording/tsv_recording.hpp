#pragma once
// Motion export of Qualisys Track Manager as tab-separated text
// (docs.qualisys.com, QTM user manual, "Motion data (.tsv)").
// Parser and writer are pure functions of text; two thin functions touch files.
#include <string>
#include <string_view>

#include "core/base/result.hpp"
#include "drivers/recording/recording.hpp"

namespace embody::recording {

/// Largest file that load_tsv() accepts.
inline constexpr std::size_t kMaxTsvBytes = std::size_t{2} << 30;

/// Reads a 3D export: header lines `KEY<tab>value`, an optional column line, rows of millimetres with or without the
/// Frame and Time columns, LF or CRLF, trailing tabs. A marker is missing when all three coordinates are `nan`, `null`,
/// empty or zero. `source` names the text in errors and in the result. Errors are one sentence with source, line and
/// column or marker: kMalformed (not such a file), kTruncated (fewer rows than announced, or the last line is cut).
[[nodiscard]] Result<Recording> parse_tsv(std::string_view text, std::string_view source);

/// Writes the same dialect: CRLF, Frame and Time columns, `%.3f` mm, missing markers as `nan`. A visible marker closer
/// than 0.5 um to the origin on all axes would read as missing. Errors: kInvalidArgument, when the recording breaks
/// its own invariants (rate, names, marker counts, finite positions).
[[nodiscard]] Result<std::string> format_tsv(const Recording& recording);

/// parse_tsv() of a file. Errors: also kNotFound, kPermission, kIo; kUnsupported beyond kMaxTsvBytes.
[[nodiscard]] Result<Recording> load_tsv(const std::string& path);

/// format_tsv() into a file, replacing it. Errors: also kIo.
[[nodiscard]] Status save_tsv(const Recording& recording, const std::string& path);

}  // namespace embody::recording
