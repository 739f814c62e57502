// Any text: the parser refuses it, or what it returns can be written and read back.
#include <cstdint>
#include <cstdlib>

#include "drivers/recording/tsv_recording.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace embody::recording;
  const auto recording = parse_tsv({reinterpret_cast<const char*>(data), size}, "fuzz");
  if (!recording) return 0;
  for (const auto& frame : recording->frames) {
    if (frame.size() != recording->marker_names.size()) std::abort();
  }
  const auto text = format_tsv(*recording);
  if (!text) return 0;  // names with control characters, for one
  const auto again = parse_tsv(*text, "again");
  if (!again || again->frames.size() != recording->frames.size()) std::abort();
  return 0;
}
