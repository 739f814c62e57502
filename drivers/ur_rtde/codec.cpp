#include "drivers/ur_rtde/codec.hpp"

#include <algorithm>

namespace embody::rtde {
namespace {

/// A control package under construction; what does not fit into the largest package is cut.
class Package {
 public:
  explicit Package(PackageType type) : bytes_(kHeaderSize) { bytes_[2] = static_cast<std::byte>(type); }

  template <class T>
  Package& add(T value) {
    const std::size_t offset = bytes_.size();
    bytes_.resize(offset + sizeof(T));
    store(bytes_, offset, value);
    return *this;
  }
  Package& add_text(std::string_view text, std::size_t limit = kMaxPackageSize) {
    const std::size_t size = std::min({text.size(), limit, kMaxPackageSize - bytes_.size()});
    const auto raw = std::as_bytes(std::span(text.data(), size));
    bytes_.insert(bytes_.end(), raw.begin(), raw.end());
    return *this;
  }
  Package& add_counted_text(std::string_view text) {
    constexpr std::size_t kLimit = 255;
    return add(static_cast<std::uint8_t>(std::min(text.size(), kLimit))).add_text(text, kLimit);
  }
  [[nodiscard]] std::vector<std::byte> take() {
    store(bytes_, 0, static_cast<std::uint16_t>(bytes_.size()));
    return std::move(bytes_);
  }

