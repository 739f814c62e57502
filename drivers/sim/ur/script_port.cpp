#include "drivers/sim/ur/script_port.hpp"

#include <algorithm>

#include "drivers/transport/tcp.hpp"

namespace embody::sim {
namespace {

constexpr std::size_t kMostClients = 16;
constexpr std::size_t kLongestProgram = std::size_t{256} * 1024;

std::string_view first_line(std::string_view text) noexcept {
  return text.substr(0, text.find('\n'));
}

/// Where the line after the closing "end" begins; npos while that line has not arrived.
std::size_t after_end(std::string_view text) noexcept {
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = text.find('\n', begin);
    if (end == std::string_view::npos) break;
    std::string_view line = text.substr(begin, end - begin);
    while (!line.empty() && (line.back() == '\r' || line.back() == ' ')) line.remove_suffix(1);
    if (line == "end") return end + 1;
    begin = end + 1;
  }
  return std::string_view::npos;
}

}  // namespace

std::optional<std::string> take_program(std::string& pending) {
  while (pending.find('\n') != std::string::npos) {
    const std::string_view line = first_line(pending);
    const bool block = line.starts_with("def ") || line.starts_with("sec ");
    const std::size_t size = block ? after_end(pending) : line.size() + 1;
    if (size == std::string_view::npos) return std::nullopt;
    const bool empty = line.find_first_not_of(" \t\r") == std::string_view::npos;
    std::string program = pending.substr(0, size);
    pending.erase(0, size);
    if (!empty) return program;
  }
  return std::nullopt;
}

Status ScriptPort::listen(const std::string& address, std::uint16_t port) {
  auto listener = transport::tcp_listen(address, port);
  if (!listener) return listener.error();
  listener_ = std::move(*listener);
  return {};
}

std::uint16_t ScriptPort::port() const noexcept {
  return transport::local_port(listener_.get());
}

std::vector<std::string> ScriptPort::receive(const std::function<std::vector<Message>()>& greeting) {
  while (transport::UniqueFd fd = transport::tcp_accept(listener_.get())) {
    if (clients_.size() >= kMostClients) continue;
    Client& client = clients_.emplace_back();
    client.fd = std::move(fd);
    for (const Message& message : greeting()) write(client, message);
  }
  std::vector<std::string> programs;
  clients_.remove_if([&programs](Client& client) { return !read(client, programs); });
  return programs;
}

void ScriptPort::send(const Message& message) {
  for (Client& client : clients_) write(client, message);
}

/// False: the client is gone, or sends a program without end.
bool ScriptPort::read(Client& client, std::vector<std::string>& programs) {
  std::array<std::byte, std::size_t{16} * 1024> bytes;
  const auto received = transport::receive(client.fd.get(), bytes);
  if (received.status == IoStatus::kDisconnected) return false;
  client.pending.append(reinterpret_cast<const char*>(bytes.data()), received.size);
  while (auto program = take_program(client.pending)) programs.push_back(std::move(*program));
  return client.pending.size() <= kLongestProgram;
}

void ScriptPort::write(Client& client, const Message& message) {
  if (client.discontinued) return;
  client.discontinued = transport::send_message(client.fd.get(), message) != IoStatus::kDone;
}

}  // namespace embody::sim
