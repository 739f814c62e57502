#include "drivers/ur_rtde/ur_rtde_arm.hpp"

#include <linux/sockios.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "drivers/transport/clock.hpp"
#include "drivers/transport/tcp.hpp"

namespace embody {
namespace {

using rtde::PackageType;

constexpr double kSeriesRate = 500.0;  // Hz: control cycles of e-Series and later
constexpr double kCb3Rate = 125.0;     // Hz

double control_rate_hz(const rtde::ControllerVersion& version) noexcept {
  return version.major <= 3 ? kCb3Rate : kSeriesRate;
}

/// The controller sends one package each floor(control rate / wanted rate) cycles.
double package_rate_hz(double control_hz, double wanted_hz) noexcept {
  return control_hz / std::max(1.0, std::floor(control_hz / wanted_hz));
}

/// Bytes handed to our kernel that the controller's kernel has not acknowledged yet.
int unacknowledged_bytes(int fd) noexcept {
  int bytes = 0;
  return ::ioctl(fd, SIOCOUTQ, &bytes) == 0 ? bytes : 0;
}

}  // namespace

UrRtdeArm::UrRtdeArm(UrRtdeConfig config) : config_(std::move(config)) {}

UrRtdeArm::~UrRtdeArm() {
  close_session();
}

Result<ArmInfo> UrRtdeArm::connect() {
  close_session();
  reason_ = {};
  last_text_ = {};
  if (!(config_.frequency_hz >= 1.0 && config_.frequency_hz <= kSeriesRate)) {
    return make_error(Errc::kInvalidArgument, "the arm's frequency is %g Hz; choose 1 to 500", config_.frequency_hz);
  }
  const TimePoint start = transport::now();
  const TimePoint deadline = start + config_.in_use_patience + config_.reply_timeout;
  auto fd = transport::tcp_connect(config_.host, config_.port, start + config_.reply_timeout);
  if (!fd) return fd.error();
  fd_ = std::move(*fd);
  buffer_.clear();

  const auto version = negotiate(deadline);
  if (!version) return give_up(version.error());
  const double control_hz = control_rate_hz(*version);
  const double wanted_hz = std::min(config_.frequency_hz, control_hz);
  if (const Status done = setup_outputs(wanted_hz, deadline); !done) return give_up(done.error());
  if (const Status done = setup_inputs(deadline); !done) return give_up(done.error());
  if (const Status done = start_stream(deadline); !done) return give_up(done.error());

  const std::string release =
      std::to_string(version->major) + "." + std::to_string(version->minor) + "." + std::to_string(version->bugfix);
  ArmInfo info{fd_.get(), package_rate_hz(control_hz, wanted_hz), {}};
  info.peer = std::string_view("UR controller " + release + " at " + config_.host + ":" + std::to_string(config_.port));
  return info;
}

Status UrRtdeArm::service() {
  return {};
}

Result<rtde::ControllerVersion> UrRtdeArm::negotiate(TimePoint deadline) {
  constexpr std::uint16_t kVersion = 2;
  auto reply = exchange(PackageType::kProtocolVersion, rtde::encode_protocol_request(kVersion), deadline);
  if (!reply) return reply.error();
  const auto accepted = rtde::decode_accepted(reply->payload);
  if (!accepted) return make_error(Errc::kMalformed, "the reply about the protocol version is not an RTDE reply");
  if (!*accepted) {
    return make_error(Errc::kUnsupported, "the controller does not speak RTDE version 2: update its firmware");
  }
  reply = exchange(PackageType::kControllerVersion, rtde::encode_request(PackageType::kControllerVersion), deadline);
  if (!reply) return reply.error();
  const auto version = rtde::decode_controller_version(reply->payload);
  if (!version) return make_error(Errc::kMalformed, "the controller's version has a wrong size");
  return *version;
}

Status UrRtdeArm::setup_outputs(double frequency_hz, TimePoint deadline) {
  const std::string names = rtde::join_names(rtde::kOutputRecipe);
  const auto frame = exchange(PackageType::kSetupOutputs, rtde::encode_outputs_request(frequency_hz, names), deadline);
  if (!frame) return frame.error();
  const auto reply = rtde::decode_setup_reply(frame->payload);
  if (!reply) return make_error(Errc::kMalformed, "the reply to the output recipe is empty");
  output_recipe_ = reply->recipe;
  return rtde::check_setup_reply(rtde::kOutputRecipe, *reply);
}

// After a cable was pulled the controller keeps our registers for the lost session until its TCP gives up: try again.
Status UrRtdeArm::setup_inputs(TimePoint deadline) {
  constexpr Duration kFirstPause = std::chrono::milliseconds(100);
  constexpr Duration kLongestPause = std::chrono::milliseconds(800);
  const auto request = rtde::encode_inputs_request(rtde::join_names(rtde::kInputRecipe));
  const TimePoint give_up = transport::now() + config_.in_use_patience;
  for (Duration pause = kFirstPause;; pause = std::min(2 * pause, kLongestPause)) {
    const auto frame = exchange(PackageType::kSetupInputs, request, deadline);
    if (!frame) return frame.error();
    const auto reply = rtde::decode_setup_reply(frame->payload);
    if (!reply) return make_error(Errc::kMalformed, "the reply to the input recipe is empty");
    input_recipe_ = reply->recipe;
    const Status check = rtde::check_setup_reply(rtde::kInputRecipe, *reply);
    const bool in_use = !check && check.error().code == Errc::kRefused;
    if (!in_use || transport::now() + pause > give_up) return check;
    if (const Status waited = idle_until(transport::now() + pause); !waited) return waited;
  }
}

// Mode 0 goes out before the stream starts: registers keep what a lost session wrote.
Status UrRtdeArm::start_stream(TimePoint deadline) {
  if (send_hold(last_sequence_) != IoStatus::kDone) {
    return make_error(Errc::kDisconnected, "the controller closed the connection during the set-up");
  }
  const auto frame = exchange(PackageType::kStart, rtde::encode_request(PackageType::kStart), deadline);
  if (!frame) return frame.error();
  const auto accepted = rtde::decode_accepted(frame->payload);
  if (!accepted) return make_error(Errc::kMalformed, "the reply to the start request has a wrong size");
  if (!*accepted) return make_error(Errc::kRefused, "the controller refuses to start the RTDE stream");
  streaming_ = true;
  packages_ = 0;
  blocked_since_ = {};
  t_received_ = transport::now();
  return {};
}

Result<rtde::Frame> UrRtdeArm::exchange(PackageType type, rtde::Bytes request, TimePoint deadline) {
  const TimePoint reply_by = std::min(deadline, transport::now() + config_.reply_timeout);
  if (const Status sent = transport::send_all(fd_.get(), request, reply_by); !sent) return sent.error();
  while (true) {
    const auto parsed = next_frame(reply_by);
    if (!parsed) return parsed.error();
    if (parsed->framing == rtde::Framing::kComplete && parsed->frame.is(type)) return parsed->frame;
    if (parsed->framing == rtde::Framing::kIncomplete || transport::now() >= reply_by) {
      return make_error(Errc::kTimeout, "no reply to the RTDE request '%c' within %.1f s", static_cast<char>(type),
                        to_seconds(config_.reply_timeout));
    }
  }
}

Status UrRtdeArm::idle_until(TimePoint until) {
  while (true) {
    const auto parsed = next_frame(until);
    if (!parsed) return parsed.error();
    if (parsed->framing == rtde::Framing::kIncomplete || transport::now() >= until) return {};
  }
}

/// The next package of any type, or framing kIncomplete at the deadline.
Result<rtde::ParsedFrame> UrRtdeArm::next_frame(TimePoint deadline) {
  while (true) {
    const rtde::ParsedFrame parsed = buffer_.next();
    if (parsed.framing == rtde::Framing::kBroken) {
      return make_error(Errc::kMalformed, "the peer does not speak RTDE (a package smaller than its header)");
    }
    if (parsed.framing == rtde::Framing::kComplete) {
      if (parsed.frame.is(PackageType::kText)) remember_text(parsed.frame.payload);
      return parsed;
    }
    if (!transport::wait_readable(fd_.get(), deadline)) return parsed;
    const auto received = transport::receive(fd_.get(), buffer_.space());
    if (received.status == IoStatus::kDisconnected) {
      return make_error(
          Errc::kDisconnected,
          "the controller closed the connection during the set-up: too many RTDE clients, or it restarts");
    }
    buffer_.commit(received.size);
  }
}

/// Ends the failed set-up and adds where it happened, and the controller's last words.
Error UrRtdeArm::give_up(const Error& error) {
  close_session();
  return make_error(error.code, "%s:%u: %s%s%s", config_.host.c_str(), unsigned{config_.port}, error.detail.c_str(),
                    last_text_.empty() ? "" : "; the controller says: ", last_text_.c_str());
}

void UrRtdeArm::remember_text(rtde::Bytes payload) noexcept {
  if (const auto text = rtde::decode_text(payload)) last_text_ = text->message;
}

IoStatus UrRtdeArm::read(ArmState& state) noexcept {
  constexpr int kReceives = 2;  // the second one finishes a package that the first one cut
  for (int receives = 0; streaming_;) {
    const rtde::ParsedFrame parsed = buffer_.next();
    if (parsed.framing == rtde::Framing::kBroken) return end_session("the controller's bytes are not RTDE packages");
    if (parsed.framing == rtde::Framing::kComplete) {
      if (parsed.frame.is(PackageType::kText)) remember_text(parsed.frame.payload);
      if (!parsed.frame.is(PackageType::kData)) continue;
      const auto fields =
          rtde::decode_data(parsed.frame.payload, output_recipe_, rtde::fields_size(rtde::kOutputRecipe));
      if (!fields) return end_session("a data package does not fit the recipe");
      if (!rtde::decode_state(*fields, state)) return end_session("the controller sent values that are not finite");
      state.package = ++packages_;
      state.t_arrival = t_received_;
      return IoStatus::kDone;
    }
    if (receives++ == kReceives) return IoStatus::kEmpty;
    const auto received = transport::receive(fd_.get(), buffer_.space());
    if (received.status == IoStatus::kDisconnected) return end_session("the controller closed the connection");
    if (received.status == IoStatus::kEmpty) return IoStatus::kEmpty;
    t_received_ = transport::now();
    buffer_.commit(received.size);
  }
  return IoStatus::kDisconnected;
}

// The newest command wins: after an interruption the controller must not find a pile of old ones.
IoStatus UrRtdeArm::write(const ArmCommand& command, TimePoint now) noexcept {
  constexpr int kMostUnacknowledged = 4096;  // 38 commands, 76 ms at 500 Hz
  if (!streaming_) return IoStatus::kDisconnected;
  if (now > command.t_expires) return IoStatus::kRefused;
  const bool finite = command.q_rad.allFinite() && command.qd_rad_s.allFinite();
  if (command.action == ArmAction::kTrack && !finite) return IoStatus::kRefused;
  rtde::encode_command(command, input_recipe_, package_);
  const bool backlog = unacknowledged_bytes(fd_.get()) > kMostUnacknowledged;
  const IoStatus status = backlog ? IoStatus::kEmpty : transport::send_message(fd_.get(), package_);
  if (status == IoStatus::kDisconnected) return end_session("the controller closed the connection");
  if (status == IoStatus::kDone) {
    last_sequence_ = command.sequence & rtde::kSequenceMask;
    blocked_since_ = {};
    return status;
  }
  if (blocked_since_ == TimePoint{}) blocked_since_ = now;
  if (now - blocked_since_ > config_.backlog_limit) return end_session("commands do not reach the controller any more");
  return status;
}

IoStatus UrRtdeArm::send_hold(std::uint32_t sequence) noexcept {
  ArmCommand hold;
  hold.sequence = sequence;
  rtde::encode_command(hold, input_recipe_, package_);
  return transport::send_message(fd_.get(), package_);
}

IoStatus UrRtdeArm::end_session(std::string_view reason) noexcept {
  streaming_ = false;
  reason_ = reason;
  return IoStatus::kDisconnected;
}

// The controller must read the last package before it sees a reset: close only after it has closed, or after 100 ms.
void UrRtdeArm::close_session() noexcept {
  constexpr Duration kPatience = std::chrono::milliseconds(100);
  if (!fd_) return;
  if (input_recipe_ != 0) (void)send_hold(last_sequence_ + 1);
  ::shutdown(fd_.get(), SHUT_WR);
  const TimePoint deadline = transport::now() + kPatience;
  buffer_.clear();
  while (transport::now() < deadline && transport::wait_readable(fd_.get(), deadline)) {
    if (transport::receive(fd_.get(), buffer_.space()).status == IoStatus::kDisconnected) break;
  }
  fd_.reset();
  streaming_ = false;
  input_recipe_ = output_recipe_ = 0;
}

}  // namespace embody
