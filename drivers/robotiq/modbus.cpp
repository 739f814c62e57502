#include "drivers/robotiq/modbus.hpp"

#include <algorithm>

namespace embody::modbus {
namespace {

constexpr std::uint8_t kExceptionBit = 0x80;
constexpr std::size_t kHeader = 2;  ///< slave, function
constexpr std::size_t kCrc = 2;

/// Writes a frame; appends the CRC last.
class Writer {
 public:
  Writer(std::uint8_t slave, std::uint8_t function) noexcept {
    byte(slave);
    byte(function);
  }
  void byte(unsigned value) noexcept {
    if (frame_.size < Frame::kCapacity) frame_.bytes[frame_.size++] = static_cast<std::byte>(value);
  }
  void word(unsigned value) noexcept {
    byte(value >> 8);
    byte(value & 0xFF);
  }
  void words(const std::array<std::uint16_t, kMaxRegisters>& values, std::size_t count) noexcept {
    byte(static_cast<unsigned>(2 * count));
    for (std::size_t i = 0; i < std::min(count, kMaxRegisters); ++i) word(values[i]);
  }
  Frame finish() noexcept {
    const std::uint16_t crc = crc16(frame_.view());
    byte(crc & 0xFFU);
    byte(crc >> 8U);
    return frame_;
  }

