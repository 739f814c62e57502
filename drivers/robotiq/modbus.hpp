#pragma once
// Modbus RTU, both ends: pure functions over bytes, no allocation. Only the register functions that a gripper needs.
// Source: MODBUS Application Protocol Specification V1.1b3 and MODBUS over Serial Line V1.02 (modbus.org).
//   frame  slave, function, data, CRC-16 (low byte first); numbers inside the data have their high byte first
// On the wire, frames end with a silence of 3.5 characters. A host behind a USB adapter cannot see that, but it knows
// how long the answer to its request is.
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace embody::modbus {

inline constexpr std::size_t kMaxRegisters = 16;  ///< in one request; the standard allows more, we never need more

enum class Function : std::uint8_t {
  kReadHolding = 3,
  kReadInput = 4,
  kWriteSingle = 6,
  kWriteMultiple = 16,
  kReadWriteMultiple = 23,
};

/// What a frame says. Fields that the function does not have are 0. `kWriteSingle` has `write_count` 1.
struct Request {
  std::uint8_t slave{0};
  Function function{Function::kReadHolding};
  std::uint16_t read_address{0}, read_count{0};
  std::uint16_t write_address{0}, write_count{0};
  std::array<std::uint16_t, kMaxRegisters> values{};  ///< to be written
  friend bool operator==(const Request&, const Request&) = default;
};

struct Reply {
  std::uint8_t exception{0};  ///< 0: none
  std::uint16_t count{0};
  std::array<std::uint16_t, kMaxRegisters> values{};  ///< that were read
  friend bool operator==(const Reply&, const Reply&) = default;
};

/// The bytes of one frame.
struct Frame {
  static constexpr std::size_t kCapacity = 64;  ///< the longest: function 23 with kMaxRegisters, 45 bytes
  std::array<std::byte, kCapacity> bytes{};
  std::size_t size{0};
  [[nodiscard]] std::span<const std::byte> view() const noexcept { return {bytes.data(), size}; }
};

/// CRC-16/MODBUS: polynomial 0xA001 (reflected), start 0xFFFF.
[[nodiscard]] std::uint16_t crc16(std::span<const std::byte> bytes) noexcept;

[[nodiscard]] Request read_request(std::uint8_t slave, Function function, std::uint16_t address, std::uint16_t count);
[[nodiscard]] Request write_request(std::uint8_t slave, std::uint16_t address, std::span<const std::uint16_t> values);

/// @pre counts are within 1..kMaxRegisters where the function has them.
[[nodiscard]] Frame encode_request(const Request& request) noexcept;
/// The answer of a slave: an exception, or what `request` asks for.
[[nodiscard]] Frame encode_reply(const Request& request, const Reply& reply) noexcept;

/// What the first bytes of a stream are.
enum class Match : std::uint8_t {
  kNeedMore,  ///< the beginning of a frame, so far
  kNone,      ///< no frame begins here
  kWhole,     ///< a frame with a good CRC
};

/// An answer to `request` at the beginning of `bytes`: slave, function, addresses, counts and CRC must fit.
/// @post kWhole: `reply` is filled and `size` is the length of the frame.
[[nodiscard]] Match match_reply(std::span<const std::byte> bytes, const Request& request, Reply& reply,
                                std::size_t& size) noexcept;
/// A request to any slave at the beginning of `bytes`. Functions and counts that this file does not know are kNone.
[[nodiscard]] Match match_request(std::span<const std::byte> bytes, Request& request, std::size_t& size) noexcept;

/// "illegal data address" and its like; never null.
[[nodiscard]] const char* exception_text(std::uint8_t exception) noexcept;

/// Gathers the bytes of a line and finds frames in them: what is no frame is skipped byte by byte. When it is full
/// without a frame, the oldest byte is forgotten.
class Assembler {
 public:
  static constexpr std::size_t kCapacity = 256;
  void push(std::span<const std::byte> bytes) noexcept;
  void clear() noexcept { size_ = 0; }
  /// The next answer to `request`, with everything before it dropped.
  [[nodiscard]] std::optional<Reply> take_reply(const Request& request) noexcept;
  /// The next request of a host.
  [[nodiscard]] std::optional<Request> take_request() noexcept;
  [[nodiscard]] std::uint64_t skipped_bytes() const noexcept { return skipped_; }

 private:
  void drop(std::size_t count) noexcept;
  [[nodiscard]] std::span<const std::byte> view() const noexcept { return {buffer_.data(), size_}; }

  std::array<std::byte, kCapacity> buffer_{};
  std::size_t size_{0};
  std::uint64_t skipped_{0};
};

}  // namespace embody::modbus
