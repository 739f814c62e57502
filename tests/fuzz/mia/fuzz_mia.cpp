// Whatever comes over the serial line, neither end of the protocol crashes, and what is understood is within bounds.
#include <cmath>
#include <cstdint>
#include <cstdlib>

#include "drivers/mia/codec.hpp"
#include "drivers/sim/mia/device.hpp"

namespace {

using namespace embody;  // NOLINT(google-build-using-namespace): a harness of one function

void require(bool condition) {
  if (!condition) std::abort();
}

void feed_host(const std::uint8_t* data, std::size_t size) {
  mia::LineAssembler lines;
  const mia::Command command = mia::encode_plain(mia::kReadPositionsPayload);
  for (std::size_t i = 0; i < size; ++i) {
    if (!lines.push(static_cast<char>(data[i]))) continue;
    const std::string_view line = lines.line();
    require(!line.empty() && line.back() == '\n' && line.size() <= mia::LineAssembler::kCapacity);
    if (const auto counts = mia::parse_triple(line, mia::TripleLine::kPosition)) {
      for (const int c : *counts) require(std::abs(c) <= 999);
    }
    static_cast<void>(mia::parse_triple(line, mia::TripleLine::kSpeed));
    static_cast<void>(mia::parse_triple(line, mia::TripleLine::kCurrent));
    static_cast<void>(mia::parse_joint_positions(line));
    static_cast<void>(mia::parse_joint_speeds(line));
    static_cast<void>(mia::parse_strain_gauges(line));
    static_cast<void>(mia::parse_firmware_id(line));
    static_cast<void>(mia::acknowledges(line, command));
  }
}

void feed_device(const std::uint8_t* data, std::size_t size) {
  sim::MiaSimulatorConfig config;
  config.log_capacity = 16;
  config.half_duplex = size % 2 == 0;
  TimePoint now{std::chrono::seconds(1)};
  sim::MiaDevice hand(config, now);
  for (std::size_t i = 0; i < size; i += 18) {
    hand.receive({reinterpret_cast<const char*>(data + i), std::min<std::size_t>(18, size - i)}, now);
    now += std::chrono::milliseconds(3);
    require(hand.advance(now).size() < 4096);
    for (const double counts : hand.motor_counts()) require(std::abs(counts) <= mia::kMaxCounts);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  feed_host(data, size);
  feed_device(data, size);
  return 0;
}
