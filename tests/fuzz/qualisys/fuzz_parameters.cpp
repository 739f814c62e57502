// Any text: refused with a sentence, or labels that are distinct, bounded and not empty.
#include <algorithm>
#include <cstdint>
#include <cstdlib>

#include "drivers/qualisys/codec.hpp"
#include "drivers/qualisys/parameters.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace embody::qualisys;
  const auto parameters = parse_parameters({reinterpret_cast<const char*>(data), size});
  if (!parameters) {
    if (parameters.error().detail.empty()) std::abort();
    return 0;
  }
  auto labels = parameters->labels;
  if (labels.size() > kMaxDataMarkers) std::abort();
  for (const auto& label : labels) {
    if (label.empty() || label.size() > kMaxNameLength) std::abort();
  }
  std::sort(labels.begin(), labels.end());
  if (std::adjacent_find(labels.begin(), labels.end()) != labels.end()) std::abort();
  return 0;
}
