#include "drivers/qualisys/rt_connection.hpp"

#include <algorithm>

#include "drivers/transport/clock.hpp"
#include "drivers/transport/tcp.hpp"

namespace embody::qualisys {
namespace {

constexpr std::string_view kWelcome = "QTM RT Interface connected";
constexpr std::size_t kShownText = 80;

/// What a peer said, made fit to show.
std::string printable(std::string_view text) {
  std::string shown(text.substr(0, kShownText));
  std::replace_if(
      shown.begin(), shown.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
  return shown;
}

}  // namespace

Result<RtConnection> RtConnection::open(const std::string& host, std::uint16_t port, std::size_t buffer_size,
                                        TimePoint deadline) {
  auto fd = transport::tcp_connect(host, port, deadline);
  if (!fd) {
    return make_error(fd.error().code, "cannot reach QTM: %s; start QTM and its real-time output",
                      fd.error().detail.c_str());
  }
  RtConnection connection(std::move(*fd), buffer_size);
  const auto welcome = connection.wait_text(PacketType::kCommand, deadline);
  if (!welcome) return welcome.error();
  if (!welcome->starts_with(kWelcome)) {
    return make_error(Errc::kMalformed, "%s:%u is not a QTM real-time server: it says '%s'", host.c_str(),
                      unsigned{port}, printable(*welcome).c_str());
  }
  const std::string version(kProtocolVersion);
  const auto reply = connection.ask("Version " + version, PacketType::kCommand, deadline);
  if (!reply && reply.error().code != Errc::kRefused) return reply.error();
  if (!reply || *reply != "Version set to " + version) {
    return make_error(Errc::kUnsupported, "QTM at %s does not speak real-time protocol %s ('%s'); update QTM",
                      host.c_str(), version.c_str(), reply ? printable(*reply).c_str() : reply.error().detail.c_str());
  }
  return connection;
}

Status RtConnection::send(std::string_view command, TimePoint deadline) {
  const auto packet = encode_text(PacketType::kCommand, command);
  return transport::send_all(fd_.get(), packet, deadline);
}

Result<std::string> RtConnection::ask(std::string_view command, PacketType reply, TimePoint deadline) {
  if (const auto status = send(command, deadline); !status) return status.error();
  return wait_text(reply, deadline);
}

Result<Event> RtConnection::ask_state(TimePoint deadline) {
  if (const auto status = send("GetState", deadline); !status) return status.error();
  while (true) {
    const auto packet = wait_packet(deadline);
    if (!packet) return packet.error();
    if (decode_header(*packet)->type != PacketType::kEvent) continue;
    const auto event = decode_event(*packet);
    if (!event || is_state(*event)) return event;
  }
}

Result<std::string> RtConnection::wait_text(PacketType reply, TimePoint deadline) {
  while (true) {
    const auto packet = wait_packet(deadline);
    if (!packet) return packet.error();
    const auto type = decode_header(*packet)->type;
    if (type != reply && type != PacketType::kError) continue;
    const auto text = decode_text(*packet);
    if (!text) return text.error();
    if (type == PacketType::kError) return make_error(Errc::kRefused, "QTM says: %s", printable(*text).c_str());
    return std::string(*text);
  }
}

Result<std::span<const std::byte>> RtConnection::wait_packet(TimePoint deadline) {
  while (true) {
    const auto packet = input_.next();
    if (!packet || !packet->empty()) return packet;
    const auto received = transport::receive(fd_.get(), input_.free_space());
    if (received.status == IoStatus::kDisconnected) {
      return make_error(Errc::kDisconnected, "QTM closed the connection");
    }
    input_.commit(received.size);
    if (received.status == IoStatus::kDone && transport::now() < deadline) continue;
    if (!transport::wait_readable(fd_.get(), deadline) || transport::now() >= deadline) {
      return make_error(Errc::kTimeout, "QTM does not answer; is it busy or paused?");
    }
  }
}

}  // namespace embody::qualisys
