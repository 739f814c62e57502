#include "drivers/qualisys/qualisys_tracker.hpp"

#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <utility>

#include "core/base/names.hpp"
#include "core/teleop/clock_map.hpp"
#include "drivers/qualisys/parameters.hpp"
#include "drivers/qualisys/rt_connection.hpp"
#include "drivers/transport/clock.hpp"
#include "drivers/transport/tcp.hpp"

namespace embody::qualisys {
namespace {

constexpr Duration kConnectBudget = std::chrono::seconds(5);
constexpr std::size_t kStreamBuffer = std::size_t{64} << 10;
constexpr int kReceivesPerRead = 4;

/// kInvalidArgument unless `names` fit into a MarkerFrame and are distinct.
Status check_names(const std::vector<std::string>& names) {
  if (names.empty() || names.size() > kMaxMarkers) {
    return make_error(Errc::kInvalidArgument, "a glove layout has 1 to %zu markers, not %zu", kMaxMarkers,
                      names.size());
  }
  for (auto name = names.begin(); name != names.end(); ++name) {
    if (std::find(names.begin(), name, *name) == name) continue;
    return make_error(Errc::kInvalidArgument, "the glove layout names the marker '%.100s' twice", name->c_str());
  }
  return {};
}

Status check_setup(const Parameters& parameters, const std::vector<std::string>& names) {
  if (parameters.calibration_time.empty()) {
    return make_error(Errc::kRefused, "QTM is not calibrated; calibrate the cameras in QTM, then try again");
  }
  if (parameters.axis_upwards != "+Z") {
    return make_error(Errc::kRefused, "QTM's upward axis is '%.20s', it must be '+Z'; change it in QTM's calibration",
                      parameters.axis_upwards.c_str());
  }
  const auto missing = describe_missing(names, parameters.labels, 150);
  if (missing.empty()) return {};
  return make_error(Errc::kNotFound, "QTM has no marker(s) %s; name them in QTM or choose another glove",
                    missing.c_str());
}

Result<Parameters> ask_parameters(RtConnection& control, std::string_view command, TimePoint deadline) {
  const auto xml = control.ask(command, PacketType::kXml, deadline);
  if (!xml && xml.error().code == Errc::kRefused) {
    return make_error(Errc::kRefused, "%s; start a measurement in QTM", xml.error().detail.c_str());
  }
  if (!xml) return xml.error();
  return parse_parameters(*xml);
}

/// What differs between two valid parameter sets, as one sentence; success when nothing that matters does.
Status check_unchanged(const Parameters& before, const Parameters& now) {
  const auto [old_label, new_label] =
      std::mismatch(before.labels.begin(), before.labels.end(), now.labels.begin(), now.labels.end());
  if (old_label != before.labels.end() || new_label != now.labels.end()) {
    const char* was = old_label == before.labels.end() ? "(none)" : old_label->c_str();
    const char* is = new_label == now.labels.end() ? "(none)" : new_label->c_str();
    return make_error(Errc::kRefused, "QTM's label %td changed from '%.60s' to '%.60s' (%zu labels before, %zu now)",
                      old_label - before.labels.begin() + 1, was, is, before.labels.size(), now.labels.size());
  }
  if (before.axis_upwards != now.axis_upwards) {
    return make_error(Errc::kRefused, "QTM's upward axis changed to '%.20s'", now.axis_upwards.c_str());
  }
  if (before.calibration_time != now.calibration_time) {
    return make_error(Errc::kRefused, "QTM's calibration changed from '%.40s' to '%.40s'",
                      before.calibration_time.c_str(), now.calibration_time.c_str());
  }
  return {};
}

Error playback_refused() noexcept {
  return make_error(Errc::kRefused,
                    "QTM plays back a recording; measure live, or allow playback in the tracker's configuration");
}

}  // namespace

struct QualisysTracker::Session {
  Session(RtConnection stream_connection, RtConnection control_connection, Parameters valid_parameters)
      : stream(std::move(stream_connection)),
        control(std::move(control_connection)),
        parameters(std::move(valid_parameters)) {}

  RtConnection stream;   // read()
  RtConnection control;  // service()
  const Parameters parameters;
  std::array<std::size_t, kMaxMarkers> label_of_slot{};
  std::atomic<bool> stop_requested{false};  // service() -> read()

