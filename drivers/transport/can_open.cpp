// Opening a CAN bus: the part that may wait, and that says in words what is wrong with the interface.
#include <fcntl.h>
#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <net/if_arp.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "drivers/transport/can.hpp"
#include "drivers/transport/can_double.hpp"

namespace embody::transport {
namespace {

Error no_socket(int code) {
  switch (code) {
    case EAFNOSUPPORT:
    case EPROTONOSUPPORT:
      return make_error(Errc::kUnsupported,
                        "this kernel has no CAN: load its modules (modprobe can-raw); Debian's cloud kernel has none");
    case EPERM:
    case EACCES:
      return make_error(Errc::kPermission, "no permission to use CAN sockets: %s", std::strerror(code));
    default:
      return make_error(Errc::kIo, "cannot create a CAN socket: %s", std::strerror(code));
  }
}

Status check_filters(const std::vector<CanId>& receive) {
  if (receive.empty() || receive.size() > kMaxCanFilters) {
    return make_error(Errc::kInvalidArgument, "CAN: %zu identifiers to receive, must be 1 to %zu", receive.size(),
                      kMaxCanFilters);
  }
  for (const CanId& id : receive) {
    if (id.valid()) continue;
    return make_error(Errc::kInvalidArgument, "CAN: identifier 0x%x does not fit %d bits", id.value,
                      id.extended ? 29 : 11);
  }
  return {};
}

Status set_options(int fd, const CanConfig& config) {
  std::array<can_filter, kMaxCanFilters> filters{};
  for (std::size_t i = 0; i < config.receive.size(); ++i) {
    const CanId id = config.receive[i];
    filters[i].can_id = id.value | (id.extended ? CAN_EFF_FLAG : 0u);
    filters[i].can_mask = CAN_EFF_FLAG | CAN_RTR_FLAG | (id.extended ? CAN_EFF_MASK : CAN_SFF_MASK);
  }
  const auto filters_size = static_cast<socklen_t>(config.receive.size() * sizeof(can_filter));
  const can_err_mask_t errors = CAN_ERR_MASK;
  const int loopback = config.local_loopback ? 1 : 0;
  const int off = 0;
  const int on = 1;
  if (::setsockopt(fd, SOL_CAN_RAW, CAN_RAW_FILTER, filters.data(), filters_size) != 0 ||
      ::setsockopt(fd, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, &errors, sizeof errors) != 0 ||
      ::setsockopt(fd, SOL_CAN_RAW, CAN_RAW_LOOPBACK, &loopback, sizeof loopback) != 0 ||
      ::setsockopt(fd, SOL_CAN_RAW, CAN_RAW_RECV_OWN_MSGS, &off, sizeof off) != 0) {
    return make_error(Errc::kIo, "cannot set up the CAN socket of %s: %s", config.interface.c_str(),
                      std::strerror(errno));
  }
  ::setsockopt(fd, SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on);  // best effort
  return {};
}

Result<UniqueFd> open_raw(const CanConfig& config) {
  UniqueFd fd(::socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW));
  if (!fd) return no_socket(errno);
  const auto index = find_can_interface(config.interface);
  if (!index) return index.error();
  if (const Status set = set_options(fd.get(), config); !set) return set.error();
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = *index;
  if (::bind(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    return make_error(Errc::kIo, "cannot use the CAN interface %s: %s", config.interface.c_str(), std::strerror(errno));
  }
  return fd;
}

/// False when the kernel says that a controller which is up has left its bus. (IFF_RUNNING says the same up to a second
/// late, also after the interface came up.)
bool has_carrier(const std::string& name) {
  const std::string path = "/sys/class/net/" + name + "/carrier";
  const UniqueFd fd(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  char carrier = '1';
  return !fd || ::read(fd.get(), &carrier, 1) != 1 || carrier != '0';
}

}  // namespace

Result<int> find_can_interface(const std::string& name) {
  const char* text = name.c_str();
  if (name.empty() || name.size() >= IFNAMSIZ) {
    return make_error(Errc::kInvalidArgument, "'%.60s' is no interface name: 1 to %d bytes, like can0", text,
                      IFNAMSIZ - 1);
  }
  const UniqueFd fd(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  if (!fd) return make_error(Errc::kIo, "cannot create a socket: %s", std::strerror(errno));
  ifreq request{};
  std::memcpy(request.ifr_name, text, name.size());
  if (::ioctl(fd.get(), SIOCGIFINDEX, &request) != 0) {
    return make_error(Errc::kNotFound, "no interface '%s': check the adapter and its driver (ip link)", text);
  }
  const int index = request.ifr_ifindex;
  if (::ioctl(fd.get(), SIOCGIFHWADDR, &request) != 0 || request.ifr_hwaddr.sa_family != ARPHRD_CAN) {
    return make_error(Errc::kInvalidArgument, "%s is not a CAN interface", text);
  }
  if (::ioctl(fd.get(), SIOCGIFFLAGS, &request) != 0 || (request.ifr_flags & IFF_UP) == 0) {
    return make_error(Errc::kDisconnected,
                      "CAN interface %s is down: ip link set %s type can bitrate 1000000 && ip link set %s up", text,
                      text, text);
  }
  if (!has_carrier(name)) {
    return make_error(Errc::kDisconnected,
                      "CAN interface %s is bus-off: check wiring, termination and bit rate, then ip link set %s type "
                      "can restart",
                      text, text);
  }
  return index;
}

Result<CanBus> open_can(const CanConfig& config) {
  if (const Status usable = check_filters(config.receive); !usable) return usable.error();
  const auto path = double_path(config.interface);
  auto fd = path ? double_connect(*path) : open_raw(config);
  if (!fd) return fd.error();
  return CanBus(std::move(*fd), config.interface, config.receive);
}

}  // namespace embody::transport
