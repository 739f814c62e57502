#include "drivers/qualisys/rt_connection.hpp"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>

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

/// Lets the kernel give up on a peer that no longer answers, whether we send or only listen.
void watch_peer(int fd) noexcept {
  const auto set = [fd](int level, int name, int value) { ::setsockopt(fd, level, name, &value, sizeof value); };
  set(SOL_SOCKET, SO_KEEPALIVE, 1);
  set(IPPROTO_TCP, TCP_KEEPIDLE, 1);   // s
  set(IPPROTO_TCP, TCP_KEEPINTVL, 1);  // s
  set(IPPROTO_TCP, TCP_KEEPCNT, 3);
  set(IPPROTO_TCP, TCP_USER_TIMEOUT, 3000);  // ms
}

}  // namespace

Result<RtConnection> RtConnection::open(const std::string& host, std::uint16_t port, std::size_t buffer_size,
                                        TimePoint deadline, ByteOrder order, int newest_minor) {
  auto fd = transport::tcp_connect(host, port, deadline);
  if (!fd) {
    return make_error(fd.error().code, "cannot reach QTM: %s; start QTM and its real-time output",
                      fd.error().detail.c_str());
  }
  watch_peer(fd->get());
  RtConnection connection(std::move(*fd), buffer_size, order);
  const auto welcome = connection.wait_text(PacketType::kCommand, deadline);
  if (!welcome) return welcome.error();
  if (!welcome->starts_with(kWelcome)) {
    return make_error(Errc::kMalformed, "%s:%u is not a QTM real-time server: it says '%s'", host.c_str(),
                      unsigned{port}, printable(*welcome).c_str());
  }
  if (const auto status = connection.agree_on_version(host, newest_minor, deadline); !status) {
    return status.error();
  }
  return connection;
}

Status RtConnection::agree_on_version(const std::string& host, int newest_minor, TimePoint deadline) {
  std::string last_words;
  for (int minor = newest_minor; minor >= kOldestMinorVersion; --minor) {
    const std::string version = "1." + std::to_string(minor);
    const auto reply = ask("Version " + version, PacketType::kCommand, deadline);
    if (!reply && reply.error().code != Errc::kRefused) return reply.error();
    if (reply && *reply == "Version set to " + version) {
      minor_version_ = minor;
      return {};
    }
    last_words = reply ? printable(*reply) : std::string(reply.error().detail.view());
  }
  return make_error(Errc::kUnsupported, "QTM at %.80s speaks no real-time protocol from 1.%d down to 1.%d ('%s')",
                    host.c_str(), newest_minor, kOldestMinorVersion, last_words.c_str());
}

Status RtConnection::send(std::string_view command, TimePoint deadline) {
  const auto packet = encode_text(PacketType::kCommand, command, order_);
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
    if (decode_header(*packet, order_)->type != PacketType::kEvent) continue;
    const auto event = decode_event(*packet, order_);
    if (!event || is_state(*event)) return event;
  }
}

Result<std::string> RtConnection::wait_text(PacketType reply, TimePoint deadline) {
  while (true) {
    const auto packet = wait_packet(deadline);
    if (!packet) return packet.error();
    const auto type = decode_header(*packet, order_)->type;
    if (type != reply && type != PacketType::kError) continue;
    const auto text = decode_text(*packet, order_);
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
      return make_error(Errc::kDisconnected, "QTM %s", transport::ending(errno));
    }
    input_.commit(received.size);
    if (received.status == IoStatus::kDone && transport::now() < deadline) continue;
    if (!transport::wait_readable(fd_.get(), deadline) || transport::now() >= deadline) {
      return make_error(Errc::kTimeout, "QTM does not answer; is it busy or paused?");
    }
  }
}

}  // namespace embody::qualisys
