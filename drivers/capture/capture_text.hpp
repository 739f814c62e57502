#pragma once
// Capture files as text: JSON lines, a header and then one line per chunk. Pure functions.
#include <span>
#include <string>
#include <string_view>

#include "core/base/result.hpp"
#include "drivers/capture/capture.hpp"

namespace embody::capture {

/// One line with its LF. Texts are cut at kMaxHeaderText bytes, and get '?' for what is no UTF-8.
[[nodiscard]] std::string header_line(const Header& header);
/// Appends one line with its LF. `bytes` stand in place of `chunk.bytes`. @pre at most kMaxChunkBytes
void append_chunk_line(const Chunk& chunk, std::span<const std::byte> bytes, std::string& text);
[[nodiscard]] std::string capture_text(const Capture& capture);

/// A whole capture. It is strict: unknown, missing or repeated names, values out of range, time that goes back,
/// connections that are not open, bytes of an end that has closed, and a last line without LF are kMalformed, with the
/// number of the line; another version is kUnsupported.
[[nodiscard]] Result<Capture> parse_capture(std::string_view text);

/// Reads a file of at most kMaxCaptureBytes. Errors: those of transport::load_text() and parse_capture(), with the
/// name.
[[nodiscard]] Result<Capture> load_capture(const std::string& path);

}  // namespace embody::capture
