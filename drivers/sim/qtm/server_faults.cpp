// The faults of a running simulated QTM, live and by script.
#include <utility>

#include "drivers/sim/qtm/server_loop.hpp"
#include "drivers/transport/clock.hpp"

namespace embody::sim {

Status QtmServer::Loop::fault(const Fault& fault) {
  const std::lock_guard lock(mutex_);
  if (!running_) return make_error(Errc::kRefused, "the simulated QTM has not been started");
  const Status status =
      Studio::handles(fault.kind) ? running_->studio.act(fault, transport::now()) : act_on_connections(fault);
  wake();
  return status;
}

Status QtmServer::Loop::act_on_connections(const Fault& fault) {
  switch (fault.kind) {
    case FaultKind::kKill:
      ports_.close();
      [[fallthrough]];
    case FaultKind::kDisconnect:
      for (auto& client : clients_) client->close();
      return {};
    case FaultKind::kRestart:
      return ports_.open(config_);
    case FaultKind::kHalfOpen:
      link_faults_.silent = fault.on;
      return {};
    case FaultKind::kEventStorm:
      event_storm_ = fault.on;
      return {};
    case FaultKind::kEvent:
      tell({{}, false, {static_cast<QtmEvent>(static_cast<int>(fault.value))}});
      return {};
    case FaultKind::kSplitUdp:
      link_faults_.split_udp = fault.on;
      return {};
    case FaultKind::kReorderUdp:
      link_faults_.reorder_udp = fault.on;
      return {};
    case FaultKind::kDuplicateUdp:
      link_faults_.duplicate_udp = fault.on;
      return {};
    default:
      return make_error(Errc::kUnsupported, "this fault cannot be made here");
  }
}

Status QtmServer::Loop::set_script(std::string_view text) {
  const std::lock_guard lock(mutex_);
  if (!running_) return make_error(Errc::kRefused, "the simulated QTM has not been started");
  auto script = parse_fault_script(text, running_->studio.motion().rate_hz);
  if (!script) return script.error();
  if (Status status = running_->studio.check(*script); !status) return status;
  script_ = std::move(*script);
  const std::size_t tick = running_->studio.measurement().running() ? running_->studio.tick() : 0;
  script_next_ = 0;
  while (script_next_ < script_.size() && script_[script_next_].frame < tick) ++script_next_;
  return {};
}

void QtmServer::Loop::apply_script() {
  while (script_next_ < script_.size() && script_[script_next_].frame <= running_->studio.tick()) {
    // Names were checked with the script; a label that is gone meanwhile has nothing left to spoil.
    const Fault& fault = script_[script_next_++].fault;
    (void)(Studio::handles(fault.kind) ? running_->studio.act(fault, transport::now()) : act_on_connections(fault));
  }
}

}  // namespace embody::sim
