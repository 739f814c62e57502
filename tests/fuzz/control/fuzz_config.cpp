// Any text as a configuration file. What is accepted prints to text that is accepted and means the same.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "daemon/app/config_io.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace embody::config;
  // With this start most inputs reach the keys.
  const std::string text = "schema = 1\n" + std::string(reinterpret_cast<const char*>(data), size);
  const auto config = parse_config(text, "fuzz.toml", "/nonexistent");
  if (!config) {
    if (config.error().detail.empty()) std::abort();
    return 0;
  }
  const std::string printed = print_toml(*config);
  const auto again = parse_config(printed, "printed.toml", "/nonexistent");
  if (!again || print_toml(*again) != printed) std::abort();
  return 0;
}
