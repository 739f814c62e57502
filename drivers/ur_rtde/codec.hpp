#pragma once
// Packages of RTDE as pure functions over bytes, for the client's and the controller's side.
// A package is u16 total size (big-endian, header included), u8 type, payload; several or parts of one may arrive at
// once. Texts are raw ASCII without terminator. Source: Universal Robots, "Real-Time Data Exchange (RTDE) guide".
// Functions named encode_* build control packages and allocate; everything else does not.
#include <string_view>
#include <vector>

#include "core/base/result.hpp"
#include "drivers/ur_rtde/wire.hpp"

namespace embody::rtde {

inline constexpr std::size_t kHeaderSize = 3;
inline constexpr std::size_t kMaxPackageSize = 65'535;
/// Header and recipe id: where the fields of a data package start (protocol version 2, and inputs of version 1).
inline constexpr std::size_t kFieldsStart = 4;

enum class PackageType : std::uint8_t {
  kProtocolVersion = 'V',
  kControllerVersion = 'v',
  kText = 'M',
  kData = 'U',
  kSetupOutputs = 'O',
  kSetupInputs = 'I',
  kStart = 'S',
  kPause = 'P',
};

/// One package without its header; `payload` views the caller's bytes.
struct Frame {
  std::uint8_t type{0};
  Bytes payload;
  [[nodiscard]] constexpr bool is(PackageType wanted) const noexcept {
    return type == static_cast<std::uint8_t>(wanted);
  }
};

enum class Framing {
  kComplete,
  kIncomplete,  ///< more bytes are needed
  kBroken,      ///< a size below the header's: the stream cannot be followed any further
};

struct ParsedFrame {
  Framing framing{Framing::kIncomplete};
  Frame frame;
  std::size_t size{0};  ///< bytes that the package takes, header included
};

/// Looks at the package at the start of `bytes`.
[[nodiscard]] ParsedFrame parse_frame(Bytes bytes) noexcept;

// --- control packages

enum class TextLevel : std::uint8_t { kException, kError, kWarning, kInfo };

struct Text {
  std::string_view message;
  std::string_view source;
  std::uint8_t level{0};  ///< TextLevel, or what else the peer sent
};

struct ControllerVersion {
  std::uint32_t major{0};
  std::uint32_t minor{0};
  std::uint32_t bugfix{0};
  std::uint32_t build{0};
};

struct OutputsRequest {
  double frequency_hz{0.0};  ///< 0 in protocol version 1, which has no such field
  std::string_view names;
};

struct SetupReply {
  std::uint8_t recipe{0};  ///< 0: the recipe is invalid
  std::string_view types;
};

[[nodiscard]] std::vector<std::byte> encode_protocol_request(std::uint16_t version);
/// A request without payload: controller version, start or pause.
[[nodiscard]] std::vector<std::byte> encode_request(PackageType type);
/// Reply of one byte: protocol version, start and pause.
[[nodiscard]] std::vector<std::byte> encode_accepted(PackageType type, bool accepted);
[[nodiscard]] std::vector<std::byte> encode_controller_version(const ControllerVersion& version);
/// Both directions in protocol version 2, and from the client in version 1. Message and source are cut at 255 bytes.
[[nodiscard]] std::vector<std::byte> encode_text(const Text& text);
/// From a controller in protocol version 1: level and message only.
[[nodiscard]] std::vector<std::byte> encode_text_v1(const Text& text);
/// `names` beyond what fits into a package are cut.
[[nodiscard]] std::vector<std::byte> encode_outputs_request(double frequency_hz, std::string_view names);
[[nodiscard]] std::vector<std::byte> encode_outputs_request_v1(std::string_view names);
[[nodiscard]] std::vector<std::byte> encode_inputs_request(std::string_view names);
[[nodiscard]] std::vector<std::byte> encode_setup_reply(PackageType type, const SetupReply& reply);
/// Reply to an output recipe in protocol version 1: no recipe id.
[[nodiscard]] std::vector<std::byte> encode_outputs_reply_v1(std::string_view types);

// Decoders take a payload; nullopt means that its size or contents do not fit the package. Texts view the payload.
[[nodiscard]] std::optional<std::uint16_t> decode_protocol_request(Bytes payload) noexcept;
[[nodiscard]] std::optional<bool> decode_accepted(Bytes payload) noexcept;
[[nodiscard]] std::optional<ControllerVersion> decode_controller_version(Bytes payload) noexcept;
[[nodiscard]] std::optional<Text> decode_text(Bytes payload) noexcept;
[[nodiscard]] std::optional<Text> decode_text_v1(Bytes payload) noexcept;
[[nodiscard]] std::optional<OutputsRequest> decode_outputs_request(Bytes payload) noexcept;
[[nodiscard]] std::optional<SetupReply> decode_setup_reply(Bytes payload) noexcept;
/// The whole payload as text: input recipes, and output recipes of protocol version 1 in both directions.
[[nodiscard]] std::string_view as_text(Bytes payload) noexcept;

/// Compares the reply with the recipe that was asked for, token by token, and explains the first difference.
/// Errors: kNotFound (the firmware has no such variable), kRefused (IN_USE: somebody else owns an input),
/// kMalformed (anything else).
[[nodiscard]] Status check_setup_reply(std::span<const Variable> recipe, const SetupReply& reply) noexcept;

// --- data packages

/// Writes header and recipe id; the caller fills `package` from kFieldsStart on. @pre kFieldsStart <= package.size() <=
/// kMaxPackageSize
void begin_data(std::span<std::byte> package, std::uint8_t recipe) noexcept;

/// Fields of a data package, or nullopt when it belongs to another recipe or has another size.
[[nodiscard]] std::optional<Bytes> decode_data(Bytes payload, std::uint8_t recipe, std::size_t size) noexcept;

}  // namespace embody::rtde
