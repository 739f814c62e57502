// The bytes of one client, in chunks: whatever it sends, the simulated QTM answers or drops it, never acknowledges a
// stream, and every reply and frame that follows has the sizes it claims.
#include <algorithm>
#include <cstdint>
#include <cstdlib>

#include "drivers/sim/qtm/command_desk.hpp"
#include "drivers/sim/qtm/frame_encoder.hpp"

namespace {

using namespace embody;
using namespace embody::sim;

QtmSetup some_setup() {
  QtmSetup setup;
  setup.rate_hz = 100.0;
  setup.axis = "+Z";
  setup.labels = {"a", "b & <c>"};
  setup.bodies = {{"hand", {{"a", {}}, {"b", {}}, {"c", {}}}}};
  return setup;
}

void check_frame(const std::vector<Component>& components, ByteOrder order) {
  FrameData frame;
  frame.markers.resize(2);
  frame.bodies.resize(1);
  const Bytes bytes = encode_frame(frame, components, order);
  const std::size_t at = order == ByteOrder::kLittle ? 0 : 2;
  const std::size_t low = std::to_integer<std::size_t>(bytes[order == ByteOrder::kLittle ? at : at + 1]);
  const std::size_t high = std::to_integer<std::size_t>(bytes[order == ByteOrder::kLittle ? at + 1 : at]);
  if (bytes.size() > 65'535 || bytes.size() != low + 256 * high) std::abort();
}

void check(const Conversation& talk, const Answer& answer) {
  if (answer.stream_changed && answer.reply) std::abort();
  if (talk.stream && (talk.stream->divisor == 0 || talk.stream->components.empty())) std::abort();
  if (talk.stream && talk.minor_version < kOldestMinorVersion) std::abort();
  if (talk.minor_version > kNewestMinorVersion) std::abort();
  if (talk.stream) check_frame(talk.stream->components, talk.order);
  if (talk.current_frame) check_frame(*talk.current_frame, talk.order);
  if (!answer.reply) return;
  if (const auto* reply = std::get_if<Reply>(&*answer.reply)) {
    if (reply->text.empty() || string_packet(reply->type, reply->text, talk.order).size() != reply->text.size() + 9) {
      std::abort();
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 2) return 0;
  const std::size_t chunk = 1 + data[0];
  Conversation talk;
  talk.id = 1;
  talk.peer = "127.0.0.1 (1)";
  talk.order = (data[1] & 1) != 0 ? ByteOrder::kBig : ByteOrder::kLittle;
  const QtmSetup setup = some_setup();
  Measurement measurement((data[1] & 2) != 0, (data[1] & 4) != 0, {"f"}, std::chrono::seconds(1));
  CommandDesk desk({}, measurement, setup);
  RequestReader reader(talk.order);
  auto rest = std::as_bytes(std::span(data + 2, size - 2));
  (void)discovery_reply_port(rest);
  while (!rest.empty()) {
    const auto part = rest.first(std::min(chunk, rest.size()));
    rest = rest.subspan(part.size());
    reader.push(part);
    while (true) {
      const auto request = reader.next();
      if (!request) return 0;
      if (!*request) break;
      check(talk, desk.answer(talk, **request, TimePoint{}));
      if (measurement.calibration_end()) (void)measurement.end_calibration();
    }
  }
  // The rest of the input once more as one command line of a client that is master.
  for (const std::string_view command : {std::string_view("Version 1.28"), std::string_view("TakeControl"),
                                         std::string_view(reinterpret_cast<const char*>(data) + 2, size - 2)}) {
    check(talk, desk.answer(talk, {1, command}, TimePoint{}));
  }
  return 0;
}
