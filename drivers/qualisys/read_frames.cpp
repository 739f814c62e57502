// The real-time half of the tracker: packets to frames, on the tracker loop.
#include <algorithm>
#include <utility>

#include "drivers/qualisys/event_rules.hpp"
#include "drivers/qualisys/tracker_session.hpp"

namespace embody::qualisys {
namespace {

constexpr int kReceivesPerRead = 64;
constexpr int kReceivesCatchingUp = 4096;               // 4 s of datagrams at 1,000 Hz: a few ms of work
constexpr std::uint64_t kMostIncomplete = 200;          // frames in a row: the component does not come at all
constexpr Duration kTooLate = std::chrono::seconds(1);  // for as long: a connection that never catches up

}  // namespace

IoStatus QualisysTracker::read(MarkerFrame& frame) noexcept {
  if (!session_ || session_->over) return IoStatus::kDisconnected;
  auto& session = *session_;
  if (session.stop_requested.load(std::memory_order_acquire)) {
    end_session(make_error(Errc::kDisconnected, "the upkeep of the session with QTM failed"));
    return IoStatus::kDisconnected;
  }
  session.source.restock(kReceivesPerRead);
  const TimePoint t_read = transport::now();
  std::uint64_t waiting = 0;  // frames that were decoded and are left out as soon as a newer one is found
  auto taken = Taken::kNothing;
  while (taken != Taken::kEnd) {
    const auto packet = session.source.next();
    if (!packet) {
      taken = end_session(packet.error());
      break;
    }
    if (packet->empty()) break;
    taken = take_packet(*packet, frame);
    if (taken != Taken::kFrame) continue;
    ++waiting;
    const bool was_catching_up = session.catching_up;
    if (!is_backlog(std::max(t_read, frame.t_arrival) - frame.t_capture)) break;
    if (!was_catching_up) session.source.restock(kReceivesCatchingUp);
  }
  count_session();
  if (taken == Taken::kEnd) return IoStatus::kDisconnected;
  if (waiting == 0) return IoStatus::kEmpty;
  return deliver(frame, waiting);
}

/// A frame is older than `backlog_limit`: look for newer ones until one is younger than two periods or none is left.
bool QualisysTracker::is_backlog(Duration age) noexcept {
  if (age > config_.backlog_limit) session_->catching_up = true;
  if (age <= session_->two_periods) session_->catching_up = false;
  return session_->catching_up;
}

IoStatus QualisysTracker::deliver(const MarkerFrame& frame, std::uint64_t waiting) noexcept {
  auto& session = *session_;
  session.catching_up = false;
  ++counters_.frames;
  counters_.skipped += waiting - 1;
  if (waiting > 1) ++counters_.drains;
  if (frame.t_arrival - frame.t_capture <= kTooLate) {
    session.t_late = {};
  } else if (session.t_late == TimePoint{}) {
    session.t_late = frame.t_arrival;
  } else if (frame.t_arrival - session.t_late > kTooLate) {
    end_session(make_error(Errc::kTimeout, "frames of QTM have come more than 1 s late for 1 s; is the network busy?"));
    return IoStatus::kDisconnected;
  }
  return IoStatus::kDone;
}

QualisysTracker::Taken QualisysTracker::take_packet(std::span<const std::byte> packet, MarkerFrame& frame) noexcept {
  auto& session = *session_;
  const auto order = session.source.order();
  switch (decode_header(packet, order)->type) {
    case PacketType::kData:
      return take_data(packet, frame);
    case PacketType::kEvent:
      return take_event(packet);
    case PacketType::kNoMoreData:
      session.flow.idle.store(true, std::memory_order_relaxed);
      return Taken::kNothing;
    case PacketType::kError: {
      const auto text = decode_text(packet, order);
      if (!text) return end_session(text.error());
      return end_session(make_error(Errc::kRefused, "QTM refuses to stream: %.*s",
                                    static_cast<int>(std::min<std::size_t>(text->size(), 80)), text->data()));
    }
    default:
      ++counters_.other_packets;
      return Taken::kNothing;
  }
}

QualisysTracker::Taken QualisysTracker::take_event(std::span<const std::byte> packet) noexcept {
  const auto event = decode_event(packet, session_->source.order());
  if (!event) return end_session(event.error());
  const auto effect = effect_of(*event, config_.allow_playback);
  if (effect == EventEffect::kEnd) return end_session(make_error(Errc::kRefused, "QTM %s", describe(*event)));
  if (effect == EventEffect::kDoubt) {
    ++counters_.doubtful_events;
    begin_label_epoch();
  }
  return Taken::kNothing;
}

QualisysTracker::Taken QualisysTracker::take_data(std::span<const std::byte> packet, MarkerFrame& frame) noexcept {
  auto& session = *session_;
  if (const auto status = decode_data(packet, session.data, session.source.order()); !status) {
    const bool stray = session.source.is_udp() && status.error().code == Errc::kMalformed;
    if (!stray) return end_session(status.error());
    session.source.count_malformed();
    return Taken::kNothing;
  }
  const TimePoint t_arrival = session.source.t_received();
  session.flow.any_data.store(true, std::memory_order_relaxed);
  session.flow.idle.store(false, std::memory_order_relaxed);
  const auto restarts = session.assembler.restarts();
  const auto assembly = session.assembler.step(session.data, t_arrival);
  if (session.assembler.restarts() != restarts) {
    begin_label_epoch();
    session.last_number = 0;
  }
  if (assembly == Assembly::kWhole) {
    session.flow.t_frame_ns.store(t_arrival.time_since_epoch().count(), std::memory_order_relaxed);
    return fill(session.assembler.frame(), frame);
  }
  if (session.assembler.incomplete_run() < kMostIncomplete) return Taken::kNothing;
  return end_session(make_error(Errc::kRefused, "QTM sends frames without %s; switch on that part of its processing",
                                wanted_.rigid_body.empty() ? "3D markers" : "3D markers or 6D bodies"));
}

QualisysTracker::Taken QualisysTracker::fill(const DataPacket& data, MarkerFrame& frame) noexcept {
  auto& session = *session_;
  const DataMap& map = session.map;
  if (data.markers.size() != map.labels) {
    return end_session(make_error(Errc::kRefused, "QTM sends %zu markers but lists %zu labels; its labels changed",
                                  data.markers.size(), map.labels));
  }
  frame.body = {};
  if (map.body != DataMap::kNone) {
    const bool all = data.bodies.size() == map.bodies;
    if (!all && data.bodies.size() != map.enabled_bodies) {
      return end_session(make_error(Errc::kRefused, "QTM sends %zu rigid bodies but lists %zu; its bodies changed",
                                    data.bodies.size(), map.bodies));
    }
    frame.body = data.bodies[all ? map.body : map.body_among_enabled];
  }
  count_missing(data.frame_number);
  frame.frame_number = data.frame_number;
  frame.label_epoch = label_epoch_;
  frame.t_arrival = session.source.t_received();
  frame.t_capture =
      session.clock.map(std::chrono::microseconds(static_cast<std::int64_t>(data.timestamp_us)), frame.t_arrival);
  frame.count = wanted_.markers.size();
  for (std::size_t slot = 0; slot < frame.count; ++slot) {
    const std::size_t label = map.label_of_slot[slot];
    frame.markers[slot] = label == DataMap::kNone ? Marker{} : data.markers[label];
  }
  return Taken::kFrame;
}

void QualisysTracker::begin_label_epoch() noexcept {
  ++label_epoch_;
  ++counters_.label_epochs;
}

/// QTM's frame number may stand still, go back or leap (a new measurement): only a short gap is frames that are
/// missing.
void QualisysTracker::count_missing(std::uint64_t frame_number) noexcept {
  constexpr std::uint64_t kLongestGap = 10'000;
  const std::uint64_t last = std::exchange(session_->last_number, frame_number);
  if (last == 0 || frame_number <= last || frame_number - last > kLongestGap) return;
  counters_.missing += frame_number - last - 1;
}

/// Adds what the parts of the connection count by themselves.
void QualisysTracker::count_session() noexcept {
  const Session& session = *session_;
  counters_.useless = before_.useless + session.assembler.useless();
  counters_.incomplete = before_.incomplete + session.assembler.incomplete();
  counters_.foreign = before_.foreign + session.source.foreign();
  counters_.malformed = before_.malformed + session.source.malformed();
  counters_.clock_restarts = before_.clock_restarts + session.assembler.restarts();
}

QualisysTracker::Taken QualisysTracker::end_session(const Error& error) noexcept {
  session_->over = true;
  reason_ = error.detail;
  return Taken::kEnd;
}

}  // namespace embody::qualisys
