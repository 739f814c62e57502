// Whatever frames come, joined messages are bounded, and what becomes of them is a line or nothing.
#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "drivers/mia/can_line.hpp"

namespace {

using namespace embody;  // NOLINT(google-build-using-namespace): a harness of one function

void require(bool condition) {
  if (!condition) std::abort();
}

void comes_back(std::string_view message) {
  if (message.empty() || message.size() > mia::kMaxMessage) return;
  mia::SegmentAssembler assembler(std::chrono::milliseconds(20));
  const mia::Segments segments = mia::split_message(message, 3);
  for (std::size_t i = 0; i < segments.count; ++i) {
    const auto joined = assembler.push({segments.frames[i].data.data(), segments.frames[i].size}, {});
    require(joined.has_value() == (i + 1 == segments.count));
    if (joined) require(*joined == message);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  mia::SegmentAssembler assembler(std::chrono::milliseconds(20));
  std::array<char, mia::kMaxMessage> buffer{};
  TimePoint now{std::chrono::seconds(1)};
  for (std::size_t i = 0; i < size;) {  // a length and a pause, then a frame of so many bytes
    const std::size_t length = std::min<std::size_t>(data[i] % 10, size - i - 1);
    now += std::chrono::milliseconds(data[i] / 64);
    const auto message = assembler.push({data + i + 1, length}, now);
    i += length + 1;
    if (!message) continue;
    require(!message->empty() && message->size() <= mia::kMaxMessage);
    if (const auto line = mia::line_of_message(*message, buffer)) {
      require(line->back() == '\n' && line->size() <= mia::kMaxLine + 2);
      static_cast<void>(mia::acknowledges(*line, mia::encode_plain(mia::kPingPayload)));
    }
    if (const auto command = mia::command_of_message(*message)) static_cast<void>(mia::parse_command(*command));
  }
  comes_back({reinterpret_cast<const char*>(data), size});
  return 0;
}
