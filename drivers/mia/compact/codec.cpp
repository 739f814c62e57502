#include "drivers/mia/compact/codec.hpp"

#include <algorithm>
#include <cstdlib>

namespace embody::mia::compact {
namespace {

constexpr std::uint8_t kPolynomial = 0x2F;
constexpr std::size_t kCrcByte = 7;
constexpr unsigned kGaugeBits = 10;
constexpr unsigned kGaugeMax = (1u << kGaugeBits) - 1;

constexpr std::array<std::uint8_t, 256> make_table() noexcept {
  std::array<std::uint8_t, 256> table{};
  for (unsigned i = 0; i < table.size(); ++i) {
    unsigned value = i;
    for (int bit = 0; bit < 8; ++bit) value = (value & 0x80) != 0 ? (value << 1) ^ kPolynomial : value << 1;
    table[i] = static_cast<std::uint8_t>(value);
  }
  return table;
}
constexpr auto kTable = make_table();

std::uint16_t word(const CanFrame& frame, std::size_t at) noexcept {
  return static_cast<std::uint16_t>(frame.data[at] | frame.data[at + 1] << 8);
}

void put_word(CanFrame& frame, std::size_t at, std::uint16_t value) noexcept {
  frame.data[at] = static_cast<std::uint8_t>(value & 0xFF);
  frame.data[at + 1] = static_cast<std::uint8_t>(value >> 8);
}

CanFrame blank(CanId id) noexcept {
  CanFrame frame;
  frame.id = id;
  frame.size = 8;
  return frame;
}

CanFrame sealed(CanFrame frame) noexcept {
  frame.data[kCrcByte] = crc8(std::span(frame.data).first<kCrcByte>());
  return frame;
}

bool intact(const CanFrame& frame) noexcept {
  return frame.size == 8 && crc8(std::span(frame.data).first<kCrcByte>()) == frame.data[kCrcByte];
}

/// Offset of the frame's identifier, beyond kLastId for a foreign one.
std::uint32_t offset(const Ids& ids, const CanFrame& frame) noexcept {
  if (frame.id.extended != ids.base.extended || frame.id.value < ids.base.value) return kLastId + 1;
  return frame.id.value - ids.base.value;
}

bool all_zero(const CanFrame& frame, std::size_t first, std::size_t last) noexcept {
  return std::all_of(frame.data.begin() + static_cast<std::ptrdiff_t>(first),
                     frame.data.begin() + static_cast<std::ptrdiff_t>(last) + 1, [](std::uint8_t b) { return b == 0; });
}

}  // namespace

std::uint8_t crc8(std::span<const std::uint8_t> bytes) noexcept {
  std::uint8_t crc = 0xFF;
  for (const std::uint8_t byte : bytes) crc = kTable[crc ^ byte];
  return crc ^ 0xFF;
}

CanFrame encode(const Ids& ids, const Command& command) noexcept {
  const std::uint8_t motor = std::min(command.motor, kAllMotors);
  CanFrame frame = blank(ids.at(kCommandId + motor));
  frame.data[0] = static_cast<std::uint8_t>(command.opcode);
  frame.data[1] = motor;
  put_word(frame, 2, static_cast<std::uint16_t>(command.value));
  frame.data[4] = command.speed_percent;
  frame.data[5] = command.current_percent;
  frame.data[6] = command.counter;
  return sealed(frame);
}

Verdict decode(const Ids& ids, const CanFrame& frame, Command& command) noexcept {
  const std::uint32_t motor = offset(ids, frame) - kCommandId;
  if (motor > kAllMotors) return Verdict::kForeign;
  if (!intact(frame) || frame.data[0] >= kOpcodes || frame.data[1] != motor) return Verdict::kDamaged;
  command.opcode = static_cast<Opcode>(frame.data[0]);
  command.motor = frame.data[1];
  command.value = static_cast<std::int16_t>(word(frame, 2));
  command.speed_percent = frame.data[4];
  command.current_percent = frame.data[5];
  command.counter = frame.data[6];
  return Verdict::kGood;
}

CanFrame encode(const Ids& ids, const Ack& ack) noexcept {
  CanFrame frame = blank(ids.at(kAckId));
  frame.data[0] = static_cast<std::uint8_t>(ack.opcode);
  frame.data[1] = ack.motor;
  frame.data[2] = static_cast<std::uint8_t>(ack.status);
  frame.data[3] = ack.counter;
  return sealed(frame);
}

Verdict decode(const Ids& ids, const CanFrame& frame, Ack& ack) noexcept {
  if (offset(ids, frame) != kAckId) return Verdict::kForeign;
  if (!intact(frame) || frame.data[0] >= kOpcodes || frame.data[1] > kAllMotors || frame.data[2] >= kAckStatuses ||
      !all_zero(frame, 4, 6)) {
    return Verdict::kDamaged;
  }
  ack = {static_cast<Opcode>(frame.data[0]), frame.data[1], static_cast<AckStatus>(frame.data[2]), frame.data[3]};
  return Verdict::kGood;
}

CanFrame encode(const Ids& ids, std::size_t motor, const State& state) noexcept {
  CanFrame frame = blank(ids.at(kStateId + static_cast<std::uint32_t>(motor)));
  put_word(frame, 0, static_cast<std::uint16_t>(state.counts));
  put_word(frame, 2, static_cast<std::uint16_t>(state.speed));
  put_word(frame, 4, state.current);
  frame.data[6] = state.flags;
  frame.data[7] = state.counter;
  return frame;
}

Verdict decode(const Ids& ids, const CanFrame& frame, std::size_t& motor, State& state) noexcept {
  const std::uint32_t number = offset(ids, frame) - kStateId;  // wraps to something large below kStateId
  if (number >= kMotors) return Verdict::kForeign;
  const auto counts = static_cast<std::int16_t>(word(frame, 0));
  if (frame.size != 8 || std::abs(counts) > 2 * kMaxCounts) return Verdict::kDamaged;
  motor = number;
  state = {counts, static_cast<std::int16_t>(word(frame, 2)), word(frame, 4), frame.data[6], frame.data[7]};
  return Verdict::kGood;
}

CanFrame encode(const Ids& ids, const Forces& forces) noexcept {
  CanFrame frame = blank(ids.at(kForcesId));
  std::uint64_t bits = std::uint64_t{forces.counter & 0xFu} << (kGaugeBits * kStrainGauges);
  for (std::size_t i = 0; i < kStrainGauges; ++i) {
    bits |= std::uint64_t{std::min<unsigned>(forces.raw[i], kGaugeMax)} << (kGaugeBits * i);
  }
  for (std::size_t i = 0; i < 8; ++i) frame.data[i] = static_cast<std::uint8_t>(bits >> (8 * i));
  return frame;
}

Verdict decode(const Ids& ids, const CanFrame& frame, Forces& forces) noexcept {
  if (offset(ids, frame) != kForcesId) return Verdict::kForeign;
  if (frame.size != 8) return Verdict::kDamaged;
  std::uint64_t bits = 0;
  for (std::size_t i = 0; i < 8; ++i) bits |= std::uint64_t{frame.data[i]} << (8 * i);
  for (std::size_t i = 0; i < kStrainGauges; ++i) {
    forces.raw[i] = static_cast<std::uint16_t>((bits >> (kGaugeBits * i)) & kGaugeMax);
  }
  forces.counter = static_cast<std::uint8_t>(bits >> (kGaugeBits * kStrainGauges));
  return Verdict::kGood;
}

CanFrame encode(const Ids& ids, const Heartbeat& heartbeat) noexcept {
  CanFrame frame = blank(ids.at(kHeartbeatId));
  frame.data[0] = heartbeat.may_move ? 1 : 0;
  frame.data[6] = heartbeat.counter;
  return sealed(frame);
}

Verdict decode(const Ids& ids, const CanFrame& frame, Heartbeat& heartbeat) noexcept {
  if (offset(ids, frame) != kHeartbeatId) return Verdict::kForeign;
  if (!intact(frame) || frame.data[0] > 1 || !all_zero(frame, 1, 5)) return Verdict::kDamaged;
  heartbeat = {frame.data[0] == 1, frame.data[6]};
  return Verdict::kGood;
}

}  // namespace embody::mia::compact
