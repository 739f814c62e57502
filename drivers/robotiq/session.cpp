// Begin and end of a session with a Robotiq gripper, and its activation: the parts that may wait.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "drivers/robotiq/robotiq_hand.hpp"
#include "drivers/transport/clock.hpp"
#include "drivers/transport/tty.hpp"

namespace embody::robotiq {
namespace {

constexpr Duration kProbeTime = std::chrono::milliseconds(1800);  ///< a gripper may still be starting
constexpr Duration kProbeStep = std::chrono::milliseconds(150);   ///< an adapter without low latency holds bytes 16 ms
constexpr Duration kGoodbyeTime = std::chrono::milliseconds(250);
constexpr Duration kTurn = std::chrono::milliseconds(5);

Status check_config(const RobotiqConfig& config) {
  const auto in_range = [](int value, int least, int most) { return value >= least && value <= most; };
  const PositionScale& scale = config.scale;
  if (!in_range(config.slave, 1, 247))
    return make_error(Errc::kInvalidArgument, "robotiq: slave is %d, must be 1..247", config.slave);
  if (!in_range(config.speed, 0, kMaxCounts) || !in_range(config.force, 0, kMaxCounts))
    return make_error(Errc::kInvalidArgument, "robotiq: speed (%d) and force (%d) must be 0..255", config.speed,
                      config.force);
  if (config.joint.empty() || config.joint.size() > 40)
    return make_error(Errc::kInvalidArgument, "robotiq: joint must be a name of 1 to 40 characters");
  if (!in_range(scale.open_counts, 0, kMaxCounts) || !in_range(scale.closed_counts, 0, kMaxCounts) ||
      scale.open_counts >= scale.closed_counts)
    return make_error(Errc::kInvalidArgument, "robotiq: open_counts (%d) must be below closed_counts (%d), both 0..255",
                      scale.open_counts, scale.closed_counts);
  if (!std::isfinite(scale.open_rad) || !std::isfinite(scale.closed_rad) || scale.open_rad >= scale.closed_rad)
    return make_error(Errc::kInvalidArgument, "robotiq: open_rad and closed_rad are not a range");
  if (!std::isfinite(config.rate_hz) || config.rate_hz < 1.0 || config.rate_hz > 200.0)
    return make_error(Errc::kInvalidArgument, "robotiq: rate_hz must be 1..200");
  if (config.reply_timeout <= Duration::zero() || config.frame_gap < Duration::zero() || config.lost_after_failures < 1)
    return make_error(Errc::kInvalidArgument,
                      "robotiq: reply_timeout and lost_after_failures must be positive, frame_gap not negative");
  return {};
}

/// Sends `request` and waits for its answer.
std::optional<modbus::Reply> exchange(int fd, const modbus::Request& request, TimePoint deadline) {
  modbus::Assembler incoming;
  std::array<std::byte, 128> buffer;
  for (int i = 0; i < 8 && transport::read_tty(fd, buffer).status == IoStatus::kDone; ++i) {  // what is on the way
  }
  if (transport::write_tty(fd, modbus::encode_request(request).view()) != IoStatus::kDone) return std::nullopt;
  while (transport::wait_readable(fd, deadline)) {
    const auto [status, size] = transport::read_tty(fd, buffer);
    if (status == IoStatus::kDisconnected) return std::nullopt;
    incoming.push({buffer.data(), size});
    if (const auto reply = incoming.take_reply(request)) return reply;
  }
  return std::nullopt;
}

}  // namespace

Result<HandInfo> RobotiqHand::connect() {
  end_session();
  if (const Status usable = check_config(config_); !usable) return usable.error();
  auto tty = transport::open_tty(config_.device);
  if (!tty) return tty.error();
  fd_ = std::move(tty->fd);
  bus_ = {};
  cycle_ = {};
  told_ = {};
  stop_ = {};
  activation_ = {};
  status_ = {};
  activation_asked_.store(0, std::memory_order_relaxed);
  incoming_.clear();
  auto info = probe();
  if (!info) {
    fd_.reset();
    return info;
  }
  lost_ = hung_up_ = false;
  reason_ = {};
  return info;
}

Result<HandInfo> RobotiqHand::probe() {
  const char* device = config_.device.c_str();
  const TimePoint deadline = transport::now() + kProbeTime;
  std::optional<modbus::Reply> reply;
  while (!reply && transport::now() < deadline) {
    const TimePoint until = std::min(deadline, transport::now() + kProbeStep);
    reply = exchange(fd_.get(), status_request(), until);
    // A dead line answers at once: do not spin on it.
    if (!reply && transport::now() < until && !transport::wait_readable(fd_.get(), until)) continue;
    std::byte rubbish;
    if (!reply && transport::read_tty(fd_.get(), {&rubbish, 1}).status == IoStatus::kDisconnected) break;
  }
  if (!reply)
    return make_error(Errc::kTimeout,
                      "no Robotiq gripper answers at %s as slave %d: check power, cable and device name", device,
                      config_.slave);
  if (reply->exception != 0)
    return make_error(Errc::kUnsupported,
                      "slave %d at %s does not tell its status (Modbus exception %d, %s): is it a Robotiq gripper?",
                      config_.slave, device, reply->exception, modbus::exception_text(reply->exception));
  take_status(*reply, transport::now());
  status_.fresh = false;
  HandInfo info;
  info.fd = fd_.get();
  info.rate_hz = config_.rate_hz;
  info.joint_count = 1;
  info.joint_names[0] = std::string_view(config_.joint);
  const GripperStatus& status = status_.last;
  std::array<char, 121> peer{};
  std::snprintf(peer.data(), peer.size(), "Robotiq gripper at %.40s, slave %d, %s, fault %d", device, config_.slave,
                status.activated() ? "activated" : "not activated", status.fault);
  info.peer = peer.data();
  return info;
}

Status RobotiqHand::activate(Duration limit, const std::function<bool()>& cancelled) {
  const TimePoint deadline = transport::now() + limit;
  HandCommand hold;
  hold.action = HandAction::kHold;
  HandDeviceState state;
  static_cast<void>(write(hold, transport::now()));
  request_activation();
  while (transport::now() < deadline) {
    if (cancelled && cancelled()) {
      end_session();
      return make_error(Errc::kRefused, "interrupted: the gripper was reset%s; activate it again",
                        stop_.acknowledged ? "" : ", but did not answer: watch it");
    }
    if (write(hold, transport::now()) == IoStatus::kDisconnected)
      return make_error(Errc::kDisconnected, "cannot activate: %s", reason_.empty() ? "no session" : reason_.c_str());
    const bool taken_up = activation_asked_.load(std::memory_order_relaxed) == 0;
    if (taken_up && !activating() && !stop_.under_way) {
      if (why_not().empty()) return {};
      return make_error(Errc::kRefused, "the gripper was not activated: %.180s", std::string(why_not()).c_str());
    }
    static_cast<void>(transport::wait_readable(fd_.get(), transport::now() + kTurn));
    static_cast<void>(read(state));
  }
  return make_error(Errc::kTimeout, "the gripper's activation did not end in time: is something in its way?");
}

void RobotiqHand::end_session() noexcept {
  if (!fd_ || hung_up_) {
    fd_.reset();
    return;
  }
  if (!known_activated(transport::now()) && !stop_.under_way) {  // a reset takes the activation: look before
    const auto reply = exchange(fd_.get(), status_request(), transport::now() + config_.reply_timeout);
    if (reply && reply->count == kRegisterCount) take_status(*reply, transport::now());
    bus_.waiting = false;
  }
  stop_.acknowledged = false;  // say it again, whatever was said before
  request_stop();
  cycle_.status_pending = false;
  lost_ = false;
  const TimePoint deadline = transport::now() + kGoodbyeTime;
  while ((stop_.under_way || bus_.waiting) && !hung_up_ && transport::now() < deadline) {
    const TimePoint next = bus_.waiting ? bus_.deadline : bus_.quiet_until;
    static_cast<void>(transport::wait_readable(fd_.get(), std::min(deadline, next)));
    pump();
  }
  lost_ = hung_up_ = true;
  fd_.reset();
}

}  // namespace embody::robotiq
