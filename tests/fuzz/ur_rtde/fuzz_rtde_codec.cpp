// Any bytes through the client's side of RTDE: framing in parts, every decoder, states.
#include <algorithm>
#include <array>
#include <cstdlib>

#include "drivers/ur_rtde/arm_package.hpp"
#include "drivers/ur_rtde/frame_buffer.hpp"

namespace {

using namespace embody;

void check(bool property) {
  if (!property) std::abort();
}

void decode(const rtde::Frame& frame) {
  const rtde::Bytes payload = frame.payload;
  (void)rtde::decode_protocol_request(payload);
  (void)rtde::decode_accepted(payload);
  (void)rtde::decode_controller_version(payload);
  (void)rtde::decode_text_v1(payload);
  (void)rtde::decode_outputs_request(payload);
  if (const auto text = rtde::decode_text(payload)) check(text->message.size() + text->source.size() < payload.size());
  if (const auto reply = rtde::decode_setup_reply(payload)) {
    if (rtde::check_setup_reply(rtde::kInputRecipe, *reply)) check(reply->recipe != 0);
  }
  rtde::OutputRecipe recipe;
  (void)recipe.drop_unknown(rtde::as_text(payload));
  check(recipe.size() >= rtde::fields_size(rtde::kOutputRecipe));
  ArmState state;
  const std::size_t size = rtde::fields_size(rtde::kOutputRecipe);
  const rtde::Bytes fields = payload.first(std::min(size, payload.size()));
  if (fields.size() == size && rtde::decode_state(fields, state)) {
    check(state.q_rad.allFinite() && state.qd_rad_s.allFinite() && state.q_target_rad.allFinite());
    check(!state.tracking || state.condition == ArmCondition::kReady);
  }
}

}  // namespace

// The first byte chooses how large the parts are in which the stream arrives.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static rtde::FrameBuffer buffer;
  buffer.clear();
  if (size == 0) return 0;
  const std::size_t part = 1U + data[0];
  rtde::Bytes stream = std::as_bytes(std::span(data + 1, size - 1));
  bool broken = false;
  while (!stream.empty() && !broken) {
    const rtde::Bytes arrived = stream.first(std::min({part, stream.size(), buffer.space().size()}));
    check(!arrived.empty());
    std::copy(arrived.begin(), arrived.end(), buffer.space().begin());
    buffer.commit(arrived.size());
    stream = stream.subspan(arrived.size());
    rtde::ParsedFrame parsed = buffer.next();
    for (; parsed.framing == rtde::Framing::kComplete; parsed = buffer.next()) decode(parsed.frame);
    broken = parsed.framing == rtde::Framing::kBroken;
  }
  return 0;
}