  bool over{false};  // read() only, like all below
  TimePoint t_received{};
  DataPacket data;
  teleop::ClockMap clock;
};

QualisysTracker::QualisysTracker(QualisysConfig config, std::vector<std::string> marker_names)
    : config_(std::move(config)), marker_names_(std::move(marker_names)) {}

QualisysTracker::~QualisysTracker() = default;

Result<TrackerInfo> QualisysTracker::connect() {
  session_.reset();
  reason_ = {};
  if (const auto status = check_names(marker_names_); !status) return status.error();
  const auto end = transport::now() + kConnectBudget;
  const auto soon = [&] { return std::min(end, transport::now() + config_.reply_timeout); };

  auto stream = RtConnection::open(config_.host, config_.port, kStreamBuffer, soon());
  if (!stream) return stream.error();
  auto control = RtConnection::open(config_.host, config_.port, kMaxParametersSize + kHeaderSize + 1, soon());
  if (!control) return control.error();
  auto parameters = ask_parameters(*control, "GetParameters General 3D", soon());
  if (!parameters) return parameters.error();
  if (const auto status = check_setup(*parameters, marker_names_); !status) return status.error();
  if (parameters->frequency_hz <= 0.0) return make_error(Errc::kMalformed, "QTM does not tell its capture rate");
  const auto state = control->ask_state(soon());
  if (!state) return state.error();
  const bool playback = *state == Event::kPlaybackStarted;
  if (playback && !config_.allow_playback) return playback_refused();
  if (const auto status = stream->send("StreamFrames AllFrames 3D", soon()); !status) return status.error();

  session_ = std::make_unique<Session>(std::move(*stream), std::move(*control), std::move(*parameters));
  const auto& labels = session_->parameters.labels;
  for (std::size_t slot = 0; slot < marker_names_.size(); ++slot) {
    const auto label = std::find(labels.begin(), labels.end(), marker_names_[slot]);
    session_->label_of_slot[slot] = static_cast<std::size_t>(label - labels.begin());
  }
  ++label_epoch_;
  const std::string peer = "QTM at " + config_.host + ":" + std::to_string(config_.port);
  return TrackerInfo{session_->stream.fd(), session_->parameters.frequency_hz, playback, std::string_view(peer)};
}

Status QualisysTracker::service() {
  if (!session_) return make_error(Errc::kDisconnected, "there is no session with QTM");
  const auto parameters =
      ask_parameters(session_->control, "GetParameters 3D", transport::now() + config_.reply_timeout);
  const auto status = parameters ? check_unchanged(session_->parameters, *parameters) : Status(parameters.error());
  if (!status) {
    session_->stop_requested.store(true, std::memory_order_release);
    ::shutdown(session_->stream.fd(), SHUT_RDWR);  // wakes the reader
  }
  return status;
}

IoStatus QualisysTracker::read(MarkerFrame& frame) noexcept {
  if (!session_ || session_->over) return IoStatus::kDisconnected;
  if (session_->stop_requested.load(std::memory_order_acquire)) {
    return end_session(make_error(Errc::kDisconnected, "the upkeep of the session with QTM failed"));
  }
  auto& input = session_->stream.input();
  for (int receives = 0; true;) {
    const auto packet = input.next();
    if (!packet) return end_session(packet.error());
    if (!packet->empty()) {
      const IoStatus status = take_packet(*packet, frame);
      if (status != IoStatus::kEmpty) return status;
      continue;
    }
    // Here no whole packet is left, so that whatever completes one is the next receive.
    if (receives++ == kReceivesPerRead) return IoStatus::kEmpty;
    const auto received = transport::receive(session_->stream.fd(), input.free_space());
    session_->t_received = transport::now();
    if (received.status == IoStatus::kEmpty) return IoStatus::kEmpty;
    if (received.status == IoStatus::kDisconnected) {
      return end_session(make_error(Errc::kDisconnected, "QTM closed the connection"));
    }
    input.commit(received.size);
  }
}

/// kDone when `frame` is new, kEmpty when the packet carries none.
IoStatus QualisysTracker::take_packet(std::span<const std::byte> packet, MarkerFrame& frame) noexcept {
  const auto type = decode_header(packet)->type;
  if (type == PacketType::kData) return take_data(packet, frame);
  if (type == PacketType::kEvent) {
    const auto event = decode_event(packet);
    if (!event) return end_session(event.error());
    if (*event == Event::kPlaybackStarted && !config_.allow_playback) return end_session(playback_refused());
  }
  if (type == PacketType::kError) {
    const auto text = decode_text(packet);
    if (!text) return end_session(text.error());
    return end_session(make_error(Errc::kRefused, "QTM refuses to stream: %.*s",
                                  static_cast<int>(std::min<std::size_t>(text->size(), 80)), text->data()));
  }
  return IoStatus::kEmpty;
}

IoStatus QualisysTracker::take_data(std::span<const std::byte> packet, MarkerFrame& frame) noexcept {
  auto& data = session_->data;
  if (const auto status = decode_data(packet, data); !status) return end_session(status.error());
  if (!data.has_markers) return IoStatus::kEmpty;
  const std::size_t labels = session_->parameters.labels.size();
  if (data.markers.size() != labels) {
    return end_session(make_error(Errc::kRefused, "QTM sends %zu markers but lists %zu labels; its labels changed",
                                  data.markers.size(), labels));
  }
  frame.frame_number = data.frame_number;
  frame.label_epoch = label_epoch_;
  frame.t_arrival = session_->t_received;
  frame.t_capture =
      session_->clock.map(std::chrono::microseconds(static_cast<std::int64_t>(data.timestamp_us)), frame.t_arrival);
  frame.count = marker_names_.size();
  for (std::size_t slot = 0; slot < frame.count; ++slot) {
    frame.markers[slot] = data.markers[session_->label_of_slot[slot]];
  }
  return IoStatus::kDone;
}

IoStatus QualisysTracker::end_session(const Error& error) noexcept {
  session_->over = true;
  reason_ = error.detail;
  return IoStatus::kDisconnected;
}

}  // namespace embody::qualisys
