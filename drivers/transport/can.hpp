#pragma once
// One CAN bus: SocketCAN's raw protocol by the name of the interface ("can0"), or the double "unix:/path"
// (can_double.hpp), which carries the same struct can_frame. Classic frames of up to eight bytes.
// The bit rate belongs to the interface and is set outside of this program:
//   ip link set can0 type can bitrate 1000000 restart-ms 100 && ip link set can0 up
// Bus-off and error frames of real controllers are decoded as linux/can/error.h says; nobody has tried that on
// hardware.
#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/fixed_string.hpp"
#include "core/base/result.hpp"
#include "core/hal/device.hpp"
#include "drivers/transport/can_errors.hpp"
#include "drivers/transport/can_frame.hpp"
#include "drivers/transport/unique_fd.hpp"

namespace embody::transport {

inline constexpr std::size_t kMaxCanFilters = 32;

struct CanConfig {
  std::string interface { "can0" };
  /// Identifiers to receive, 1..kMaxCanFilters: the kernel hands over nothing else.
  std::vector<CanId> receive;
  /// Other programs on this computer (candump, a simulator on vcan) see what we send. We never do.
  bool local_loopback{true};
};

/// What happened since the bus was opened.
struct CanCounters {
  std::uint64_t sent{0};
  std::uint64_t received{0};
  std::uint64_t ignored{0};     ///< no data frame, no such identifier, or a wrong size
  std::uint64_t queue_full{0};  ///< sends that the kernel had no room for: bus too slow, or nobody acknowledges
  std::uint64_t error_frames{0};
  std::uint64_t error_warnings{0};
  std::uint64_t error_passives{0};
  std::uint64_t no_acks{0};
  std::uint64_t arbitrations_lost{0};
  std::uint64_t protocol_errors{0};
  std::uint64_t overflows{0};
  std::uint64_t restarts{0};
  std::uint64_t bus_offs{0};
};

/// An open bus. send() and receive() neither wait nor allocate. Once they said kDisconnected, they say so for ever:
/// interface down or gone, or bus-off (what was in the controller's queue then is lost; who commands motion begins
/// anew). reason() is why.
class CanBus {
 public:
  /// @pre at most kMaxCanFilters identifiers. `name` is for people.
  CanBus(UniqueFd fd, std::string_view name, const std::vector<CanId>& receive) noexcept;

  [[nodiscard]] int fd() const noexcept { return fd_.get(); }
  /// kEmpty: no room, nothing was sent.
  IoStatus send(const CanFrame& frame) noexcept;
  /// The next data frame with one of the wanted identifiers. Error frames are counted on the way.
  IoStatus receive(CanFrame& frame) noexcept;

  [[nodiscard]] const CanCounters& counters() const noexcept { return counters_; }
  [[nodiscard]] std::string_view reason() const noexcept { return reason_.view(); }

 private:
  [[nodiscard]] bool wanted(CanId id) const noexcept;
  void count(const CanErrors& errors) noexcept;
  IoStatus fail(int code) noexcept;
  IoStatus end(const char* format) noexcept;

  UniqueFd fd_;
  FixedString<40> name_;
  std::array<CanId, kMaxCanFilters> filters_{};
  std::size_t filter_count_{0};
  CanCounters counters_;
  FixedString<240> reason_;
};

/// Errors: kInvalidArgument (name, filters, an interface that is not CAN), kUnsupported (the kernel has no CAN),
/// kNotFound, kDisconnected (interface down or bus-off, nobody at the double), kPermission, kIo.
[[nodiscard]] Result<CanBus> open_can(const CanConfig& config);

/// Index of a CAN interface that is up, for other protocols of the CAN family. Errors: as open_can().
[[nodiscard]] Result<int> find_can_interface(const std::string& name);

/// The error frame that a controller would hand to `fd`'s other end; for simulators.
IoStatus send_can_errors(int fd, const CanErrors& errors) noexcept;

}  // namespace embody::transport
