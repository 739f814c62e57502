// Whatever comes over the serial line, neither end of the protocol crashes, and what is understood is within bounds.
#include <algorithm>
#include <cstdint>
#include <cstdlib>

#include "drivers/robotiq/modbus.hpp"
#include "drivers/robotiq/registers.hpp"
#include "drivers/sim/robotiq/gripper.hpp"

namespace {

using namespace embody;  // NOLINT(google-build-using-namespace): a harness of one function

void require(bool condition) {
  if (!condition) std::abort();
}

void feed_host(std::span<const std::byte> bytes) {
  const std::array<std::uint16_t, 3> values{0x0900, 0x0010, 0xFFFF};
  modbus::Request both = modbus::write_request(9, robotiq::kCommandAddress, values);
  both.function = modbus::Function::kReadWriteMultiple;
  both.read_address = robotiq::kStatusAddress;
  both.read_count = robotiq::kRegisterCount;
  for (const modbus::Request& request :
       {modbus::read_request(9, modbus::Function::kReadHolding, robotiq::kStatusAddress, 3),
        modbus::write_request(9, robotiq::kCommandAddress, values), both}) {
    modbus::Assembler incoming;
    for (const std::byte b : bytes) {
      incoming.push({&b, 1});
      const auto reply = incoming.take_reply(request);
      if (!reply) continue;
      require(reply->exception != 0 || reply->count == request.read_count);
      const auto status = robotiq::unpack_status({reply->values[0], reply->values[1], reply->values[2]});
      require(status.fault < 16 && robotiq::fault_text(status.fault) != nullptr);
      const double q_rad = robotiq::angle_of({}, status.position);
      require(q_rad >= 0.0 && q_rad <= 0.7 + 1e-12);
    }
  }
}

/// A request that is understood is the one that its own encoding says.
void check_requests(std::span<const std::byte> bytes) {
  modbus::Request request;
  std::size_t size = 0;
  if (modbus::match_request(bytes, request, size) != modbus::Match::kWhole) return;
  const modbus::Frame frame = modbus::encode_request(request);
  require(size == frame.size && std::equal(frame.view().begin(), frame.view().end(), bytes.begin()));
}

void feed_device(std::span<const std::byte> bytes) {
  TimePoint now{std::chrono::seconds(1)};
  sim::RobotiqGripper gripper({}, now);
  for (std::size_t i = 0; i < bytes.size(); i += 15) {
    gripper.receive(bytes.subspan(i, std::min<std::size_t>(15, bytes.size() - i)), now);
    now += std::chrono::milliseconds(3);
    require(gripper.advance(now).size() < 4096);
    require(gripper.counts() >= 0.0 && gripper.counts() <= 255.0);
  }
}

/// Random bytes have a wrong CRC: this closes the frame with a good one.
void with_good_crc(std::span<const std::byte> bytes) {
  std::array<std::byte, 48> frame{};
  const std::size_t size = std::min(bytes.size(), frame.size() - 2);
  std::copy_n(bytes.begin(), size, frame.begin());
  const std::uint16_t crc = modbus::crc16({frame.data(), size});
  frame[size] = static_cast<std::byte>(crc & 0xFF);
  frame[size + 1] = static_cast<std::byte>(crc >> 8);
  const std::span<const std::byte> whole(frame.data(), size + 2);
  check_requests(whole);
  feed_host(whole);
  feed_device(whole);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto bytes = std::as_bytes(std::span(data, size));
  check_requests(bytes);
  feed_host(bytes);
  feed_device(bytes);
  with_good_crc(bytes);
  static_cast<void>(sim::parse_robotiq_fault({reinterpret_cast<const char*>(data), size}));
  return 0;
}
