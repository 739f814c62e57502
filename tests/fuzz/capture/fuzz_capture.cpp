// Any text: refused with a sentence that names its line, or a capture that is the same after writing and reading it.
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "drivers/capture/capture_text.hpp"
#include "drivers/capture/isotp_messages.hpp"

namespace {

/// What was read is valid UTF-8 and short enough: writing changes nothing.
bool same(const embody::capture::Header& a, const embody::capture::Header& b) {
  return a.link == b.link && a.utc_start == b.utc_start && a.peer == b.peer && a.program == b.program;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace embody::capture;
  const auto capture = parse_capture({reinterpret_cast<const char*>(data), size});
  if (!capture) {
    if (!capture.error().detail.view().starts_with("line ")) std::abort();
    return 0;
  }
  for (const Chunk& chunk : capture->chunks) {
    if (chunk.bytes.size() > kMaxChunkBytes || chunk.connection == 0) std::abort();
  }
  static_cast<void>(join_isotp(*capture));
  const auto again = parse_capture(capture_text(*capture));
  if (!again || again->chunks != capture->chunks || !same(again->header, capture->header)) std::abort();
  return 0;
}
