#include "drivers/qualisys/qualisys_tracker.hpp"

#include <algorithm>
#include <utility>

#include "drivers/qualisys/event_rules.hpp"
#include "drivers/qualisys/tracker_session.hpp"
#include "drivers/transport/clock.hpp"

namespace embody::qualisys {
namespace {

constexpr Duration kConnectBudget = std::chrono::seconds(5);
constexpr std::size_t kStreamBuffer = std::size_t{64} << 10;
constexpr std::size_t kControlBuffer = kMaxParametersSize + kHeaderSize + 1;
constexpr Duration kSilence = std::chrono::seconds(3);     // of a QTM that measures, before the session is given up
constexpr Duration kNoDatagram = std::chrono::seconds(1);  // at the beginning of a session over UDP

Result<Parameters> ask_parameters(RtConnection& control, const Wanted& wanted, TimePoint deadline) {
  const char* command = wanted.rigid_body.empty() ? "GetParameters General 3D" : "GetParameters General 3D 6D";
  const auto xml = control.ask(command, PacketType::kXml, deadline);
  if (!xml && xml.error().code == Errc::kRefused) {
    return make_error(Errc::kRefused, "%s; start a measurement in QTM", xml.error().detail.c_str());
  }
  if (!xml) return xml.error();
  return parse_parameters(*xml);
}

/// Errors unless a session can begin while QTM is in this state.
Status check_state(Event state, bool allow_playback) noexcept {
  const bool busy = state == Event::kCalibrationStarted || state == Event::kReprocessingStarted;
  const bool refused_playback = state == Event::kPlaybackStarted && !allow_playback;
  if (busy || refused_playback) return make_error(Errc::kRefused, "QTM %s", describe(state));
  return {};
}

std::optional<UdpOptions> udp_options(const QualisysConfig& config) {
  if (config.transport == Transport::kTcp) return {};
  return UdpOptions{config.udp_address, config.udp_port};
}

}  // namespace

QualisysTracker::QualisysTracker(QualisysConfig config, std::vector<std::string> marker_names)
    : config_(std::move(config)), wanted_{std::move(marker_names), config_.optional_markers, config_.rigid_body} {
  show({{"frames", &counters_.frames},
        {"skipped", &counters_.skipped},
        {"drains", &counters_.drains},
        {"missing", &counters_.missing},
        {"useless", &counters_.useless},
        {"incomplete", &counters_.incomplete},
        {"foreign", &counters_.foreign},
        {"malformed", &counters_.malformed},
        {"other_packets", &counters_.other_packets},
        {"clock_restarts", &counters_.clock_restarts},
        {"doubtful_events", &counters_.doubtful_events},
        {"label_epochs", &counters_.label_epochs}});
}

QualisysTracker::~QualisysTracker() = default;

Result<TrackerInfo> QualisysTracker::connect() {
  session_.reset();
  reason_ = {};
  if (const auto status = check_names(wanted_.markers); !status) return status.error();
  const auto end = transport::now() + kConnectBudget;
  const auto soon = [&] { return std::min(end, transport::now() + config_.reply_timeout); };

  auto stream = RtConnection::open(config_.host, config_.port, kStreamBuffer, soon(), config_.byte_order);
  if (!stream) return stream.error();
  auto control = RtConnection::open(config_.host, config_.port, kControlBuffer, soon(), config_.byte_order,
                                    stream->minor_version());
  if (!control) return control.error();
  auto parameters = ask_parameters(*control, wanted_, soon());
  if (!parameters) return parameters.error();
  if (const auto status = check_setup(*parameters, wanted_); !status) return status.error();
  const auto state = control->ask_state(soon());
  if (!state) return state.error();
  if (const auto status = check_state(*state, config_.allow_playback); !status) return status.error();
  auto source = PacketSource::open(std::move(*stream), udp_options(config_));
  if (!source) return source.error();
  const char* components = wanted_.rigid_body.empty() ? "3DRes" : "3DRes 6DRes";
  if (const auto status = source->start(components, soon()); !status) return status.error();

  std::string peer = "QTM at " + config_.host + ":" + std::to_string(config_.port);
  if (const auto warning = processing_warning(*parameters, wanted_); !warning.empty()) peer += "; " + warning;
  session_ = std::make_unique<Session>(std::move(*source), std::move(*control), std::move(*parameters), wanted_);
  before_ = counters_;
  begin_label_epoch();
  const bool playback = *state == Event::kPlaybackStarted;
  return TrackerInfo{session_->source.fd(), session_->parameters.frequency_hz, playback, std::string_view(peer)};
}

Status QualisysTracker::service() {
  if (!session_) return make_error(Errc::kDisconnected, "there is no session with QTM");
  const auto status = upkeep();
  if (!status) {
    session_->stop_requested.store(true, std::memory_order_release);
    session_->source.cut();  // wakes the reader
  }
  return status;
}

Status QualisysTracker::upkeep() {
  const auto soon = [&] { return transport::now() + config_.reply_timeout; };
  const auto parameters = ask_parameters(session_->control, wanted_, soon());
  if (!parameters) return parameters.error();
  if (const auto status = check_unchanged(session_->parameters, *parameters); !status) return status;
  const auto state = session_->control.ask_state(soon());
  if (!state) return state.error();
  if (const auto status = check_state(*state, config_.allow_playback); !status) return status;
  return check_flow(*state);
}

/// Do frames come when they should? A connection can die on one side only, and firewalls swallow datagrams.
Status QualisysTracker::check_flow(Event state) const {
  const auto& flow = session_->flow;
  if (flow.idle.load(std::memory_order_relaxed)) return {};
  const TimePoint t_frame{Duration{flow.t_frame_ns.load(std::memory_order_relaxed)}};
  const Duration silence = transport::now() - t_frame;
  if (session_->source.is_udp() && !flow.any_data.load(std::memory_order_relaxed) && silence > kNoDatagram) {
    return make_error(Errc::kTimeout,
                      "no datagram of QTM came to UDP %s within 1 s; let them pass in the firewalls of both computers, "
                      "or set the transport to tcp",
                      session_->source.udp_name().c_str());
  }
  if (!is_measuring(state) || silence <= kSilence) return {};
  return make_error(Errc::kTimeout, "QTM %s but has sent no frame for %.0f s; is its real-time processing on?",
                    describe(state), to_seconds(silence));
}

}  // namespace embody::qualisys
