#include "drivers/ur_rtde/ur_rtde_arm.hpp"

#include <linux/sockios.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "drivers/transport/clock.hpp"
#include "drivers/transport/tcp.hpp"
#include "drivers/ur_rtde/program_upload.hpp"

namespace embody {
namespace {

using rtde::PackageType;

/// Bytes handed to our kernel that the controller's kernel has not acknowledged yet.
int unacknowledged_bytes(int fd) noexcept {
  int bytes = 0;
  return ::ioctl(fd, SIOCOUTQ, &bytes) == 0 ? bytes : 0;
}

}  // namespace

UrRtdeArm::UrRtdeArm(UrRtdeConfig config) : config_(std::move(config)), echo_(config_.echo_patience) {
  show({{"packages", &counters_.packages},
        {"missing", &counters_.missing},
        {"stale", &counters_.stale},
        {"commands", &counters_.commands},
        {"refused", &counters_.refused},
        {"blocked", &counters_.blocked},
        {"messages", &counters_.messages},
        {"silences", &counters_.silences},
        {"uploads", &counters_.uploads},
        {"upload_failures", &counters_.upload_failures}});
}

UrRtdeArm::~UrRtdeArm() {
  close_session();
}

Result<ArmInfo> UrRtdeArm::connect() {
  constexpr double kFastest_hz = 500.0;
  close_session();
  reason_ = {};
  last_text_ = {};
  shared_.reset();
  if (!(config_.frequency_hz >= 1.0 && config_.frequency_hz <= kFastest_hz)) {
    return make_error(Errc::kInvalidArgument, "the arm's frequency is %g Hz; choose 1 to 500", config_.frequency_hz);
  }
  const auto script = rtde::control_script(config_.script);
  if (config_.upload && !script) return script.error();
  const TimePoint start = transport::now();
  auto fd = transport::tcp_connect(config_.host, config_.port, start + config_.reply_timeout);
  if (!fd) return fd.error();
  fd_ = std::move(*fd);
  buffer_.clear();
  rtde::Setup setup(fd_.get(), buffer_,
                    {config_.frequency_hz, config_.reply_timeout, config_.in_use_patience, last_sequence_});
  const auto session = setup.run(start + config_.in_use_patience + config_.reply_timeout);
  last_text_ = setup.last_text();
  if (!session) return give_up(session.error());
  session_ = *session;
  time_scale_offset_ = session_.outputs.offset("time_scale_source");
  const bool has_settings = session_.outputs.offset("payload") != 0 && session_.outputs.offset("payload_cog") != 0 &&
                            session_.outputs.offset("tcp_offset") != 0;
  settings_offset_ = has_settings ? session_.outputs.offset("payload") : 0;
  streaming_ = true;
  packages_ = 0;
  blocked_since_ = {};
  controller_time_ = Duration::min();
  t_advanced_ = t_received_ = transport::now();
  echo_.reset(last_sequence_);
  answers_ = true;
  program_.reset();
  if (config_.upload) {
    program_ = std::make_unique<ur::ProgramUpload>(ur::ProgramUploadConfig{
        .host = config_.host, .port = config_.primary_port, .program = *script, .retry_after = config_.upload_retry});
  }

  const auto& version = session_.version;
  const std::string release =
      std::to_string(version.major) + "." + std::to_string(version.minor) + "." + std::to_string(version.bugfix);
  ArmInfo info{fd_.get(), session_.rate_hz, {}};
  info.peer = std::string_view("UR controller " + release + " at " + config_.host + ":" + std::to_string(config_.port));
  return info;
}

Status UrRtdeArm::service() {
  if (program_ != nullptr) {
    const auto uploads = program_->uploads(), failures = program_->failures();
    const Status done = program_->service(shared_);
    counters_.uploads += program_->uploads() - uploads;
    counters_.upload_failures += program_->failures() - failures;
    if (!done) return done;
    if (const auto& reported = program_->kinematics()) {
      if (const Status fits = ur::check_geometry(config_.expected, *reported, session_.version.major); !fits) {
        return fits;
      }
    }
  }
  const bool known = settings_offset_ != 0 && shared_.snapshot().packages > 0;
  if (!known || !config_.expected.has_settings()) return {};
  return ur::check_settings(config_.expected, shared_.settings());
}

std::optional<ur::UrKinematics> UrRtdeArm::kinematics() const {
  return program_ == nullptr ? std::nullopt : program_->kinematics();
}

/// Ends the failed set-up and adds where it happened, and the controller's last words.
Error UrRtdeArm::give_up(const Error& error) {
  close_session();
  return make_error(error.code, "%s:%u: %s%s%s", config_.host.c_str(), unsigned{config_.port}, error.detail.c_str(),
                    last_text_.empty() ? "" : "; the controller says: ", last_text_.c_str());
}

IoStatus UrRtdeArm::read(ArmState& state) noexcept {
  constexpr int kReceives = 2;  // the second one finishes a package that the first one cut
  for (int receives = 0; streaming_;) {
    const rtde::ParsedFrame parsed = buffer_.next();
    if (parsed.framing == rtde::Framing::kBroken) return end_session("the controller's bytes are not RTDE packages");
    if (parsed.framing == rtde::Framing::kComplete) {
      const IoStatus taken = take_frame(parsed.frame, state);
      if (taken == IoStatus::kEmpty) continue;
      return taken;
    }
    if (receives++ == kReceives) return check_clock();
    const auto received = transport::receive(fd_.get(), buffer_.space());
    if (received.status == IoStatus::kDisconnected) return end_session("the controller closed the connection");
    if (received.status == IoStatus::kEmpty) return check_clock();
    t_received_ = transport::now();
    buffer_.commit(received.size);
  }
  return IoStatus::kDisconnected;
}

/// kDone for a state, kEmpty for anything else that may be skipped.
IoStatus UrRtdeArm::take_frame(const rtde::Frame& frame, ArmState& state) noexcept {
  if (frame.is(PackageType::kText)) {
    if (const auto text = rtde::decode_text(frame.payload)) last_text_ = text->message;
    ++counters_.messages;
  }
  if (!frame.is(PackageType::kData)) return IoStatus::kEmpty;
  const auto fields = rtde::decode_data(frame.payload, session_.output_id, session_.outputs.size());
  if (!fields) return end_session("a data package does not fit the recipe");
  return take_state(*fields, state);
}

IoStatus UrRtdeArm::take_state(rtde::Bytes fields, ArmState& state) noexcept {
  if (!rtde::decode_state(fields, state)) return end_session("the controller sent values that are not finite");
  if (state.controller_time < controller_time_) return end_session("the controller restarted: its clock went back");
  if (state.controller_time > controller_time_) t_advanced_ = t_received_;
  count_package(state.controller_time);
  controller_time_ = state.controller_time;
  state.package = ++packages_;
  state.t_arrival = t_received_;
  echo_.seen(state.echo_sequence, t_received_);
  const bool answers = echo_.answers(t_received_);
  if (!answers && answers_) ++counters_.silences;
  answers_ = answers;
  if (!answers && state.condition == ArmCondition::kReady) {
    state.condition = ArmCondition::kProgramStopped;
    state.tracking = false;
  }
  rtde::ControllerStatus status = rtde::decode_status(fields);
  if (time_scale_offset_ != 0) status.time_scale_source = rtde::load<std::int32_t>(fields, time_scale_offset_);
  if (settings_offset_ != 0) publish_settings(fields);
  shared_.publish(packages_, status, answers);
  return t_received_ - t_advanced_ > config_.stale_after ? check_clock() : IoStatus::kDone;
}

/// @pre not before the last package
void UrRtdeArm::count_package(Duration controller_time) noexcept {
  ++counters_.packages;
  if (controller_time_ == Duration::min()) return;
  const Duration step = controller_time - controller_time_;
  if (step == Duration::zero()) ++counters_.stale;
  const auto periods = std::llround(to_seconds(step) * session_.rate_hz);
  if (periods > 1) counters_.missing += static_cast<std::uint64_t>(periods - 1);
}

void UrRtdeArm::publish_settings(rtde::Bytes fields) noexcept {
  rtde::ArmSettings settings;
  std::size_t offset = settings_offset_;
  const auto take = [&] { return rtde::load<double>(fields, std::exchange(offset, offset + sizeof(double))); };
  settings.payload_kg = take();
  for (double& value : settings.cog_m) value = take();
  for (double& value : settings.tcp) value = take();
  shared_.publish_settings(settings);
}

/// kEmpty while the controller's clock advances.
IoStatus UrRtdeArm::check_clock() noexcept {
  if (transport::now() - t_advanced_ <= config_.stale_after) return IoStatus::kEmpty;
  return end_session("the controller fell silent, or its clock stands still");
}

// The newest command wins: after an interruption the controller must not find a pile of old ones.
IoStatus UrRtdeArm::write(const ArmCommand& command, TimePoint now) noexcept {
  constexpr int kMostUnacknowledged = 4096;  // 38 commands, 76 ms at 500 Hz
  if (!streaming_) return IoStatus::kDisconnected;
  const bool finite = command.q_rad.allFinite() && command.qd_rad_s.allFinite();
  if (now > command.t_expires || (command.action == ArmAction::kTrack && !finite)) {
    ++counters_.refused;
    return IoStatus::kRefused;
  }
  rtde::encode_command(command, session_.input_id, package_);
  const bool backlog = unacknowledged_bytes(fd_.get()) > kMostUnacknowledged;
  const IoStatus status = backlog ? IoStatus::kEmpty : transport::send_message(fd_.get(), package_);
  if (status == IoStatus::kDisconnected) return end_session("the controller closed the connection");
  if (status == IoStatus::kDone) {
    last_sequence_ = command.sequence & rtde::kSequenceMask;
    echo_.sent(last_sequence_, now);
    shared_.count_command();
    ++counters_.commands;
    blocked_since_ = {};
    return status;
  }
  ++counters_.blocked;
  if (blocked_since_ == TimePoint{}) blocked_since_ = now;
  if (now - blocked_since_ > config_.backlog_limit) return end_session("commands do not reach the controller any more");
  return status;
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
  if (session_.input_id != 0) {
    ArmCommand hold;
    hold.sequence = last_sequence_ + 1;
    rtde::encode_command(hold, session_.input_id, package_);
    (void)transport::send_message(fd_.get(), package_);
  }
  ::shutdown(fd_.get(), SHUT_WR);
  const TimePoint deadline = transport::now() + kPatience;
  buffer_.clear();
  while (transport::now() < deadline && transport::wait_readable(fd_.get(), deadline)) {
    if (transport::receive(fd_.get(), buffer_.space()).status == IoStatus::kDisconnected) break;
  }
  fd_.reset();
  streaming_ = false;
  session_ = {};
}

}  // namespace embody
