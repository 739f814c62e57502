#include "drivers/sim/ur/dashboard_port.hpp"

#include <array>

#include "drivers/transport/tcp.hpp"

namespace embody::sim {
namespace {

constexpr std::size_t kMostClients = 16;
constexpr std::size_t kLongestLine = 4096;

bool send_line(int fd, std::string_view text) {
  const std::string line = std::string(text) + "\n";
  return transport::send_message(fd, std::as_bytes(std::span(line))) == IoStatus::kDone;
}

}  // namespace

Status DashboardPort::listen(const std::string& address, std::uint16_t port) {
  auto listener = transport::tcp_listen(address, port);
  if (!listener) return listener.error();
  listener_ = std::move(*listener);
  return {};
}

std::uint16_t DashboardPort::port() const noexcept {
  return listener_ ? transport::local_port(listener_.get()) : std::uint16_t{0};
}

void DashboardPort::serve(UrRobot& robot, const DashboardInfo& info) {
  while (transport::UniqueFd fd = listener_ ? transport::tcp_accept(listener_.get()) : transport::UniqueFd()) {
    if (clients_.size() >= kMostClients) continue;
    if (send_line(fd.get(), "Connected: Universal Robots Dashboard Server")) clients_.push_back({std::move(fd), {}});
  }
  clients_.remove_if([&](Client& client) { return !serve(client, robot, info); });
}

bool DashboardPort::serve(Client& client, UrRobot& robot, const DashboardInfo& info) {
  std::array<std::byte, 1024> bytes;
  const auto received = transport::receive(client.fd.get(), bytes);
  if (received.status == IoStatus::kDisconnected) return false;
  client.pending.append(reinterpret_cast<const char*>(bytes.data()), received.size);
  for (std::size_t end = client.pending.find('\n'); end != std::string::npos; end = client.pending.find('\n')) {
    const DashboardAnswer answer = answer_dashboard(std::string_view(client.pending).substr(0, end), robot, info);
    client.pending.erase(0, end + 1);
    if (!send_line(client.fd.get(), answer.text) || answer.quit) return false;
  }
  return client.pending.size() <= kLongestLine;
}

}  // namespace embody::sim
