#include "drivers/capture/capture_text.hpp"

#include <cstdio>
#include <nlohmann/json.hpp>

namespace embody::capture {
namespace {

constexpr char kDigits[] = "0123456789abcdef";

/// Valid UTF-8 of at most kMaxHeaderText bytes: what the reader accepts.
std::string sound(std::string text) {
  if (text.size() > kMaxHeaderText) {
    text.resize(kMaxHeaderText);
    while (!text.empty() && static_cast<unsigned char>(text.back()) >= 0x80) text.pop_back();
  }
  try {
    static_cast<void>(nlohmann::json(text).dump());
  } catch (const nlohmann::json::exception&) {
    for (char& c : text) c = static_cast<unsigned char>(c) < 0x80 ? c : '?';
  }
  return text;
}

const char* name(Event event) {
  return kEventNames[static_cast<std::size_t>(event)];
}

void append_hex(std::span<const std::byte> bytes, std::string& text) {
  for (const std::byte byte : bytes) {
    text += kDigits[std::to_integer<unsigned>(byte) >> 4];
    text += kDigits[std::to_integer<unsigned>(byte) & 0xf];
  }
}

}  // namespace

std::string header_line(const Header& header) {
  nlohmann::ordered_json line;
  line["format"] = "embody-capture";
  line["version"] = kVersion;
  line["utc"] = sound(header.utc_start);
  line["link"] = kLinkKindNames[static_cast<std::size_t>(header.link)];
  line["peer"] = sound(header.peer);
  line["program"] = sound(header.program);
  return line.dump(-1, ' ', true) + "\n";
}

void append_chunk_line(const Chunk& chunk, std::span<const std::byte> bytes, std::string& text) {
  char start[96];
  std::snprintf(start, sizeof start, R"({"t_ns":%lld,"conn":%u,"dir":"%s")", static_cast<long long>(chunk.t_ns),
                chunk.connection, name(chunk.event));
  text += start;
  switch (chunk.event) {
    case Event::kIn:
    case Event::kOut:
      text += R"(,"hex":")";
      append_hex(bytes, text);
      text += '"';
      break;
    case Event::kOpen:
      text += R"(,"port":)" + std::to_string(chunk.port);
      break;
    case Event::kClose:
      text += std::string(R"(,"by":")") + kEndNames[static_cast<std::size_t>(chunk.by)] + R"(","how":")" +
              (chunk.reset ? "reset" : "end") + '"';
      break;
  }
  text += "}\n";
}

std::string capture_text(const Capture& capture) {
  std::string text = header_line(capture.header);
  for (const Chunk& chunk : capture.chunks) append_chunk_line(chunk, chunk.bytes, text);
  return text;
}

}  // namespace embody::capture
