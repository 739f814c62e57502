// Any line that a client may send, and any line that a client may receive.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "daemon/control/protocol.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace embody::control;
  const std::string_view line(reinterpret_cast<const char*>(data), size);
  if (const auto request = parse_request(line)) {
    // What was accepted can be sent again and means the same.
    const auto again = parse_request(format_request(*request));
    if (!again || again->command != request->command || again->id != request->id) std::abort();
  }
  if (const auto response = parse_response(line)) {
    const auto again = parse_response(format_response(*response, {}));
    if (!again || again->ok != response->ok) std::abort();
  }
  const std::string framed = format_response({true, std::string(line), "", ""}, 1);
  if (framed.find('\n') != framed.size() - 1) std::abort();  // exactly one line
  return 0;
}
