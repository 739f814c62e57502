#include "drivers/capture/can_replay.hpp"

#include <linux/can.h>
#include <linux/sockios.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <map>

#include "drivers/capture/can_listener.hpp"
#include "drivers/capture/isotp_messages.hpp"
#include "drivers/transport/can_double.hpp"

namespace embody::capture {
namespace {

constexpr timespec kReaderPoll{0, 20'000};  // nothing tells when the driver has read
constexpr timespec kIdlePoll{0, 50'000'000};
constexpr std::size_t kIdBytes = 4;

using Bytes = std::vector<std::byte>;

std::string identifier(const Bytes& chunk) {
  return {reinterpret_cast<const char*>(chunk.data()), kIdBytes};
}

/// A chunk as a message of the double.
Bytes message_of(const Bytes& chunk, CanReplayAs as) {
  if (as == CanReplayAs::kIsoTpMessages) return {chunk.begin() + kIdBytes, chunk.end()};
  const auto frame = frame_of(chunk);
  if (!frame) return {};
  can_frame raw{};
  raw.can_id = frame->id.value | (frame->id.extended ? CAN_EFF_FLAG : 0u);
  raw.can_dlc = frame->size;
  std::copy_n(frame->data.begin(), frame->size, raw.data);
  const auto bytes = std::as_bytes(std::span(&raw, 1));
  return {bytes.begin(), bytes.end()};
}

}  // namespace

/// What is played over one connection.
class CanReplay::Script {
 public:
  Script(transport::UniqueFd fd, const CanReplay& replay)
      : fd_(std::move(fd)), chunks_(replay.capture_.chunks), as_(replay.as_) {
    for (const Chunk& chunk : chunks_) {
      if (chunk.event != Event::kOut) continue;
      sent_by_host_[identifier(chunk.bytes)].recorded.push_back(message_of(chunk.bytes, as_));
    }
    for (const transport::CanId id : replay.unawaited_) {
      const auto found = sent_by_host_.find(identifier(bytes_of({id, 0, {}, {}})));
      if (found != sent_by_host_.end()) found->second.awaited = false;
    }
  }

  [[nodiscard]] int fd() const noexcept { return fd_.get(); }
  [[nodiscard]] bool over() const noexcept { return over_; }
  [[nodiscard]] bool waits_for_reader() const noexcept { return waits_for_reader_; }

  /// Takes what the driver has sent, then plays on as far as possible without waiting.
  void serve(ReplayReport& report) {
    take(report);
    waits_for_reader_ = false;
    while (fd_ && !over_) {
      int unread = 0;
      if (::ioctl(fd_.get(), SIOCOUTQ, &unread) == 0 && unread > 0) {
        waits_for_reader_ = true;
        return;
      }
      over_ = at_ == chunks_.size();
      if (over_ || !play(chunks_[at_], report)) return;
      ++at_;
    }
  }

 private:
  struct Sent {
    std::vector<Bytes> recorded;
    std::size_t received{0};
    std::size_t due{0};  ///< of the recorded ones, before at_
    bool awaited{true};
  };

  /// False: not yet.
  bool play(const Chunk& chunk, ReplayReport& report) {
    if (chunk.event == Event::kOut) {
      Sent& sent = sent_by_host_[identifier(chunk.bytes)];
      if (sent.awaited && sent.received <= sent.due) return false;
      ++sent.due;
    } else if (chunk.event == Event::kClose && chunk.by == End::kDevice) {
      over_ = true;
      fd_.reset();
    } else if (chunk.event == Event::kIn) {
      const Bytes message = message_of(chunk.bytes, as_);
      if (::send(fd_.get(), message.data(), message.size(), MSG_DONTWAIT | MSG_NOSIGNAL) < 0) {
        return errno != EAGAIN && errno != EINTR;  // a driver that is gone misses the rest
      }
      ++report.sent;
    }
    return true;
  }

  void take(ReplayReport& report) {
    Bytes buffer(kMaxChunkBytes);
    while (fd_) {
      const ssize_t size = ::recv(fd_.get(), buffer.data(), buffer.size(), MSG_DONTWAIT);
      if (size <= 0) {
        if (size == 0 || (errno != EAGAIN && errno != EINTR)) fd_.reset();  // the driver has gone
        return;
      }
      count({buffer.begin(), buffer.begin() + size}, report);
    }
  }

