#include "drivers/ur_rtde/rtde_setup.hpp"

#include <algorithm>
#include <cmath>

#include "drivers/transport/clock.hpp"
#include "drivers/transport/tcp.hpp"

namespace embody::rtde {
namespace {

double control_rate_hz(const ControllerVersion& version) noexcept {
  constexpr double kSeriesRate = 500.0;  // e-Series and later
  constexpr double kCb3Rate = 125.0;
  return version.major <= 3 ? kCb3Rate : kSeriesRate;
}

/// The controller sends one package each floor(control rate / wanted rate) cycles.
double package_rate_hz(double control_hz, double wanted_hz) noexcept {
  return control_hz / std::max(1.0, std::floor(control_hz / wanted_hz));
}

}  // namespace

Result<Session> Setup::run(TimePoint deadline) {
  if (const Status done = negotiate(deadline); !done) return done.error();
  const double control_hz = control_rate_hz(session_.version);
  config_.frequency_hz = std::min(config_.frequency_hz, control_hz);
  session_.rate_hz = package_rate_hz(control_hz, config_.frequency_hz);
  if (const Status done = setup_outputs(deadline); !done) return done.error();
  if (const Status done = setup_inputs(deadline); !done) return done.error();
  if (const Status done = start_stream(deadline); !done) return done.error();
  return session_;
}

Status Setup::negotiate(TimePoint deadline) {
  constexpr std::uint16_t kVersion = 2;
  auto reply = exchange(PackageType::kProtocolVersion, encode_protocol_request(kVersion), deadline);
  if (!reply) return reply.error();
  const auto accepted = decode_accepted(reply->payload);
  if (!accepted) return make_error(Errc::kMalformed, "the reply about the protocol version is not an RTDE reply");
  if (!*accepted) {
    return make_error(Errc::kUnsupported, "the controller does not speak RTDE version 2: update its firmware");
  }
  reply = exchange(PackageType::kControllerVersion, encode_request(PackageType::kControllerVersion), deadline);
  if (!reply) return reply.error();
  const auto version = decode_controller_version(reply->payload);
  if (!version) return make_error(Errc::kMalformed, "the controller's version has a wrong size");
  session_.version = *version;
  return {};
}

// Asked for once more without the optional variables that this firmware does not have.
Status Setup::setup_outputs(TimePoint deadline) {
  while (true) {
    const auto request = encode_outputs_request(config_.frequency_hz, join_names(session_.outputs.variables()));
    const auto frame = exchange(PackageType::kSetupOutputs, request, deadline);
    if (!frame) return frame.error();
    const auto reply = decode_setup_reply(frame->payload);
    if (!reply) return make_error(Errc::kMalformed, "the reply to the output recipe is empty");
    session_.output_id = reply->recipe;
    const Status check = check_setup_reply(session_.outputs.variables(), *reply);
    if (check || !session_.outputs.drop_unknown(reply->types)) return check;
  }
}

// After a cable was pulled the controller keeps our registers for the lost session until its TCP gives up: try again.
Status Setup::setup_inputs(TimePoint deadline) {
  constexpr Duration kFirstPause = std::chrono::milliseconds(100);
  constexpr Duration kLongestPause = std::chrono::milliseconds(800);
  const auto request = encode_inputs_request(join_names(kInputRecipe));
  const TimePoint give_up = transport::now() + config_.in_use_patience;
  for (Duration pause = kFirstPause;; pause = std::min(2 * pause, kLongestPause)) {
    const auto frame = exchange(PackageType::kSetupInputs, request, deadline);
    if (!frame) return frame.error();
    const auto reply = decode_setup_reply(frame->payload);
    if (!reply) return make_error(Errc::kMalformed, "the reply to the input recipe is empty");
    session_.input_id = reply->recipe;
    const Status check = check_setup_reply(kInputRecipe, *reply);
    const bool in_use = !check && check.error().code == Errc::kRefused;
    if (!in_use || transport::now() + pause > give_up) return check;
    if (const Status waited = idle_until(transport::now() + pause); !waited) return waited;
  }
}

// Mode 0 goes out before the stream starts: registers keep what a lost session wrote.
Status Setup::start_stream(TimePoint deadline) {
  CommandPackage greeting{};
  ArmCommand hold;
  hold.sequence = config_.greeting_sequence;
  encode_command(hold, session_.input_id, greeting);
  if (const Status sent = transport::send_all(fd_, greeting, deadline); !sent) return sent;
  const auto frame = exchange(PackageType::kStart, encode_request(PackageType::kStart), deadline);
  if (!frame) return frame.error();
  const auto accepted = decode_accepted(frame->payload);
  if (!accepted) return make_error(Errc::kMalformed, "the reply to the start request has a wrong size");
  if (!*accepted) return make_error(Errc::kRefused, "the controller refuses to start the RTDE stream");
  return {};
}

Result<Frame> Setup::exchange(PackageType type, Bytes request, TimePoint deadline) {
  const TimePoint reply_by = std::min(deadline, transport::now() + config_.reply_timeout);
  if (const Status sent = transport::send_all(fd_, request, reply_by); !sent) return sent.error();
  while (true) {
    const auto parsed = next_frame(reply_by);
    if (!parsed) return parsed.error();
    if (parsed->framing == Framing::kComplete && parsed->frame.is(type)) return parsed->frame;
    if (parsed->framing == Framing::kIncomplete || transport::now() >= reply_by) {
      return make_error(Errc::kTimeout, "no reply to the RTDE request '%c' within %.1f s", static_cast<char>(type),
                        to_seconds(config_.reply_timeout));
    }
  }
}

Status Setup::idle_until(TimePoint until) {
  while (true) {
    const auto parsed = next_frame(until);
    if (!parsed) return parsed.error();
    if (parsed->framing == Framing::kIncomplete || transport::now() >= until) return {};
  }
}

/// The next package of any type, or framing kIncomplete at the deadline.
Result<ParsedFrame> Setup::next_frame(TimePoint deadline) {
  while (true) {
    const ParsedFrame parsed = buffer_.next();
    if (parsed.framing == Framing::kBroken) {
      return make_error(Errc::kMalformed, "the peer does not speak RTDE (a package smaller than its header)");
    }
    if (parsed.framing == Framing::kComplete) {
      if (!parsed.frame.is(PackageType::kText)) return parsed;
      if (const auto text = decode_text(parsed.frame.payload)) last_text_ = text->message;
      return parsed;
    }
    if (!transport::wait_readable(fd_, deadline)) return parsed;
    const auto received = transport::receive(fd_, buffer_.space());
    if (received.status == IoStatus::kDisconnected) {
      return make_error(
          Errc::kDisconnected,
          "the controller closed the connection during the set-up: too many RTDE clients, or it restarts");
    }
    buffer_.commit(received.size);
  }
}

}  // namespace embody::rtde
