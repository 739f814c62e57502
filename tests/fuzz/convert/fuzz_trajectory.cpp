// Any text as a trajectory: refused with a sentence, or what was read can be written and read again.
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "daemon/convert/trajectory_csv.hpp"
#include "daemon/convert/trajectory_json.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace embody::convert;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  if (const auto csv = parse_csv(text, "fuzz"); !csv) {
    if (csv.error().detail.empty()) std::abort();
  } else if (!parse_csv(format_csv(*csv, '\t'), "again")) {
    std::abort();
  }
  if (const auto json = parse_json(text, "fuzz"); !json) {
    if (json.error().detail.empty()) std::abort();
  } else if (!parse_json(format_json(*json), "again")) {
    std::abort();
  }
  return 0;
}