  void count(const Bytes& message, ReplayReport& report) {
    ++report.received;
    Sent* sent = sender_of(message);
    if (sent == nullptr || sent->received >= sent->recorded.size()) {
      ++report.unexpected;
    } else if (message != sent->recorded[sent->received]) {
      ++report.different;
    }
    if (sent != nullptr) ++sent->received;
  }

  /// Where a message of the driver belongs: the double's whole messages have no identifier, and a tunnel one of the
  /// host only.
  Sent* sender_of(const Bytes& message) {
    if (as_ == CanReplayAs::kIsoTpMessages) return sent_by_host_.empty() ? nullptr : &sent_by_host_.begin()->second;
    can_frame raw{};
    if (message.size() != sizeof raw) return nullptr;
    std::memcpy(&raw, message.data(), sizeof raw);
    const bool extended = (raw.can_id & CAN_EFF_FLAG) != 0;
    const transport::CanId id{raw.can_id & (extended ? CAN_EFF_MASK : CAN_SFF_MASK), extended};
    const auto found = sent_by_host_.find(identifier(bytes_of({id, 0, {}, {}})));
    return found == sent_by_host_.end() ? nullptr : &found->second;
  }

  transport::UniqueFd fd_;
  const std::vector<Chunk>& chunks_;
  const CanReplayAs as_;
  std::map<std::string, Sent> sent_by_host_;  // by identifier
  std::size_t at_{0};                         // chunk to play
  bool over_{false};
  bool waits_for_reader_{false};
};

CanReplay::CanReplay(Capture capture, CanReplayAs as, std::vector<transport::CanId> unawaited)
    : capture_(std::move(capture)), as_(as), unawaited_(std::move(unawaited)) {}

CanReplay::~CanReplay() {
  thread_.stop();
  std::error_code ignored;
  if (!folder_.empty()) std::filesystem::remove_all(folder_, ignored);
}

Status CanReplay::start() {
  if (capture_.header.link != LinkKind::kCan) {
    return make_error(Errc::kUnsupported, "a capture of %s is not one of CAN",
                      kLinkKindNames[static_cast<std::size_t>(capture_.header.link)]);
  }
  if (as_ == CanReplayAs::kIsoTpMessages) {
    auto joined = join_isotp(capture_);
    if (!joined) return joined.error();
    capture_ = std::move(*joined);
  }
  if (capture_.chunks.empty()) return make_error(Errc::kInvalidArgument, "nothing to replay: the capture is empty");
  for (const Chunk& chunk : capture_.chunks) {
    if (chunk.connection == 1) continue;
    return make_error(Errc::kInvalidArgument, "a capture of CAN has one connection; this one has more");
  }
  std::string pattern = std::filesystem::temp_directory_path() / "embody-replay-XXXXXX";
  if (::mkdtemp(pattern.data()) == nullptr) {
    return make_error(Errc::kIo, "cannot create '%.150s': %s", pattern.c_str(), std::strerror(errno));
  }
  folder_ = pattern;
  auto listener = transport::double_listen(folder_ + "/can");
  if (!listener) return listener.error();
  listener_ = std::move(*listener);
  thread_.start([this] { run(); });
  return {};
}

void CanReplay::run() {
  while (true) {
    timespec timeout = kIdlePoll;
    int fd = -1;
    {
      const std::scoped_lock lock(mutex_);
      if (script_) script_->serve(report_);
      if (script_ && script_->waits_for_reader()) timeout = kReaderPoll;
      if (script_) fd = script_->fd();
    }
    pollfd polled[3] = {{thread_.stop_fd(), POLLIN, 0}, {listener_.get(), POLLIN, 0}, {fd, POLLIN, 0}};
    if (::ppoll(polled, 3, &timeout, nullptr) < 0) continue;  // a signal
    if (polled[0].revents != 0) return;
    if (polled[1].revents != 0) accept();
  }
}

void CanReplay::accept() {
  transport::UniqueFd fd = transport::double_accept(listener_.get());
  if (!fd) return;
  const std::scoped_lock lock(mutex_);
  if (script_) {
    ++report_.refused;
    return;
  }
  ++report_.connections;
  script_ = std::make_unique<Script>(std::move(fd), *this);
}

bool CanReplay::finished() {
  const std::scoped_lock lock(mutex_);
  if (script_) script_->serve(report_);
  return script_ && script_->over();
}

ReplayReport CanReplay::report() {
  const std::scoped_lock lock(mutex_);
  return report_;
}

}  // namespace embody::capture
