#include "drivers/sim/qtm/qtm_server.hpp"

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "drivers/qualisys/codec.hpp"
#include "drivers/qualisys/stream_reassembler.hpp"
#include "drivers/sim/qtm/label_faults.hpp"
#include "drivers/sim/qtm/qtm_replies.hpp"
#include "drivers/transport/clock.hpp"
#include "drivers/transport/tcp.hpp"

namespace embody::sim {
namespace {

using qualisys::Event;
using qualisys::PacketType;

constexpr std::size_t kMaxClients = 10;
constexpr std::size_t kMaxCommandSize = std::size_t{64} << 10;
constexpr int kDefaultMinorVersion = 1;  // what QTM assumes before it is told

struct Client {
  explicit Client(transport::UniqueFd socket) : fd(std::move(socket)), input(kMaxCommandSize) {}

  transport::UniqueFd fd;
  qualisys::StreamReassembler input;
  int minor_version{kDefaultMinorVersion};
  std::optional<StreamRequest> stream;
  bool dead{false};

  /// One send() per packet; a client whose buffer is full has not read for long and is dropped.
  void send(const std::vector<std::byte>& packet) {
    if (!dead && transport::send_message(fd.get(), packet) != IoStatus::kDone) close();
  }
  void send_text(PacketType type, std::string_view text) { send(qualisys::encode_text(type, text)); }
  /// The loop thread releases the descriptor.
  void close() {
    dead = true;
    ::shutdown(fd.get(), SHUT_RDWR);
  }
};

Status check_recording(const recording::Recording& recording) {
  const std::size_t markers = recording.marker_names.size();
  const bool sound = markers > 0 && markers <= qualisys::kMaxDataMarkers && !recording.frames.empty() &&
                     std::isfinite(recording.rate_hz) && recording.rate_hz > 0.0 &&
                     std::all_of(recording.frames.begin(), recording.frames.end(),
                                 [&](const auto& frame) { return frame.size() == markers; });
  if (sound) return {};
  return make_error(Errc::kInvalidArgument, "cannot serve '%.80s': it needs a rate, frames and 1 to %zu markers",
                    recording.source.c_str(), qualisys::kMaxDataMarkers);
}

}  // namespace

class QtmServer::Loop {
 public:
  Loop(QtmServerConfig config, recording::Recording recording)
      : config_(std::move(config)),
        recording_(std::move(recording)),
        setup_{recording_.rate_hz, config_.axis, config_.calibrated, recording_.marker_names},
        faults_(recording_.marker_names.size()),
        state_(config_.present_as_playback ? Event::kPlaybackStarted : Event::kConnected) {}
  Loop(const Loop&) = delete;
  Loop& operator=(const Loop&) = delete;

  ~Loop() {
    if (!thread_.joinable()) return;
    {
      const std::lock_guard lock(mutex_);
      stop_ = true;
    }
    wake();
    thread_.join();
  }

  Status start() {
    if (thread_.joinable()) return make_error(Errc::kInvalidArgument, "the simulated QTM has already been started");
    if (auto status = check_recording(recording_); !status) return status;
    auto listener = transport::tcp_listen(config_.address, config_.port);
    if (!listener) return listener.error();
    listener_ = std::move(*listener);
    port_ = transport::local_port(listener_.get());
    wake_.reset(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC));
    if (!wake_) return make_error(Errc::kIo, "cannot create an eventfd");
    log_.reserve(recording_.frames.size());
    thread_ = std::thread([this] { run(); });
    return {};
  }

  std::uint16_t port() const noexcept { return port_; }

  void play() {
    const std::lock_guard lock(mutex_);
    if (playing_ || finished_) return;
    playing_ = true;
    t_start_ = transport::now();
    change_state(config_.present_as_playback ? Event::kPlaybackStarted : Event::kCaptureStarted);
    wake();
  }

  bool has_streaming_client() const {
    const std::lock_guard lock(mutex_);
    return std::any_of(clients_.begin(), clients_.end(), [](const auto& c) { return !c->dead && c->stream; });
  }
  bool finished() const {
    const std::lock_guard lock(mutex_);
    return finished_;
  }
  std::size_t frames_sent() const {
    const std::lock_guard lock(mutex_);
    return log_.size();
  }
  std::vector<SentFrame> log() const {
    const std::lock_guard lock(mutex_);
    return log_;
  }
  void pause(Duration duration) {
    const std::lock_guard lock(mutex_);
    t_paused_until_ = transport::now() + duration;
  }
  void disconnect_clients() {
    const std::lock_guard lock(mutex_);
    for (auto& client : clients_) client->close();
    wake();
  }
  bool set_marker_hidden(std::string_view name, bool hidden) {
    const std::lock_guard lock(mutex_);
    const auto i = index_of(name);
    if (i) faults_.set_hidden(*i, hidden);
    return i.has_value();
  }
  bool swap_labels(std::string_view a, std::string_view b) {
    const std::lock_guard lock(mutex_);
    const auto i = index_of(a);
    const auto k = index_of(b);
    if (i && k) faults_.swap(*i, *k);
    return i && k;
  }
  bool set_ghost(std::string_view name, bool on) {
    const std::lock_guard lock(mutex_);
    const auto i = index_of(name);
    if (i) faults_.set_ghost(*i, on);
    return i.has_value();
  }
  bool rename_label(std::string_view from, std::string_view to) {
    const std::lock_guard lock(mutex_);
    const auto label = std::find(setup_.labels.begin(), setup_.labels.end(), from);
    if (label == setup_.labels.end()) return false;
    *label = to;
    return true;
  }

