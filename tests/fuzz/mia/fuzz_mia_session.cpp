// Whatever lines a hand sends, the parts of the driver that keep a session stay within their bounds; whatever fault
// somebody asks the simulated hand for, it keeps its shape.
#include <cmath>
#include <cstdint>
#include <cstdlib>

#include "drivers/mia/exchange.hpp"
#include "drivers/mia/grasp_codec.hpp"
#include "drivers/mia/motion_watch.hpp"
#include "drivers/mia/telemetry.hpp"
#include "drivers/sim/mia/device.hpp"

namespace {

using namespace embody;  // NOLINT(google-build-using-namespace): a harness of one function
using std::chrono::milliseconds;

void require(bool condition) {
  if (!condition) std::abort();
}

constexpr Duration kTimeout = milliseconds(20);
constexpr std::array<mia::Purpose, 4> kReads{mia::Purpose::kPositions, mia::Purpose::kJointPositions,
                                             mia::Purpose::kCurrents, mia::Purpose::kForces};
constexpr std::array<char, 4> kChannels{'P', 'J', 'C', 'A'};

void feed_session(const std::uint8_t* data, std::size_t size) {
  mia::LineAssembler lines;
  mia::Exchange exchange;
  mia::TelemetryConfig config;
  config.every_cycles = 1;
  mia::TelemetryReader telemetry(config);
  mia::MotionWatch watch(60);
  TimePoint now{std::chrono::seconds(1)};
  watch.begin({0.0, 0.0, 0.0}, now);
  for (std::size_t i = 0; i < size; ++i) {
    now += milliseconds(data[i] % 4);
    if (!exchange.busy()) {
      const std::size_t which = data[i] % kReads.size();
      exchange.start({.command = mia::encode_read(kChannels[which]), .purpose = kReads[which]}, now, kTimeout);
    }
    if (lines.push(static_cast<char>(data[i]))) {
      const std::string_view line = lines.line();
      static_cast<void>(mia::parse_grasp_references(line));
      if (exchange.take_line(line, now) == mia::Exchange::Event::kData) require(!exchange.busy());
      telemetry.take(line, now);
      if (const auto counts = mia::parse_triple(line, mia::TripleLine::kPosition)) {
        static_cast<void>(watch.take({1.0 * (*counts)[0], 1.0 * (*counts)[1], 1.0 * (*counts)[2]}, now));
      }
    }
    if (exchange.take_time(now) == mia::Exchange::Event::kTimedOut && !exchange.retry(now)) exchange.resynchronise(now);
    require(!exchange.busy() || exchange.deadline() <= now + 3 * kTimeout);
  }
  for (const int value : telemetry.data().strain) require(std::abs(value) <= 9999);
}

/// Each line is a fault by name, the bytes behind it are commands.
void feed_faults(const std::uint8_t* data, std::size_t size) {
  sim::MiaSimulatorConfig config = size % 2 == 0 ? sim::older_mia() : sim::MiaSimulatorConfig{};
  config.log_capacity = 16;
  TimePoint now{std::chrono::seconds(1)};
  sim::MiaDevice hand(config, now);
  std::string_view rest(reinterpret_cast<const char*>(data), size);
  while (!rest.empty()) {
    const std::string_view text = rest.substr(0, std::min(rest.find('\n'), rest.size()));
    rest.remove_prefix(std::min(text.size() + 1, rest.size()));
    if (!hand.fault(text, now)) hand.receive(text, now);
    now += milliseconds(7);
    require(hand.advance(now).size() < 200'000);
    for (const double counts : hand.motor_counts()) require(std::abs(counts) <= mia::kMaxCounts);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  feed_session(data, size);
  feed_faults(data, size);
  return 0;
}
