// Any datagram: refused with a sentence, or one line of printable text and a port with room for those derived from it.
#include <algorithm>
#include <cstdint>
#include <cstdlib>

#include "drivers/qualisys/discovery.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace embody::qualisys;
  const auto reply = decode_discovery_reply(std::as_bytes(std::span(data, size)));
  if (!reply) {
    if (reply.error().detail.empty()) std::abort();
    return 0;
  }
  if (reply->base_port == 0 || reply->base_port > 65'533 || reply->info.size() + 11 != size) std::abort();
  if (!std::all_of(reply->info.begin(), reply->info.end(), [](char c) { return c >= ' ' && c <= '~'; })) std::abort();
  return 0;
}
