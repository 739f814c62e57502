// Any text as segment metadata, and as the events of an export: refused with a sentence, or segments that can be.
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "daemon/convert/segments.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace embody::convert;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  for (const auto& segments :
       {parse_segments(text, "fuzz", 1), parse_segments(text, "fuzz", 2), parse_event_segments(text, "fuzz")}) {
    if (!segments && segments.error().detail.empty()) std::abort();
    for (std::size_t i = 0; segments && i < segments->size(); ++i) {
      if ((*segments)[i].first < 1 || (*segments)[i].last < (*segments)[i].first) std::abort();
    }
  }
  return 0;
}
