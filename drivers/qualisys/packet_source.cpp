#include "drivers/qualisys/packet_source.hpp"

#include <sys/epoll.h>
#include <sys/socket.h>

#include <cerrno>

#include "drivers/transport/clock.hpp"
#include "drivers/transport/tcp.hpp"

namespace embody::qualisys {
namespace {

constexpr std::size_t kLargestDatagram = 65'507;
constexpr int kUdpBuffer = 4 << 20;  // bytes in the kernel, which may grant less
constexpr std::span<const std::byte> kNothing{};

Status watch(int epoll, int fd) noexcept {
  epoll_event event{};
  event.events = EPOLLIN;
  event.data.fd = fd;
  if (::epoll_ctl(epoll, EPOLL_CTL_ADD, fd, &event) == 0) return {};
  return make_error(Errc::kIo, "cannot wait for two sockets at once");
}

}  // namespace

Result<PacketSource> PacketSource::open(RtConnection stream, const std::optional<UdpOptions>& udp) {
  PacketSource source(std::move(stream));
  source.qtm_address_ = transport::peer_address(source.stream_.fd());
  if (!udp) return source;
  if (const auto status = source.open_udp(*udp); !status) return status.error();
  return source;
}

Status PacketSource::open_udp(const UdpOptions& options) {
  const auto address =
      options.address.empty() ? transport::dotted(transport::own_address(stream_.fd())) : options.address;
  if (const auto network = transport::network_of(address); !network) return network.error();  // not every interface
  auto socket = transport::udp_bind(address, options.port, kUdpBuffer);
  if (!socket) return socket.error();
  udp_ = std::move(*socket);
  epoll_.reset(::epoll_create1(EPOLL_CLOEXEC));
  datagram_.resize(kLargestDatagram);
  if (const auto status = watch(epoll_.get(), udp_.get()); !status) return status;
  return watch(epoll_.get(), stream_.fd());
}

Status PacketSource::start(std::string_view components, TimePoint deadline) {
  std::string command = "StreamFrames AllFrames ";
  if (udp_) {
    // QTM sends to the peer of the connection unless told otherwise.
    const std::uint32_t own = transport::own_address(udp_.get());
    command += "UDP:";
    if (own != transport::own_address(stream_.fd())) command += transport::dotted(own) + ":";
    command += std::to_string(transport::local_port(udp_.get())) + " ";
  }
  return stream_.send(command + std::string(components), deadline);
}

Result<std::span<const std::byte>> PacketSource::next() noexcept {
  const auto packet = next_of_stream();
  if (!udp_ || !packet || !packet->empty()) return packet;
  return next_datagram();
}

Result<std::span<const std::byte>> PacketSource::next_of_stream() noexcept {
  auto& input = stream_.input();
  while (true) {
    const auto packet = input.next();
    if (!packet || !packet->empty()) return packet;
    // Here no whole packet is left, so that whatever completes one is the next receive.
    if (receives_left_ <= 0) return kNothing;
    const auto received = transport::receive(stream_.fd(), input.free_space());
    if (received.status == IoStatus::kEmpty) return kNothing;
    if (received.status == IoStatus::kDisconnected) {
      return make_error(Errc::kDisconnected, "QTM %s", transport::ending(errno));
    }
    --receives_left_;
    t_received_ = transport::now();
    input.commit(received.size);
  }
}

Result<std::span<const std::byte>> PacketSource::next_datagram() noexcept {
  while (receives_left_ > 0) {
    const auto received = transport::receive_datagram(udp_.get(), datagram_);
    if (received.status == IoStatus::kEmpty) return kNothing;
    if (received.status == IoStatus::kDisconnected) {
      return make_error(Errc::kDisconnected, "the socket for QTM's datagrams broke");
    }
    --receives_left_;
    t_received_ = transport::now();
    if (received.source != qtm_address_) {
      ++foreign_;
      continue;
    }
    const auto packet = std::span<const std::byte>(datagram_).first(std::min(received.size, datagram_.size()));
    const auto header = decode_whole(packet, order());
    if (received.size == packet.size() && header) return packet;
    ++malformed_;
  }
  return kNothing;
}

void PacketSource::cut() const noexcept {
  ::shutdown(stream_.fd(), SHUT_RDWR);
}

std::string PacketSource::udp_name() const {
  return transport::dotted(transport::own_address(udp_.get())) + ":" +
         std::to_string(transport::local_port(udp_.get()));
}

}  // namespace embody::qualisys
