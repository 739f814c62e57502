// Reading of capture files.
#include <limits>
#include <optional>

#include "drivers/capture/capture_text.hpp"
#include "drivers/capture/json_line.hpp"
#include "drivers/transport/file.hpp"

namespace embody::capture {
namespace {

constexpr std::size_t kMaxLine = 2 * kMaxChunkBytes + 256;
constexpr std::array<const char*, 2> kWays{"end", "reset"};

int nibble(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  return c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
}

Status decode_hex(std::string_view hex, std::vector<std::byte>& bytes) {
  if (hex.size() % 2 != 0) return make_error(Errc::kMalformed, "\"hex\" has half a byte");
  bytes.reserve(hex.size() / 2);
  for (std::size_t i = 0; i < hex.size(); i += 2) {
    const int high = nibble(hex[i]), low = nibble(hex[i + 1]);
    if (high < 0 || low < 0) return make_error(Errc::kMalformed, "\"hex\" has something else than 0-9 and a-f");
    bytes.push_back(static_cast<std::byte>(16 * high + low));
  }
  return {};
}

Result<Header> parse_header(std::string_view line) {
  JsonLine json(line);
  Header header;
  const std::string format = json.text("format", 40);
  if (json.status() && format != "embody-capture") {
    return make_error(Errc::kMalformed, "\"format\" is not \"embody-capture\"");
  }
  const auto version = json.integer("version", 1, std::numeric_limits<int>::max());
  if (json.status() && version != kVersion) {
    return make_error(Errc::kUnsupported, "this is version %d of the format; this program reads version %d",
                      static_cast<int>(version), kVersion);
  }
  header.utc_start = json.text("utc", kMaxHeaderText);
  header.link = static_cast<LinkKind>(json.choice("link", kLinkKindNames));
  header.peer = json.text("peer", kMaxHeaderText);
  header.program = json.text("program", kMaxHeaderText);
  json.end();
  if (!json.status()) return json.status().error();
  return header;
}

Result<Chunk> parse_chunk(std::string_view line) {
  JsonLine json(line);
  Chunk chunk;
  chunk.t_ns = json.integer("t_ns", 0, std::numeric_limits<std::int64_t>::max());
  chunk.connection = static_cast<std::uint32_t>(json.integer("conn", 1, kMaxConnections));
  chunk.event = static_cast<Event>(json.choice("dir", kEventNames));
  if (!json.status()) return json.status().error();
  if (chunk.event == Event::kOpen) {
    chunk.port = static_cast<std::uint16_t>(json.integer("port", 0, 65'535));
  } else if (chunk.event == Event::kClose) {
    chunk.by = static_cast<End>(json.choice("by", kEndNames));
    chunk.reset = json.choice("how", kWays) == 1;
  } else if (const Status hex = decode_hex(json.text("hex", 2 * kMaxChunkBytes), chunk.bytes); !hex) {
    return hex.error();
  }
  json.end();
  if (!json.status()) return json.status().error();
  return chunk;
}

/// What the chunks so far allow.
class Order {
 public:
  explicit Order(LinkKind link) : link_(link) {}

  Status take(const Chunk& chunk) {
    if (chunk.t_ns < t_ns_) return make_error(Errc::kMalformed, "\"t_ns\" goes back");
    t_ns_ = chunk.t_ns;
    if (chunk.event == Event::kOpen) {
      if (chunk.connection != ended_.size() + 1) {
        return make_error(Errc::kMalformed, "\"conn\" of an open line must be %zu, the next one", ended_.size() + 1);
      }
      ended_.push_back({});
      return {};
    }
    if (chunk.connection > ended_.size()) return make_error(Errc::kMalformed, "\"conn\" was never opened");
    return chunk.event == Event::kClose ? close(chunk) : data(chunk);
  }

 private:
  Status close(const Chunk& chunk) {
    auto& ended = ended_[chunk.connection - 1];
    const std::size_t end = static_cast<std::size_t>(chunk.by);
    const bool news = !ended[end] || (chunk.reset && !ended[1 - end]);
    if (!news) return make_error(Errc::kMalformed, "this end of the connection has closed already");
    ended[end] = true;
    if (chunk.reset) ended = {true, true};
    return {};
  }
  Status data(const Chunk& chunk) const {
    if (chunk.bytes.empty() && link_ != LinkKind::kUdp) return make_error(Errc::kMalformed, "\"hex\" is empty");
    if (link_ == LinkKind::kCan && (chunk.bytes.size() < 4 || chunk.bytes.size() > 12)) {
      return make_error(Errc::kMalformed, "\"hex\" is no CAN frame: 4 bytes of identifier and up to 8 of data");
    }
    const End sender = chunk.event == Event::kIn ? End::kDevice : End::kHost;
    if (!ended_[chunk.connection - 1][static_cast<std::size_t>(sender)]) return {};
    return make_error(Errc::kMalformed, "bytes of an end that has closed");
  }

  LinkKind link_;
  std::int64_t t_ns_{0};
  std::vector<std::array<bool, 2>> ended_;  // by connection and End
};

Error at_line(std::size_t number, const Error& error) {
  return make_error(error.code, "line %zu: %s", number, error.detail.c_str());
}

}  // namespace

Result<Capture> parse_capture(std::string_view text) {
  Capture capture;
  std::optional<Order> order;
  for (std::size_t number = 1; !text.empty(); ++number) {
    const auto end = text.substr(0, kMaxLine + 1).find('\n');
    if (end == std::string_view::npos) {
      return at_line(number, text.size() > kMaxLine ? make_error(Errc::kMalformed, "longer than %zu bytes", kMaxLine)
                                                    : make_error(Errc::kMalformed, "the file ends within this line"));
    }
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(end + 1);
    if (!order) {
      auto header = parse_header(line);
      if (!header) return at_line(number, header.error());
      capture.header = std::move(*header);
      order.emplace(capture.header.link);
      continue;
    }
    auto chunk = parse_chunk(line);
    if (!chunk) return at_line(number, chunk.error());
    if (const Status fits = order->take(*chunk); !fits) return at_line(number, fits.error());
    capture.chunks.push_back(std::move(*chunk));
  }
  if (!order) return make_error(Errc::kMalformed, "line 1: the file is empty");
  return capture;
}

Result<Capture> load_capture(const std::string& path) {
  const auto text = transport::load_text(path, kMaxCaptureBytes, "a capture (docs/capture.md)");
  if (!text) return text.error();
  auto capture = parse_capture(*text);
  if (capture) return capture;
  return make_error(capture.error().code, "'%.120s' %s", path.c_str(), capture.error().detail.c_str());
}

}  // namespace embody::capture
