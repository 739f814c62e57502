#include "daemon/app/daemon.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <thread>

#include "daemon/app/devices.hpp"
#include "daemon/app/heap_guard.hpp"
#include "drivers/mia/can_line.hpp"
#include "drivers/transport/clock.hpp"

namespace embody {
namespace {

using transport::now;

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
  safety::HandGateConfig gate{config.hand.joint_speed_rad_s, config.safety.mode_timeout, config.safety.finger_timeout,
                              config.safety.min_hand_confidence};
  gate.measured_timeout = std::max(gate.measured_timeout, from_seconds(3.0 / config.hand.rate_hz));  // a slow bus
  return gate;
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
  if (const Status fits = check_devices(config); !fits) return fits.error();
  if (config.hand.driver == config::HandDriverKind::kMia && config.hand.mia.wire != config::MiaWire::kSerial) {
    spdlog::warn("hand: {}", mia::kCanProfileNotice);
  }
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
                                            make_hand(config), std::move(*publisher)));
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
  links.push_back(make_link("arm", arm_baton_, [this] { return arm_->service(); }));
  links.back().service_ends_session = false;  // the robot waits for its operator: that is for people to see
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

/// DDS takes locks and memory when it sends: the hand's thread then has normal scheduling.
ThreadOptions Daemon::hand_options() const {
  const config::RealtimeConfig& realtime = config_.realtime;
  if (config_.hand.driver == config::HandDriverKind::kJointState) return {"hand", 0, realtime.cpus.hand, false};
  return options("hand", realtime.priority.hand, realtime.cpus.hand);
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
  if (Status s = hand_thread_.start(hand_options(), [this] { hand_loop_.run(); }); !s) return s;
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