 private:
  std::optional<std::size_t> index_of(std::string_view name) const {
    const auto label = std::find(setup_.labels.begin(), setup_.labels.end(), name);
    if (label == setup_.labels.end()) return std::nullopt;
    return static_cast<std::size_t>(label - setup_.labels.begin());
  }

  void wake() noexcept { ::eventfd_write(wake_.get(), 1); }

  void run() {
    std::vector<pollfd> polled;
    while (true) {
      std::optional<TimePoint> t_next;
      {
        const std::lock_guard lock(mutex_);
        if (stop_) return;
        send_due_frames();
        std::erase_if(clients_, [](const auto& client) { return client->dead; });
        polled = {{wake_.get(), POLLIN, 0}, {listener_.get(), POLLIN, 0}};
        for (const auto& client : clients_) polled.push_back({client->fd.get(), POLLIN, 0});
        if (playing_) t_next = due(next_frame_);
      }
      wait(polled, t_next);
      const std::lock_guard lock(mutex_);
      eventfd_t ignored = 0;
      if (polled[0].revents != 0) ::eventfd_read(wake_.get(), &ignored);
      for (std::size_t i = 2; i < polled.size(); ++i) {
        if (polled[i].revents != 0) serve(*clients_[i - 2]);
      }
      if (polled[1].revents != 0) accept_client();
    }
  }

  static void wait(std::vector<pollfd>& polled, std::optional<TimePoint> deadline) {
    timespec timeout{};
    if (deadline) {
      const auto left = std::max(Duration{0}, *deadline - transport::now());
      timeout.tv_sec = static_cast<time_t>(left / std::chrono::seconds(1));
      timeout.tv_nsec = static_cast<long>((left % std::chrono::seconds(1)).count());
    }
    if (::ppoll(polled.data(), polled.size(), deadline ? &timeout : nullptr, nullptr) > 0) return;
    for (auto& entry : polled) entry.revents = 0;  // time-out or signal
  }

  TimePoint due(std::size_t frame) const {
    return t_start_ + from_seconds(static_cast<double>(frame) / recording_.rate_hz);
  }

  void send_due_frames() {
    while (playing_ && due(next_frame_) <= transport::now()) {
      if (next_frame_ == recording_.frames.size()) return finish();
      if (due(next_frame_) >= t_paused_until_) send_frame(next_frame_);
      ++next_frame_;
    }
  }

  void send_frame(std::size_t index) {
    bool logged = false;
    for (auto& client : clients_) {
      if (client->dead || !client->stream || index % client->stream->divisor != 0) continue;
      const auto packet = frame_packet(index, client->stream->components);
      if (!std::exchange(logged, true)) log_.push_back({index, transport::now()});
      client->send(packet);
    }
  }

  std::vector<std::byte> frame_packet(std::size_t index, const std::vector<qualisys::Component>& components) {
    packet_.timestamp_us =
        static_cast<std::uint64_t>(std::llround(1e6 * static_cast<double>(index) / recording_.rate_hz));
    packet_.frame_number = static_cast<std::uint32_t>(index + 1);
    packet_.markers.resize(faults_.size());
    for (std::size_t i = 0; i < faults_.size(); ++i) {
      packet_.markers[i] = faults_.measurement(i, recording_.frames[index]);
    }
    return qualisys::encode_data(packet_, components);
  }

  void finish() {
    playing_ = false;
    finished_ = true;
    for (auto& client : clients_) {
      if (client->stream) client->send(qualisys::encode_no_more_data());
    }
    change_state(config_.present_as_playback ? Event::kPlaybackStopped : Event::kCaptureStopped);
  }

  void change_state(Event event) {
    state_ = event;
    for (auto& client : clients_) client->send(qualisys::encode_event(event));
  }

  void accept_client() {
    auto client = std::make_unique<Client>(transport::tcp_accept(listener_.get()));
    if (!client->fd) return;
    if (clients_.size() >= kMaxClients) {
      client->send_text(PacketType::kError, "Connection refused. Max number of clients reached.");
      return;
    }
    client->send_text(PacketType::kCommand, "QTM RT Interface connected");
    clients_.push_back(std::move(client));
  }

