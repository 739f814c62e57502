#include "daemon/simlab/landmark_sender.hpp"

#include <poll.h>

#include <algorithm>
#include <chrono>

#include "drivers/transport/clock.hpp"
#include "drivers/transport/tcp.hpp"
#include "drivers/transport/udp.hpp"

namespace embody::sim {
namespace {

/// Sleeps until `t`; false when a signal came first.
bool wait_until(TimePoint t, StopSignals& signals) {
  while (signals.take() == 0) {
    const Duration left = t - transport::now();
    if (left <= Duration{0}) return true;
    pollfd entry{signals.fd(), POLLIN, 0};
    const timespec wait{left.count() / 1'000'000'000, left.count() % 1'000'000'000};
    ::ppoll(&entry, 1, &wait, nullptr);
  }
  return false;
}

std::int64_t wall_time_ns() {
  return std::chrono::duration_cast<Duration>(std::chrono::system_clock::now().time_since_epoch()).count();
}

}  // namespace

Result<LandmarkSenderReport> send_landmarks(LandmarkRecording recording, const LandmarkSenderConfig& config,
                                            StopSignals& signals) {
  const auto socket = transport::udp_connect(config.host, config.port);
  if (!socket) return socket.error();
  const Duration period = from_seconds(1.0 / config.rate_hz);
  LandmarkSenderReport report;
  TimePoint t_next = transport::now();
  do {
    for (landmarks::LandmarkFrame& frame : recording) {
      if (!wait_until(t_next, signals)) return report;
      t_next = std::max(t_next + period, transport::now() - period);  // late frames are not made up for
      frame.frame_number = ++report.sent;
      frame.t_capture_ns = wall_time_ns();
      const IoStatus status = transport::send_message(socket->get(), landmarks::encode(frame));
      if (status == IoStatus::kDisconnected) ++report.unheard;
    }
  } while (config.loop);
  return report;
}

}  // namespace embody::sim
