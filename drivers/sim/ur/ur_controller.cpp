#include "drivers/sim/ur/ur_controller.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "drivers/sim/ur/controller_loop.hpp"
#include "drivers/transport/clock.hpp"

namespace embody::sim {

UrController::UrController(UrControllerConfig config) : config_(std::move(config)) {}

UrController::~UrController() {
  stop();
}

Status UrController::start() {
  stop();
  if (!(config_.frequency_hz >= 1.0 && config_.frequency_hz <= 1000.0)) {
    return make_error(Errc::kInvalidArgument, "the simulated controller's frequency is %g Hz; choose 1 to 1000",
                      config_.frequency_hz);
  }
  if (!config_.robot.q_start_rad.allFinite() || config_.log_capacity == 0) {
    return make_error(Errc::kInvalidArgument, "the simulated controller needs finite start angles and a log");
  }
  auto loop = std::make_unique<ControllerLoop>(config_);
  if (const Status listening = loop->listen(); !listening) return listening;
  const ControllerPorts ports = loop->ports();
  ports_ = {ports.rtde, ports.primary, ports.secondary, ports.realtime, ports.dashboard};
  loop_ = std::move(loop);
  log_.assign(config_.log_capacity, {});
  logged_ = 0;
  counters_ = {};
  faults_.clear();
  safety_ = loop_->robot().safety();
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
  return {};
}

void UrController::stop() noexcept {
  thread_ = {};  // asks and waits
  loop_.reset();
  has_client_ = false;
  ports_ = {};
}

UrCounters UrController::counters() const {
  const std::scoped_lock lock(mutex_);
  return counters_;
}

UrSample UrController::latest() const {
  const std::scoped_lock lock(mutex_);
  return logged_ == 0 ? UrSample{} : log_[(logged_ - 1) % log_.size()];
}

std::vector<UrSample> UrController::samples() const {
  const std::scoped_lock lock(mutex_);
  std::vector<UrSample> samples;
  const std::size_t count = std::min(logged_, log_.size());
  samples.reserve(count);
  for (std::size_t i = logged_ - count; i < logged_; ++i) samples.push_back(log_[i % log_.size()]);
  return samples;
}

SafetyStatus UrController::safety() const {
  const std::scoped_lock lock(mutex_);
  return safety_;
}

Status UrController::fault(std::string_view text) {
  auto action = parse_ur_fault(text);
  if (!action) return action.error();
  const std::scoped_lock lock(mutex_);
  faults_.push_back(std::move(*action));
  return {};
}

/// @pre `fault` is the name of one.
void UrController::post(std::string_view fault) {
  (void)this->fault(fault);
}

void UrController::run(const std::stop_token& stop) {
  constexpr std::uint64_t kMostCaughtUp = 5000;  // a suspended host does not get its hours back
  const auto period = Duration(std::llround(1e9 / config_.frequency_hz));
  const TimePoint start = transport::now();
  UrCounters counters;
  std::uint64_t done = 0;
  while (!stop.stop_requested()) {
    std::this_thread::sleep_until(start + static_cast<std::int64_t>(done + 1) * period);
    const auto due = std::max(done + 1, static_cast<std::uint64_t>((transport::now() - start) / period));
    apply_faults();
    loop_->receive(transport::now());
    const std::uint64_t first = due - std::min(due - done, kMostCaughtUp) + 1;
    for (std::uint64_t cycle = first; cycle <= due; ++cycle) {
      loop_->step(period);
      log(start + static_cast<std::int64_t>(cycle) * period, cycle);
    }
    loop_->publish(done, due);
    has_client_ = loop_->server().has_commanding_client();
    counters.cycles += due - first + 1;
    counters.late_cycles += due - done - 1;
    static_cast<RtdeCounters&>(counters) = loop_->server().shared().counters;
    done = due;
    const std::scoped_lock lock(mutex_);
    counters_ = counters;
    safety_ = loop_->robot().safety();
  }
}

void UrController::apply_faults() {
  std::vector<FaultAction> faults;
  {
    const std::scoped_lock lock(mutex_);
    faults.swap(faults_);
  }
  for (const FaultAction& fault : faults) fault(*loop_);
}

void UrController::log(TimePoint t, std::uint64_t cycle) {
  const UrRobot& robot = loop_->robot();
  const UrSample sample{t, cycle, robot.q_rad(), robot.qd_rad_s(), robot.q_target_rad(), robot.registers().state};
  const std::scoped_lock lock(mutex_);
  log_[logged_++ % log_.size()] = sample;
}

}  // namespace embody::sim
