// Any bytes into a session of the simulated controller, over a socket pair.
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cstdlib>

#include "drivers/sim/ur/rtde_session.hpp"
#include "drivers/transport/tcp.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace embody;
  static sim::RtdeShared shared;
  static std::array<std::byte, 1 << 16> sink;
  std::array<int, 2> pair{};
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK, 0, pair.data()) != 0) return 0;
  const transport::UniqueFd peer(pair[0]);
  {
    sim::RtdeSession session(shared, transport::UniqueFd(pair[1]), 1);
    rtde::Bytes stream = std::as_bytes(std::span(data, size));
    bool open = true;
    for (std::uint64_t cycle = 0; open && !stream.empty(); ++cycle) {
      const rtde::Bytes part = stream.first(std::min<std::size_t>(stream.size(), 1000));
      if (transport::send_message(peer.get(), part) != IoStatus::kDone) break;
      stream = stream.subspan(part.size());
      open = session.receive() && session.publish(cycle, cycle + 1);
      while (transport::receive(peer.get(), sink).size > 0) {
      }
    }
  }
  if (std::any_of(shared.owners.begin(), shared.owners.end(), [](auto owner) { return owner != 0; })) std::abort();
  return 0;
}