 private:
  Frame frame_;
};

std::uint8_t byte_at(std::span<const std::byte> bytes, std::size_t i) noexcept {
  return std::to_integer<std::uint8_t>(bytes[i]);
}

std::uint16_t word_at(std::span<const std::byte> bytes, std::size_t i) noexcept {
  return static_cast<std::uint16_t>((byte_at(bytes, i) << 8) | byte_at(bytes, i + 1));
}

bool crc_fits(std::span<const std::byte> frame) noexcept {
  const std::uint16_t crc = crc16(frame.first(frame.size() - kCrc));
  return byte_at(frame, frame.size() - 2) == (crc & 0xFF) && byte_at(frame, frame.size() - 1) == crc >> 8;
}

bool reads(Function function) noexcept {
  return function == Function::kReadHolding || function == Function::kReadInput ||
         function == Function::kReadWriteMultiple;
}

std::uint8_t code(Function function) noexcept {
  return static_cast<std::uint8_t>(function);
}

/// Complete when there are `size` bytes; then the CRC decides.
Match complete(std::span<const std::byte> bytes, std::size_t size) noexcept {
  if (bytes.size() < size) return Match::kNeedMore;
  return crc_fits(bytes.first(size)) ? Match::kWhole : Match::kNone;
}

/// The first bytes of `bytes` are those of `expected`, as far as there are any.
bool begins_like(std::span<const std::byte> bytes, std::span<const std::byte> expected) noexcept {
  const std::size_t n = std::min(bytes.size(), expected.size());
  return std::equal(expected.begin(), expected.begin() + static_cast<std::ptrdiff_t>(n), bytes.begin());
}

void read_words(std::span<const std::byte> bytes, std::size_t at, std::size_t count,
                std::array<std::uint16_t, kMaxRegisters>& values) noexcept {
  for (std::size_t i = 0; i < count; ++i) values[i] = word_at(bytes, at + 2 * i);
}

bool countable(std::uint16_t count) noexcept {
  return count >= 1 && count <= kMaxRegisters;
}

}  // namespace

std::uint16_t crc16(std::span<const std::byte> bytes) noexcept {
  std::uint16_t crc = 0xFFFF;
  for (const std::byte b : bytes) {
    crc = static_cast<std::uint16_t>(crc ^ std::to_integer<std::uint16_t>(b));
    for (int bit = 0; bit < 8; ++bit) crc = static_cast<std::uint16_t>((crc >> 1) ^ ((crc & 1) != 0 ? 0xA001 : 0));
  }
  return crc;
}

Request read_request(std::uint8_t slave, Function function, std::uint16_t address, std::uint16_t count) {
  Request request;
  request.slave = slave;
  request.function = function;
  request.read_address = address;
  request.read_count = count;
  return request;
}

Request write_request(std::uint8_t slave, std::uint16_t address, std::span<const std::uint16_t> values) {
  Request request;
  request.slave = slave;
  request.function = Function::kWriteMultiple;
  request.write_address = address;
  const std::size_t count = std::min(values.size(), kMaxRegisters);
  request.write_count = static_cast<std::uint16_t>(count);
  std::copy_n(values.begin(), count, request.values.begin());
  return request;
}

Frame encode_request(const Request& request) noexcept {
  Writer out(request.slave, code(request.function));
  if (reads(request.function)) {
    out.word(request.read_address);
    out.word(request.read_count);
  }
  if (request.function == Function::kWriteSingle) {
    out.word(request.write_address);
    out.word(request.values[0]);
  } else if (request.write_count > 0) {
    out.word(request.write_address);
    out.word(request.write_count);
    out.words(request.values, request.write_count);
  }
  return out.finish();
}

Frame encode_reply(const Request& request, const Reply& reply) noexcept {
  if (reply.exception != 0) {
    Writer out(request.slave, code(request.function) | kExceptionBit);
    out.byte(reply.exception);
    return out.finish();
  }
  Writer out(request.slave, code(request.function));
  if (reads(request.function)) {
    out.words(reply.values, request.read_count);
  } else {
    out.word(request.write_address);
    out.word(request.function == Function::kWriteSingle ? request.values[0] : request.write_count);
  }
  return out.finish();
}

Match match_reply(std::span<const std::byte> bytes, const Request& request, Reply& reply, std::size_t& size) noexcept {
  const auto slave = static_cast<std::byte>(request.slave);
  const auto function = static_cast<std::byte>(code(request.function));
  const auto refused = static_cast<std::byte>(code(request.function) | kExceptionBit);
  if (!bytes.empty() && bytes[0] != slave) return Match::kNone;
  if (bytes.size() < kHeader) return Match::kNeedMore;
  if (bytes[1] == refused) {
    size = kHeader + 1 + kCrc;
    const Match match = complete(bytes, size);
    if (match != Match::kWhole) return match;
    reply = {};
    reply.exception = byte_at(bytes, 2);
    return reply.exception != 0 ? Match::kWhole : Match::kNone;
  }
  if (bytes[1] != function) return Match::kNone;
  if (!reads(request.function)) {  // an echo of the address and of the value or count
    const Frame expected = encode_reply(request, {});
    size = expected.size;
    if (!begins_like(bytes, expected.view())) return Match::kNone;
    if (bytes.size() < size) return Match::kNeedMore;
    reply = {};
    return Match::kWhole;
  }
  if (!countable(request.read_count)) return Match::kNone;
  if (bytes.size() > kHeader && byte_at(bytes, kHeader) != 2 * request.read_count) return Match::kNone;
  size = kHeader + 1 + 2 * std::size_t{request.read_count} + kCrc;
  const Match match = complete(bytes, size);
  if (match != Match::kWhole) return match;
  reply = {};
  reply.count = request.read_count;
  read_words(bytes, kHeader + 1, request.read_count, reply.values);
  return Match::kWhole;
}

Match match_request(std::span<const std::byte> bytes, Request& request, std::size_t& size) noexcept {
  constexpr std::size_t kPair = 4;  ///< address and count, or address and value
  if (bytes.size() < kHeader) return Match::kNeedMore;
  Request r;
  r.slave = byte_at(bytes, 0);
  r.function = static_cast<Function>(byte_at(bytes, 1));
  const bool single = r.function == Function::kWriteSingle;
  const bool writes = r.function == Function::kWriteMultiple || r.function == Function::kReadWriteMultiple;
  if (!reads(r.function) && !writes && !single) return Match::kNone;
  std::size_t at = kHeader;
  if (reads(r.function)) {
    if (bytes.size() < at + kPair) return Match::kNeedMore;
    r.read_address = word_at(bytes, at);
    r.read_count = word_at(bytes, at + 2);
    if (!countable(r.read_count)) return Match::kNone;
    at += kPair;
  }
  if (single || writes) {
    if (bytes.size() < at + kPair) return Match::kNeedMore;
    r.write_address = word_at(bytes, at);
    r.write_count = single ? 1 : word_at(bytes, at + 2);
    if (!countable(r.write_count)) return Match::kNone;
    if (single) r.values[0] = word_at(bytes, at + 2);
    at += kPair;
  }
  if (writes) {
    if (bytes.size() <= at) return Match::kNeedMore;
    if (byte_at(bytes, at) != 2 * r.write_count) return Match::kNone;
    ++at;
    if (bytes.size() < at + 2 * std::size_t{r.write_count}) return Match::kNeedMore;
    read_words(bytes, at, r.write_count, r.values);
    at += 2 * std::size_t{r.write_count};
  }
  size = at + kCrc;
  const Match match = complete(bytes, size);
  if (match == Match::kWhole) request = r;
  return match;
}

const char* exception_text(std::uint8_t exception) noexcept {
  switch (exception) {
    case 1:
      return "illegal function";
    case 2:
      return "illegal data address";
    case 3:
      return "illegal data value";
    case 4:
      return "device failure";
    case 5:
      return "acknowledged, still working";
    case 6:
      return "device busy";
    default:
      return "unknown exception";
  }
}

void Assembler::push(std::span<const std::byte> bytes) noexcept {
  for (const std::byte b : bytes) {
    if (size_ == kCapacity) {
      drop(1);
      ++skipped_;
    }
    buffer_[size_++] = b;
  }
}

void Assembler::drop(std::size_t count) noexcept {
  std::copy(buffer_.begin() + static_cast<std::ptrdiff_t>(count), buffer_.begin() + static_cast<std::ptrdiff_t>(size_),
            buffer_.begin());
  size_ -= count;
}

std::optional<Reply> Assembler::take_reply(const Request& request) noexcept {
  Reply reply;
  for (std::size_t at = 0, size = 0; at < size_; ++at) {
    const Match match = match_reply(view().subspan(at), request, reply, size);
    if (match == Match::kNone) continue;
    skipped_ += at;
    drop(match == Match::kWhole ? at + size : at);
    return match == Match::kWhole ? std::optional(reply) : std::nullopt;
  }
  skipped_ += size_;
  size_ = 0;
  return std::nullopt;
}

std::optional<Request> Assembler::take_request() noexcept {
  Request request;
  for (std::size_t at = 0, size = 0; at < size_; ++at) {
    const Match match = match_request(view().subspan(at), request, size);
    if (match == Match::kNone) continue;
    skipped_ += at;
    drop(match == Match::kWhole ? at + size : at);
    return match == Match::kWhole ? std::optional(request) : std::nullopt;
  }
  skipped_ += size_;
  size_ = 0;
  return std::nullopt;
}

}  // namespace embody::modbus
