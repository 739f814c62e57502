// Whatever comes in a datagram, the codec does not crash; what it accepts is in range and encodes to the same bytes.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>

#include "drivers/landmarks/codec.hpp"

namespace {

using namespace embody::landmarks;  // NOLINT(google-build-using-namespace): a harness of one function

void require(bool condition) {
  if (!condition) std::abort();
}

void check(std::span<const std::byte> bytes) {
  const auto frame = decode(bytes);
  if (!frame) return require(!frame.error().detail.empty());
  require(frame->t_capture_ns >= 0);
  for (const auto& landmark : frame->landmarks) {
    for (const float x : landmark.p_W) require(std::isfinite(x) && std::abs(x) <= kFarthestMetres);
    require(landmark.confidence >= 0.0F && landmark.confidence <= 1.0F);
  }
  const auto again = encode(*frame);
  require(again.size() == bytes.size() && std::equal(bytes.begin(), bytes.end(), again.begin()));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::span bytes(reinterpret_cast<const std::byte*>(data), size);
  check(bytes);
  // The same bytes behind a good header, so that most inputs get past it.
  auto framed = encode(LandmarkFrame{});
  std::copy_n(bytes.begin(), std::min(size, framed.size() - 8), framed.begin() + 8);
  check(framed);
  return 0;
}
