// Whatever a CAN socket delivers, a bus neither crashes nor hands over what was not asked for.
#include <linux/can.h>
#include <sys/socket.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <cstring>

#include "drivers/transport/can.hpp"
#include "drivers/transport/can_double.hpp"

namespace {

using namespace embody::transport;  // NOLINT(google-build-using-namespace): a harness of one function

void require(bool condition) {
  if (!condition) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size >= 12) {
    CanErrorFrame frame;
    std::memcpy(&frame.classes, data, 4);
    std::memcpy(frame.data.data(), data + 4, 8);
    const CanErrors errors = decode_can_errors(frame);
    require(decode_can_errors(encode_can_errors(errors)) == errors);
  }
  auto ends = double_pair();
  if (!ends) return 0;
  const CanId wanted{0x123, false};
  CanBus bus(std::move((*ends)[0]), "fuzz", {wanted});
  for (std::size_t i = 0; i < size;) {  // a length, then a message of so many bytes
    const std::size_t length = std::min<std::size_t>(data[i] % 24, size - i - 1);
    if (length > 0) ::send((*ends)[1].get(), data + i + 1, length, MSG_DONTWAIT);
    i += length + 1;
  }
  CanFrame frame;
  embody::IoStatus status = embody::IoStatus::kDone;
  while (status == embody::IoStatus::kDone) {
    status = bus.receive(frame);
    if (status != embody::IoStatus::kDone) break;
    require(frame.id == wanted && frame.size <= 8);
  }
  require((status == embody::IoStatus::kDisconnected) == !bus.reason().empty());
  return 0;
}