 private:
  std::vector<std::byte> bytes_;
};

/// Takes a text with a leading length byte off `rest`; false when it is longer than what is left.
bool take_counted_text(Bytes& rest, std::string_view& text) noexcept {
  if (rest.empty()) return false;
  const auto size = load<std::uint8_t>(rest, 0);
  if (rest.size() < 1U + size) return false;
  text = as_text(rest.subspan(1, size));
  rest = rest.subspan(1U + size);
  return true;
}

int print_width(std::string_view text) noexcept {
  constexpr std::size_t kLongest = 60;
  return static_cast<int>(std::min(text.size(), kLongest));
}

Error explain_token(const Variable& variable, std::string_view token) noexcept {
  const std::string_view name = variable.name;
  if (token == "NOT_FOUND") {
    return make_error(Errc::kNotFound,
                      "the controller does not know the RTDE variable %.*s: its firmware is too old (5.4 or newer is "
                      "needed)",
                      print_width(name), name.data());
  }
  if (token == "IN_USE") {
    return make_error(Errc::kRefused,
                      "%.*s is in use: a fieldbus (EtherNet/IP, PROFINET, Modbus) or another RTDE client owns it; "
                      "disable that or stop the other client",
                      print_width(name), name.data());
  }
  const std::string_view wanted = type_name(variable.type);
  return make_error(Errc::kMalformed, "the controller answers '%.*s' for the RTDE variable %.*s, expected %.*s",
                    print_width(token), token.data(), print_width(name), name.data(), print_width(wanted),
                    wanted.data());
}

}  // namespace

ParsedFrame parse_frame(Bytes bytes) noexcept {
  if (bytes.size() < sizeof(std::uint16_t)) return {};
  const std::size_t size = load<std::uint16_t>(bytes, 0);
  if (size < kHeaderSize) return {Framing::kBroken, {}, 0};
  if (bytes.size() < size) return {};
  const Frame frame{load<std::uint8_t>(bytes, 2), bytes.subspan(kHeaderSize, size - kHeaderSize)};
  return {Framing::kComplete, frame, size};
}

std::vector<std::byte> encode_protocol_request(std::uint16_t version) {
  return Package(PackageType::kProtocolVersion).add(version).take();
}

std::vector<std::byte> encode_request(PackageType type) {
  return Package(type).take();
}

std::vector<std::byte> encode_accepted(PackageType type, bool accepted) {
  return Package(type).add(std::uint8_t{accepted}).take();
}

std::vector<std::byte> encode_controller_version(const ControllerVersion& version) {
  return Package(PackageType::kControllerVersion)
      .add(version.major)
      .add(version.minor)
      .add(version.bugfix)
      .add(version.build)
      .take();
}

std::vector<std::byte> encode_text(const Text& text) {
  return Package(PackageType::kText)
      .add_counted_text(text.message)
      .add_counted_text(text.source)
      .add(text.level)
      .take();
}

std::vector<std::byte> encode_text_v1(const Text& text) {
  return Package(PackageType::kText).add(text.level).add_text(text.message).take();
}

std::vector<std::byte> encode_outputs_request(double frequency_hz, std::string_view names) {
  return Package(PackageType::kSetupOutputs).add(frequency_hz).add_text(names).take();
}

std::vector<std::byte> encode_outputs_request_v1(std::string_view names) {
  return Package(PackageType::kSetupOutputs).add_text(names).take();
}

std::vector<std::byte> encode_inputs_request(std::string_view names) {
  return Package(PackageType::kSetupInputs).add_text(names).take();
}

std::vector<std::byte> encode_setup_reply(PackageType type, const SetupReply& reply) {
  return Package(type).add(reply.recipe).add_text(reply.types).take();
}

std::vector<std::byte> encode_outputs_reply_v1(std::string_view types) {
  return Package(PackageType::kSetupOutputs).add_text(types).take();
}

std::optional<std::uint16_t> decode_protocol_request(Bytes payload) noexcept {
  if (payload.size() != sizeof(std::uint16_t)) return std::nullopt;
  return load<std::uint16_t>(payload, 0);
}

std::optional<bool> decode_accepted(Bytes payload) noexcept {
  if (payload.size() != 1) return std::nullopt;
  return load<std::uint8_t>(payload, 0) != 0;
}

std::optional<ControllerVersion> decode_controller_version(Bytes payload) noexcept {
  if (payload.size() != 16) return std::nullopt;
  return ControllerVersion{load<std::uint32_t>(payload, 0), load<std::uint32_t>(payload, 4),
                           load<std::uint32_t>(payload, 8), load<std::uint32_t>(payload, 12)};
}

std::optional<Text> decode_text(Bytes payload) noexcept {
  Text text;
  if (!take_counted_text(payload, text.message)) return std::nullopt;
  if (!take_counted_text(payload, text.source)) return std::nullopt;
  if (payload.size() != 1) return std::nullopt;
  text.level = load<std::uint8_t>(payload, 0);
  return text;
}

std::optional<Text> decode_text_v1(Bytes payload) noexcept {
  if (payload.empty()) return std::nullopt;
  return Text{as_text(payload.subspan(1)), {}, load<std::uint8_t>(payload, 0)};
}

std::optional<OutputsRequest> decode_outputs_request(Bytes payload) noexcept {
  if (payload.size() < sizeof(double)) return std::nullopt;
  return OutputsRequest{load<double>(payload, 0), as_text(payload.subspan(sizeof(double)))};
}

std::optional<SetupReply> decode_setup_reply(Bytes payload) noexcept {
  if (payload.empty()) return std::nullopt;
  return SetupReply{load<std::uint8_t>(payload, 0), as_text(payload.subspan(1))};
}

std::string_view as_text(Bytes payload) noexcept {
  return {reinterpret_cast<const char*>(payload.data()), payload.size()};
}

Status check_setup_reply(std::span<const Variable> recipe, const SetupReply& reply) noexcept {
  std::string_view rest = reply.types;
  std::string_view token;
  std::size_t count = 0;
  for (; next_token(rest, token); ++count) {
    if (count < recipe.size() && token != type_name(recipe[count].type)) return explain_token(recipe[count], token);
  }
  if (count != recipe.size()) {
    return make_error(Errc::kMalformed, "the controller answers %zu types for an RTDE recipe of %zu variables", count,
                      recipe.size());
  }
  if (reply.recipe == 0) return make_error(Errc::kMalformed, "the controller rejects the RTDE recipe without a reason");
  return {};
}

void begin_data(std::span<std::byte> package, std::uint8_t recipe) noexcept {
  store(package, 0, static_cast<std::uint16_t>(package.size()));
  store(package, 2, static_cast<std::uint8_t>(PackageType::kData));
  store(package, 3, recipe);
}

std::optional<Bytes> decode_data(Bytes payload, std::uint8_t recipe, std::size_t size) noexcept {
  if (payload.size() != size + 1 || load<std::uint8_t>(payload, 0) != recipe) return std::nullopt;
  return payload.subspan(1);
}

}  // namespace embody::rtde
