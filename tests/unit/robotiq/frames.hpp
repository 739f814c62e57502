#pragma once
// Frames that Robotiq prints in its "2F-85 & 2F-140 Instruction Manual", section "Modbus RTU".
#include <cstdint>
#include <string_view>
#include <vector>

#include "drivers/robotiq/modbus.hpp"
#include "drivers/robotiq/registers.hpp"

namespace embody::test {

inline std::vector<std::byte> bytes_of(std::string_view hex) {
  std::vector<std::byte> bytes;
  int digits = 0, value = 0;
  for (const char c : hex) {
    if (c == ' ') continue;
    value = 16 * value + (c <= '9' ? c - '0' : c - 'A' + 10);
    if (++digits % 2 != 0) continue;
    bytes.push_back(static_cast<std::byte>(value));
    value = 0;
  }
  return bytes;
}

inline std::vector<std::byte> bytes_of(const modbus::Frame& frame) {
  return {frame.view().begin(), frame.view().end()};
}

struct ManualRequest {
  const char* what;
  const char* hex;
  modbus::Request request;
};

inline modbus::Request write_of(std::uint16_t address, const std::vector<std::uint16_t>& values) {
  return modbus::write_request(9, address, values);
}
inline modbus::Request read_of(modbus::Function function, std::uint16_t count) {
  return modbus::read_request(9, function, 0x07D0, count);
}
inline modbus::Request write_of(const robotiq::GripperCommand& command) {
  return modbus::write_request(9, robotiq::kCommandAddress, robotiq::pack(command));
}

inline std::vector<ManualRequest> manual_requests() {
  using modbus::Function;
  modbus::Request both = read_of(Function::kReadWriteMultiple, 2);
  both.write_address = 0x03E9;
  both.write_count = 2;
  both.values[0] = 0x00E6;
  both.values[1] = 0x3CC8;
  return {
      {"reset", "09 10 03 E8 00 03 06 00 00 00 00 00 00 73 30", write_of({})},
      {"activate", "09 10 03 E8 00 03 06 01 00 00 00 00 00 72 E1", write_of({true, false, 0, 0, 0})},
      {"close", "09 10 03 E8 00 03 06 09 00 00 FF FF FF 42 29", write_of({true, true, 255, 255, 255})},
      {"open", "09 10 03 E8 00 03 06 09 00 00 00 FF FF 72 19", write_of({true, true, 0, 255, 255})},
      {"write two registers", "09 10 03 E9 00 02 04 60 E6 3C C8 EC 7C", write_of(0x03E9, {0x60E6, 0x3CC8})},
      {"read one register", "09 03 07 D0 00 01 85 CF", read_of(Function::kReadHolding, 1)},
      {"read two registers", "09 03 07 D0 00 02 C5 CE", read_of(Function::kReadHolding, 2)},
      {"read three registers", "09 03 07 D0 00 03 04 0E", read_of(Function::kReadHolding, 3)},
      {"read two input registers", "09 04 07 D0 00 02 70 0E", read_of(Function::kReadInput, 2)},
      {"read three input registers", "09 04 07 D0 00 03 B1 CE", read_of(Function::kReadInput, 3)},
      {"read and write", "09 17 07 D0 00 02 03 E9 00 02 04 00 E6 3C C8 2D 0C", both},
  };
}

struct ManualReply {
  const char* what;
  const char* hex;
  modbus::Request request;
  std::vector<std::uint16_t> values;
};

inline std::vector<ManualReply> manual_replies() {
  using modbus::Function;
  const auto all = manual_requests();
  return {
      {"written", "09 10 03 E8 00 03 01 30", all[0].request, {}},
      {"activation runs", "09 03 02 11 00 55 D5", read_of(Function::kReadHolding, 1), {0x1100}},
      {"activation done", "09 03 02 31 00 4C 15", read_of(Function::kReadHolding, 1), {0x3100}},
      {"closing", "09 03 06 39 00 00 FF 0E 0A F7 8B", read_of(Function::kReadHolding, 3), {0x3900, 0x00FF, 0x0E0A}},
      {"object held", "09 03 06 B9 00 00 FF BD 00 1D 7C", read_of(Function::kReadHolding, 3), {0xB900, 0x00FF, 0xBD00}},
      {"object held, input",
       "09 04 06 B9 00 00 FF BD 00 5C 9A",
       read_of(Function::kReadInput, 3),
       {0xB900, 0x00FF, 0xBD00}},
      {"opening", "09 04 06 39 00 00 00 BB 10 71 06", read_of(Function::kReadInput, 3), {0x3900, 0x0000, 0xBB10}},
      {"open", "09 04 06 F9 00 00 00 0D 00 17 AA", read_of(Function::kReadInput, 3), {0xF900, 0x0000, 0x0D00}},
      {"read and write", "09 17 04 01 00 09 E6 F6 C1", all.back().request, {0x0100, 0x09E6}},
  };
}

}  // namespace embody::test
