#include "daemon/app/daemon.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <thread>
#include <tuple>

#include "daemon/app/heap_guard.hpp"
#include "daemon/app/trackers.hpp"
#include "drivers/mia/mia_hand.hpp"
#include "drivers/transport/clock.hpp"
#include "drivers/ur_rtde/ur_rtde_arm.hpp"

namespace embody {
namespace {

using transport::now;

std::unique_ptr<ArmDriver> make_arm(const config::ArmConfig& config) {
  UrRtdeConfig ur;
  ur.host = config.host;
  ur.port = static_cast<std::uint16_t>(config.port);
  ur.frequency_hz = config.frequency_hz;
  return std::make_unique<UrRtdeArm>(ur);
}

std::unique_ptr<HandDriver> make_hand(const config::HandConfig& config) {
  mia::MiaConfig mia;
  mia.device = config.device;
  mia.speed_percent = config.speed_percent;
  return std::make_unique<mia::MiaHand>(mia);
}

/// Does the hand's file belong to the driver, and to the operator's hand?
Status check_hand(const config::EmbodyConfig& config) {
  const EmbodimentConfig& hand = config.hand.embodiment;
  if (!std::equal(hand.motors.begin(), hand.motors.end(), mia::kJointNames.begin(), mia::kJointNames.end())) {
    return make_error(Errc::kInvalidArgument,
                      "[hand] driver \"mia\" moves the motors %s, %s and %s; the hand file of \"%.40s\" has others",
                      mia::kJointNames[0], mia::kJointNames[1], mia::kJointNames[2], hand.name.c_str());
  }
  if (hand.side != config.subject.side) {
    const auto name = [](Side side) { return kSideNames[static_cast<std::size_t>(side)]; };
    return make_error(Errc::kInvalidArgument,
                      "[subject] side is %s, but [hand] side is %s: a hand follows its own kind",
                      name(config.subject.side), name(hand.side));
  }
  return {};
}

safety::ModeConfig mode_config(const config::SafetyConfig& config) {
  safety::ModeConfig modes;
  modes.hold_after = config.hold_after;
  modes.resume_within = config.resume_within;
  modes.resume_frames = static_cast<std::uint32_t>(config.resume_frames);
  modes.stop_after = config.stop_after;
  modes.unreachable_grace = config.unreachable_grace;
  return modes;
}

ArmLoopConfig arm_loop_config(const config::EmbodyConfig& config) {
  return {from_seconds(1.0 / config.arm.frequency_hz), config.safety.command_lifetime, config.safety.arming_grace};
}

safety::HandGateConfig hand_gate_config(const config::EmbodyConfig& config) {
  return {config.hand.joint_speed_rad_s, config.safety.mode_timeout, config.safety.finger_timeout,
          config.safety.min_hand_confidence};
}

/// A link over one baton; `service` may be empty.
template <class Driver, class Info>
Link make_link(const char* name, Baton<Driver, Info>& baton, std::function<Status()> service) {
  Link link;
  link.name = name;
  link.with_links = [&baton] { return baton.with_links(); };
  link.connect = [&baton]() -> Result<std::string> {
    const Result<Info> info = baton.driver().connect();
    if (!info) return info.error();
    (void)baton.take_revoked();
    baton.pass_to_loop(*info);
    return std::string(info->peer.view());
  };
  link.service = std::move(service);
  link.revoke = [&baton] { baton.revoke(); };
  link.reason = [&baton] { return std::string(baton.driver().reason()); };
  return link;
}

}  // namespace

Result<std::unique_ptr<Daemon>> Daemon::create(const config::EmbodyConfig& config) {
  for (const auto& [key, name, known] :
       {std::tuple{"arm", &config.arm.driver, "ur_rtde"}, {"hand", &config.hand.driver, "mia"}}) {
    if (*name == known) continue;
    return make_error(Errc::kInvalidArgument, "[%s] driver = \"%s\" is unknown; this version has \"%s\"", key,
                      name->c_str(), known);
  }
  if (const Status fits = check_hand(config); !fits) return fits.error();
  Result<Models> models = make_models(config);
  if (!models) return models.error();
  embody::DdsConfig dds;
  dds.enabled = config.dds.enabled;
  dds.domain = config.dds.domain;
  dds.interface = config.dds.interface;
  dds.networks = config.dds.networks;
  dds.side = kSideNames[static_cast<std::size_t>(config.subject.side)];
  Result<DdsPublisher> publisher = DdsPublisher::create(dds);
  if (!publisher) return publisher.error();
  return std::unique_ptr<Daemon>(new Daemon(config, *models, make_tracker(config), make_arm(config.arm),
                                            make_hand(config.hand), std::move(*publisher)));
}

Daemon::Daemon(const config::EmbodyConfig& config, const Models& models, std::unique_ptr<HandTracker> tracker,
               std::unique_ptr<ArmDriver> arm, std::unique_ptr<HandDriver> hand, DdsPublisher publisher)
    : config_(config),
      tracker_(std::move(tracker)),
      arm_(std::move(arm)),
      hand_(std::move(hand)),
      tracker_baton_(*tracker_),
      arm_baton_(*arm_),
      hand_baton_(*hand_),
      tracker_loop_(tracker_baton_, models.hand_pose, models.monitor, models.predictor, edges_),
      finger_loop_(models.fingers, models.filter, models.embodiment,
                   SlowDown{config.record_mapping.slow_down, config.record_mapping.slow_down_spins}, edges_),
      arm_loop_(arm_baton_, tracker_baton_, models.arm, mode_config(config.safety), arm_loop_config(config), edges_),
      hand_loop_(hand_baton_, hand_gate_config(config), {from_seconds(1.0 / config.hand.rate_hz)}, edges_),
      watchdog_loop_(arm_baton_, edges_),
      telemetry_(std::make_unique<TelemetryLoop>(edges_, std::move(publisher), models.embodiment, models.glove,
                                                 models.arm.geometry)),
      links_(std::make_unique<LinksLoop>(
          make_links(), embody::LinksConfig{config.links.retry_first, config.links.retry_longest}, edges_)) {}

Daemon::~Daemon() {
  stop();
}

std::vector<Link> Daemon::make_links() {
  std::vector<Link> links;
  links.push_back(make_link("tracker", tracker_baton_, [this] { return tracker_->service(); }));
  links.push_back(make_link("arm", arm_baton_, {}));
  links.push_back(make_link("hand", hand_baton_, {}));
  return links;
}

ThreadOptions Daemon::options(const char* name, int priority, const std::vector<int>& cpus) const {
  return {name, realtime_.scheduled ? priority : 0, cpus, true};
}

/// The reference solver allocates: its thread has normal scheduling.
ThreadOptions Daemon::finger_options() const {
  const config::RealtimeConfig& realtime = config_.realtime;
  if (config_.record_mapping.solver == hand::FingerSolver::kOwn) {
    return options("fingers", realtime.priority.fingers, realtime.cpus.fingers);
  }
  spdlog::warn("record_mapping.solver = \"slsqp\" allocates memory: the finger thread runs with normal scheduling");
  return {"fingers", 0, realtime.cpus.fingers, false};
}

Status Daemon::start() {
  const config::RealtimeConfig& realtime = config_.realtime;
  if (realtime.mode != config::RealtimeMode::kOff) {
    realtime_.scheduled = may_use_fifo(realtime.priority.watchdog);
    if (!realtime_.scheduled) {
      realtime_.warning = "no real-time scheduling: raise LimitRTPRIO or 'ulimit -r', or set realtime.mode = \"off\"";
    }
    const Status locked = realtime.lock_memory ? lock_memory() : Status{};
    realtime_.locked = realtime.lock_memory && locked.ok();
    if (!locked) {
      if (!realtime_.warning.empty()) realtime_.warning += "; ";
      realtime_.warning += locked.error().detail.view();
    }
    if (!realtime_.warning.empty()) {
      if (realtime.mode == config::RealtimeMode::kEnforce) {
        return make_error(Errc::kPermission, "%s", realtime_.warning.c_str());
      }
      spdlog::warn("{}", realtime_.warning);
    }
  }
  t_start_ = now();
  running_ = true;
  const config::PriorityConfig& p = realtime.priority;
  const config::CpuConfig& cpus = realtime.cpus;
  // Consumers before producers; links last, for it connects the devices.
  if (Status s = arm_thread_.start(options("arm", p.arm, cpus.arm), [this] { arm_loop_.run(); }); !s) return s;
  if (Status s = hand_thread_.start(options("hand", p.hand, cpus.hand), [this] { hand_loop_.run(); }); !s) return s;
  if (Status s = finger_thread_.start(finger_options(), [this] { finger_loop_.run(); }); !s) return s;
  if (Status s = tracker_thread_.start(options("tracker", p.tracker, cpus.tracker), [this] { tracker_loop_.run(); });
      !s)
    return s;
  if (Status s =
          watchdog_thread_.start(options("watchdog", p.watchdog, cpus.watchdog), [this] { watchdog_loop_.run(); });
      !s)
    return s;
  if (Status s =
          telemetry_thread_.start({"telemetry", 0, {}, false}, guarded("telemetry", [this] { telemetry_->run(); }));
      !s)
    return s;
  return links_thread_.start({"links", 0, {}, false}, guarded("links", [this] { links_->run(); }));
}

std::function<void()> Daemon::guarded(const char* name, std::function<void()> body) {
  return [this, name, body = std::move(body)] {
    try {
      body();
    } catch (const std::exception& error) {
      spdlog::critical("thread {} failed: {}", name, error.what());
      edges_.failed.store(true, std::memory_order_relaxed);
    }
  };
}

bool Daemon::stop() {
  if (!running_) return true;
  running_ = false;
  request(safety::RequestKind::kShutdown);
  edges_.stop.store(true, std::memory_order_relaxed);
  finger_thread_.join();
  tracker_thread_.join();
  hand_thread_.join();
  arm_thread_.join();  // stays until the arm stands still
  watchdog_thread_.join();
  telemetry_thread_.join();
  links_thread_.join();
  return edges_.arm_still.load(std::memory_order_relaxed);
}

Decision Daemon::request(safety::RequestKind kind) {
  const TimePoint deadline = now() + std::chrono::milliseconds(200);
  const safety::Request request{kind, ++request_id_, deadline};
  edges_.requests.push(request);
  while (mode().request_id != request.id && now() < deadline) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  const safety::ModeState state = mode();
  const bool decided = state.request_id == request.id;
  return {decided, decided && state.request_accepted, state};
}

safety::ModeState Daemon::mode() {
  edges_.mode_to_main.update();
  return edges_.mode_to_main.get();
}

bool Daemon::healthy() {
  const std::uint64_t rounds = edges_.heartbeats.watchdog.load(std::memory_order_relaxed);
  const bool alive = rounds != last_watchdog_;
  last_watchdog_ = rounds;
  return alive && !edges_.watchdog_bit.load(std::memory_order_relaxed);
}

}  // namespace embody
