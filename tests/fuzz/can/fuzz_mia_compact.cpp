// Whatever frames come, neither end of the profile "compact" crashes, and the simulated hand stays within its range.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>

#include "drivers/mia/compact/codec.hpp"
#include "drivers/mia/compact/state_watch.hpp"
#include "drivers/sim/mia/can_compact_hand.hpp"

namespace {

using namespace embody;  // NOLINT(google-build-using-namespace): a harness of one function
using mia::compact::Verdict;

void require(bool condition) {
  if (!condition) std::abort();
}

void feed_host(const mia::compact::Ids& ids, const transport::CanFrame& frame, mia::compact::StateWatch& watch) {
  std::size_t motor = 99;
  mia::compact::State state;
  if (decode(ids, frame, motor, state) == Verdict::kGood) {
    require(motor < mia::kMotors && std::abs(state.counts) <= 2 * mia::kMaxCounts);
    watch.take(motor, state, frame.t_arrival);
  }
  mia::compact::Ack ack;
  if (decode(ids, frame, ack) == Verdict::kGood) require(ack.motor <= mia::compact::kAllMotors);
  mia::compact::Forces forces;
  if (decode(ids, frame, forces) == Verdict::kGood) {
    for (const auto raw : forces.raw) require(raw <= 1023);
    require(encode(ids, forces).data == frame.data);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const mia::compact::Ids ids;
  TimePoint now{std::chrono::seconds(1)};
  sim::CompactHand hand({}, now);
  mia::compact::StateWatch watch;
  watch.reset(now);
  for (std::size_t i = 0; i + 10 <= size; i += 10) {  // offset, length with a bit that repairs the CRC, eight bytes
    transport::CanFrame frame;
    frame.id = ids.at(data[i] % 0x24);
    frame.size = data[i + 1] % 9;
    std::memcpy(frame.data.data(), data + i + 2, 8);
    if ((data[i + 1] & 0x80) != 0) {
      frame.size = 8;
      frame.data[7] = mia::compact::crc8(std::span(frame.data).first<7>());
    }
    frame.t_arrival = now;
    feed_host(ids, frame, watch);
    hand.receive(frame, now);
    now += std::chrono::milliseconds(data[i + 1] & 0x3F);
    for (const transport::CanFrame& said : hand.advance(now)) {
      require(said.size == 8);
      feed_host(ids, said, watch);
    }
    for (const double counts : hand.motor_counts()) require(std::abs(counts) <= mia::kMaxCounts);
  }
  return 0;
}
