#include "drivers/sim/qtm/qtm_server.hpp"

#include "drivers/sim/qtm/server_loop.hpp"

namespace embody::sim {

QtmServer::QtmServer(QtmServerConfig config, recording::Recording recording)
    : QtmServer(std::move(config), motion_of(std::move(recording))) {}
QtmServer::QtmServer(QtmServerConfig config, Motion motion)
    : loop_(std::make_unique<Loop>(std::move(config), std::move(motion))) {}
QtmServer::~QtmServer() = default;

Status QtmServer::start() {
  return loop_->start();
}
std::uint16_t QtmServer::port() const noexcept {
  return loop_->port(Ports::kLittleEndian);
}
std::uint16_t QtmServer::big_endian_port() const noexcept {
  return loop_->port(Ports::kBigEndian);
}
std::uint16_t QtmServer::legacy_port() const noexcept {
  return loop_->port(Ports::kLegacy);
}
std::uint16_t QtmServer::discovery_port() const noexcept {
  return loop_->port(Ports::kDiscovery);
}
void QtmServer::play() {
  loop_->play();
}
bool QtmServer::has_streaming_client() const {
  return loop_->has_streaming_client();
}
bool QtmServer::finished() const {
  return loop_->finished();
}
std::size_t QtmServer::frames_sent() const {
  return loop_->frames_sent();
}
std::vector<SentFrame> QtmServer::log() const {
  return loop_->log();
}

Status QtmServer::fault(std::string_view words) {
  const auto fault = parse_qtm_fault(words);
  if (!fault) return fault.error();
  return loop_->fault(*fault);
}
Status QtmServer::set_fault_script(std::string_view text) {
  return loop_->set_script(text);
}

void QtmServer::pause(Duration duration) {
  const auto milliseconds = std::chrono::ceil<std::chrono::milliseconds>(duration).count();
  (void)loop_->fault({FaultKind::kPause, {}, {}, static_cast<double>(milliseconds)});
}
void QtmServer::disconnect_clients() {
  (void)loop_->fault({FaultKind::kDisconnect});
}
bool QtmServer::set_marker_hidden(std::string_view name, bool hidden) {
  return loop_->fault({hidden ? FaultKind::kHide : FaultKind::kShow, std::string(name)}).ok();
}
bool QtmServer::swap_labels(std::string_view a, std::string_view b) {
  return loop_->fault({FaultKind::kSwap, std::string(a), std::string(b)}).ok();
}
bool QtmServer::set_ghost(std::string_view name, bool on) {
  return loop_->fault({FaultKind::kGhost, std::string(name), {}, 0.0, 0.0, on}).ok();
}
bool QtmServer::rename_label(std::string_view from, std::string_view to) {
  return loop_->fault({FaultKind::kRenameLabel, std::string(from), std::string(to)}).ok();
}

}  // namespace embody::sim
