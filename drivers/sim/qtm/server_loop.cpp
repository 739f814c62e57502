#include "drivers/sim/qtm/server_loop.hpp"

#include <sys/eventfd.h>

#include <algorithm>
#include <utility>

#include "drivers/transport/clock.hpp"

namespace embody::sim {
namespace {

constexpr std::size_t kLongestLog = 1'000'000;

void wait(std::vector<pollfd>& polled, std::optional<TimePoint> deadline) {
  timespec timeout{};
  if (deadline) {
    const auto left = std::max(Duration{0}, *deadline - transport::now());
    timeout.tv_sec = static_cast<time_t>(left / std::chrono::seconds(1));
    timeout.tv_nsec = static_cast<long>((left % std::chrono::seconds(1)).count());
  }
  if (::ppoll(polled.data(), polled.size(), deadline ? &timeout : nullptr, nullptr) > 0) return;
  for (auto& entry : polled) entry.revents = 0;  // time-out or signal
}

}  // namespace

QtmServer::Loop::~Loop() {
  if (!thread_.joinable()) return;
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
    wake();
  }
  thread_.join();
}

Status QtmServer::Loop::start() {
  const std::lock_guard lock(mutex_);
  if (running_) return {};
  auto studio = Studio::build(config_, motion_);
  if (!studio) return studio.error();
  if (Status status = ports_.open(config_); !status) return status;
  wake_.reset(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC));
  if (!wake_) return make_error(Errc::kIo, "cannot create an eventfd");
  for (std::size_t kind = 0; kind < Ports::kCount; ++kind)
    numbers_[kind] = ports_.number(static_cast<Ports::Kind>(kind));
  log_.reserve(std::min(kLongestLog, motion_.frames.value_or(0)));
  running_ = std::make_unique<Running>(config_, std::move(*studio));
  thread_ = std::thread([this] { run(); });
  return {};
}

void QtmServer::Loop::wake() noexcept {
  ::eventfd_write(wake_.get(), 1);
}

void QtmServer::Loop::run() {
  std::vector<pollfd> polled;
  while (true) {
    std::optional<TimePoint> deadline;
    {
      const std::lock_guard lock(mutex_);
      if (stop_) return;
      advance(transport::now());
      std::erase_if(clients_, [this](const auto& client) {
        if (client->dead()) running_->desk.forget(client->conversation);
        return client->dead();
      });
      polled = watched();
      deadline = next_deadline();
    }
    wait(polled, deadline);
    const std::lock_guard lock(mutex_);
    eventfd_t ignored = 0;
    if (polled[0].revents != 0) ::eventfd_read(wake_.get(), &ignored);
    if (link_faults_.silent) continue;
    for (std::size_t i = 1 + Ports::kCount; i < polled.size(); ++i) {
      if (polled[i].revents != 0) serve(*clients_[i - 1 - Ports::kCount]);
    }
    if (polled[1 + Ports::kLegacy].revents != 0) refuse_legacy_clients();
    if (polled[1 + Ports::kDiscovery].revents != 0) ports_.answer_discovery(config_.allow_remote);
    accept_clients();
  }
}

/// The wake-up, the ports in their order, the clients in theirs.
std::vector<pollfd> QtmServer::Loop::watched() const {
  std::vector<pollfd> polled{{wake_.get(), POLLIN, 0}};
  const auto watch = [&](int fd) { polled.push_back({link_faults_.silent ? -1 : fd, POLLIN, 0}); };
  for (std::size_t kind = 0; kind < Ports::kCount; ++kind) watch(ports_.fd(static_cast<Ports::Kind>(kind)));
  for (const auto& client : clients_) watch(client->fd());
  return polled;
}

std::optional<TimePoint> QtmServer::Loop::next_deadline() const {
  const auto frame = running_->studio.t_next();
  return frame ? frame : running_->studio.measurement().calibration_end();
}

void QtmServer::Loop::advance(TimePoint now) {
  if (const auto end = running_->studio.measurement().calibration_end(); end && *end <= now) end_calibration();
  send_due_frames(now);
}

void QtmServer::Loop::send_due_frames(TimePoint now) {
  Studio& studio = running_->studio;
  for (auto due = studio.t_next(); due && *due <= now; due = studio.t_next()) {
    apply_script();
    switch (studio.step()) {
      case Studio::Step::kEnded:
        return finish();
      case Studio::Step::kFrame:
        deliver_frame();
        break;
      case Studio::Step::kLost:
        break;
    }
  }
}

void QtmServer::Loop::deliver_frame() {
  const Studio& studio = running_->studio;
  const std::size_t tick = *studio.frame_tick();
  bool sent = false;
  for (auto& client : clients_) {
    Conversation& talk = client->conversation;
    if (client->dead()) continue;
    if (talk.current_frame) {
      client->last_frame = tick;
      client->send(encode_frame(studio.frame(), *std::exchange(talk.current_frame, {}), talk.order), link_faults_);
    }
    if (!talk.stream || tick % talk.stream->divisor != 0) continue;
    if (!std::exchange(sent, true) && log_.size() < kLongestLog)
      log_.push_back({studio.frame_index(), transport::now()});
    client->send_frame(studio.frame(), link_faults_);
  }
  if (sent) ++frames_sent_;
}

void QtmServer::Loop::finish() {
  finished_ = true;
  const Outcome outcome = running_->studio.measurement().end();
  end_streams();
  tell(outcome);
}

void QtmServer::Loop::end_streams() {
  for (auto& client : clients_) {
    Conversation& talk = client->conversation;
    if (talk.stream || talk.current_frame) client->send(no_more_data_packet(talk.order), link_faults_);
    talk.current_frame.reset();
  }
}

void QtmServer::Loop::end_calibration() {
  const Fault calibrated{FaultKind::kUncalibrated, {}, {}, 0.0, 0.0, /*on=*/false};
  (void)running_->studio.act(calibrated, transport::now());
  tell(running_->studio.measurement().end_calibration());
  for (auto& client : clients_) {
    if (!std::exchange(client->awaits_calibration, false)) continue;
    const int minor = client->conversation.minor_version;
    client->send(Reply{Packet::kXml, calibration_result_xml(running_->studio.setup(), minor)}, link_faults_);
  }
}

void QtmServer::Loop::tell(const Outcome& outcome) {
  for (const QtmEvent event : outcome.events) {
    for (auto& client : clients_) client->send(event, link_faults_);
  }
}

void QtmServer::Loop::play() {
  const std::lock_guard lock(mutex_);
  if (!running_ || std::exchange(played_, true)) return;
  const Outcome outcome = running_->studio.measurement().begin();
  running_->studio.start(transport::now());
  script_next_ = 0;
  tell(outcome);
  wake();
}

bool QtmServer::Loop::has_streaming_client() const {
  const std::lock_guard lock(mutex_);
  return std::any_of(clients_.begin(), clients_.end(),
                     [](const auto& c) { return !c->dead() && c->conversation.stream; });
}

bool QtmServer::Loop::finished() const {
  const std::lock_guard lock(mutex_);
  return finished_;
}

std::size_t QtmServer::Loop::frames_sent() const {
  const std::lock_guard lock(mutex_);
  return frames_sent_;
}

std::vector<SentFrame> QtmServer::Loop::log() const {
  const std::lock_guard lock(mutex_);
  return log_;
}

}  // namespace embody::sim