  void serve(Client& client) {
    const auto received = transport::receive(client.fd.get(), client.input.free_space());
    if (received.status == IoStatus::kDisconnected) client.close();
    client.input.commit(received.size);
    while (!client.dead) {
      const auto packet = client.input.next();
      if (!packet) return client.close();
      if (packet->empty()) return;
      const auto type = qualisys::decode_header(*packet)->type;
      const auto text = qualisys::decode_text(*packet);
      if (type == PacketType::kCommand && text) {
        answer(client, *text);
      } else if (type == PacketType::kXml) {
        client.send_text(PacketType::kError, "You must be master to issue this command");
      } else {
        client.send_text(PacketType::kError, "Parse error");
      }
    }
  }

  void answer(Client& client, std::string_view command) {
    const auto words = command_words(command);
    const std::string_view verb = words.empty() ? std::string_view{} : std::string_view(words[0]);
    if (verb == "version") return answer_version(client, words);
    if (verb == "getstate") return client.send(qualisys::encode_event(state_));
    if (verb == "getparameters") return answer_parameters(client, words);
    if (verb == "streamframes") return answer_stream(client, words);
    if (verb == "getcurrentframe") return answer_current_frame(client, words);
    if (verb == "qtmversion") return client.send_text(PacketType::kCommand, "QTM Version is 2023.3 (build 13590)");
    if (verb == "byteorder") return client.send_text(PacketType::kCommand, "Byte order is little endian");
    client.send_text(PacketType::kError, "Parse error");
  }

  static void answer_version(Client& client, const std::vector<std::string>& words) {
    if (words.size() == 1) {
      return client.send_text(PacketType::kCommand, "Version is 1." + std::to_string(client.minor_version));
    }
    const auto minor = supported_minor_version(words[1]);
    if (!minor) return client.send_text(PacketType::kError, "Version NOT supported");
    client.minor_version = *minor;
    client.send_text(PacketType::kCommand, "Version set to " + words[1]);
  }

  void answer_parameters(Client& client, const std::vector<std::string>& words) {
    const auto xml = parameters_xml(words, setup_, client.minor_version);
    if (!xml) return client.send_text(PacketType::kError, "Parse error");
    client.send_text(PacketType::kXml, *xml);
  }

  void answer_stream(Client& client, const std::vector<std::string>& words) {
    if (words.size() == 2 && words[1] == "stop") return client.stream.reset();
    if (client.minor_version == kDefaultMinorVersion) {
      return client.send_text(PacketType::kError, "Version NOT supported");
    }
    auto request = parse_stream(words, recording_.rate_hz);
    if (!request) return client.send_text(PacketType::kError, "Parse error");
    client.stream = std::move(*request);
    if (!playing_) client.send(qualisys::encode_no_more_data());
  }

  void answer_current_frame(Client& client, const std::vector<std::string>& words) {
    const auto components = parse_components(words, 1);
    if (!components || client.minor_version == kDefaultMinorVersion) {
      return client.send_text(PacketType::kError, components ? "Version NOT supported" : "Parse error");
    }
    const bool available = playing_ && next_frame_ > 0;
    client.send(available ? frame_packet(next_frame_ - 1, *components) : qualisys::encode_no_more_data());
  }

  const QtmServerConfig config_;
  const recording::Recording recording_;
  transport::UniqueFd listener_;
  transport::UniqueFd wake_;
  std::uint16_t port_{0};
  std::thread thread_;

  mutable std::mutex mutex_;  // guards all below
  QtmSetup setup_;
  LabelFaults faults_;
  std::vector<std::unique_ptr<Client>> clients_;  // changed in size by the loop thread only
  Event state_;
  bool stop_{false};
  bool playing_{false};
  bool finished_{false};
  TimePoint t_start_{};
  TimePoint t_paused_until_{};
  std::size_t next_frame_{0};
  std::vector<SentFrame> log_;
  qualisys::DataPacket packet_;
};

QtmServer::QtmServer(QtmServerConfig config, recording::Recording recording)
    : loop_(std::make_unique<Loop>(std::move(config), std::move(recording))) {}
QtmServer::~QtmServer() = default;

Status QtmServer::start() {
  return loop_->start();
}
std::uint16_t QtmServer::port() const noexcept {
  return loop_->port();
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
void QtmServer::pause(Duration duration) {
  loop_->pause(duration);
}
void QtmServer::disconnect_clients() {
  loop_->disconnect_clients();
}
bool QtmServer::set_marker_hidden(std::string_view name, bool hidden) {
  return loop_->set_marker_hidden(name, hidden);
}
bool QtmServer::swap_labels(std::string_view a, std::string_view b) {
  return loop_->swap_labels(a, b);
}
bool QtmServer::set_ghost(std::string_view name, bool on) {
  return loop_->set_ghost(name, on);
}
bool QtmServer::rename_label(std::string_view from, std::string_view to) {
  return loop_->rename_label(from, to);
}

}  // namespace embody::sim
