#include "daemon/dds/publisher.hpp"

#include <dds/dds.h>
#include <sched.h>

#include <algorithm>
#include <atomic>
#include <cctype>
#include <cstring>

#include "daemon/dds/source_filter.hpp"
#include "embody_msgs.h"
#include "sensor_msgs.h"

namespace embody {
namespace {

constexpr int kHistoryDepth = 10;       // ROS 2's default
constexpr int kMaxDomain = 232;         // beyond, the ports of RTPS 2.2 section 9.6.1.1 exceed 65535
constexpr std::size_t kMinSockets = 2;  // discovery and data

using Names = std::vector<char*>;

/// DDS's C types are not const-correct: a sample that is only written still holds `char*`.
char* c_text(const std::string& text) {
  return const_cast<char*>(text.c_str());
}

builtin_interfaces_msg_dds__Time_ to_message(WallTime t) {
  const auto seconds = std::chrono::floor<std::chrono::seconds>(t);
  return {static_cast<std::int32_t>(seconds.time_since_epoch().count()),
          static_cast<std::uint32_t>((t - seconds).count())};
}

geometry_msgs_msg_dds__Pose_ to_message(const Pose& X) {
  const Eigen::Quaterniond q(X.linear());
  const Eigen::Vector3d p = X.translation();
  return {{p.x(), p.y(), p.z()}, {q.x(), q.y(), q.z(), q.w()}};
}

dds_sequence_double to_message(std::span<const double> values) {
  const auto size = static_cast<std::uint32_t>(values.size());
  return {size, size, const_cast<double*>(values.data()), false};
}

/// A sequence that borrows `items`.
template <class Sequence, class Item>
Sequence borrow(std::vector<Item>& items) {
  const auto size = static_cast<std::uint32_t>(items.size());
  return {size, size, items.data(), false};
}

bool is_plain_word(std::string_view text, std::string_view extra) {
  return !text.empty() && std::all_of(text.begin(), text.end(), [extra](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || extra.find(c) != std::string_view::npos;
  });
}

/// Cyclone's threads inherit the scheduling of the thread that opens the domain, and must never outrank a control loop.
Status check_scheduling() {
  const int policy = ::sched_getscheduler(0) & ~SCHED_RESET_ON_FORK;
  if (policy != SCHED_FIFO && policy != SCHED_RR) return {};
  return make_error(Errc::kRefused, "DDS must be opened from a thread without real-time scheduling");
}

/// The side ends up in topic names and the interface in Cyclone's XML: neither may hold anything but a plain word.
Status check(const DdsConfig& config) {
  if (config.domain < 0 || config.domain > kMaxDomain)
    return make_error(Errc::kInvalidArgument, "the DDS domain must be 0 to %d, not %d", kMaxDomain, config.domain);
  if (!is_plain_word(config.side, "_"))
    return make_error(Errc::kInvalidArgument, "the side '%.20s' must be letters, digits and '_', like 'right'",
                      config.side.c_str());
  if (!is_plain_word(config.interface, "_.-") || config.interface.size() > 15)
    return make_error(Errc::kInvalidArgument, "'%.20s' is not the name of a network interface; 'ip link' lists them",
                      config.interface.c_str());
  return {};
}

Result<std::vector<dds::Network>> accepted_networks(const DdsConfig& config) {
  auto networks = dds::networks_of(config.interface);  // also checks that the interface exists
  if (!networks || config.networks.empty()) return networks;
  if (config.networks.size() > dds::kMaxNetworks)
    return make_error(Errc::kInvalidArgument, "at most %zu DDS networks, not %zu", dds::kMaxNetworks,
                      config.networks.size());
  networks->clear();
  for (const std::string& text : config.networks) {
    const auto network = dds::parse_network(text);
    if (!network) return network.error();
    networks->push_back(*network);
  }
  return networks;
}

/// Cyclone's configuration. The loopback knows no multicast, so peers are sought on the well-known ports of localhost.
/// No linger: a reader that hangs must not delay the end of the daemon.
std::string cyclone_config(const std::string& interface) {
  const bool loopback = interface == "lo";
  return "<CycloneDDS><Domain Id=\"any\"><General><Interfaces><NetworkInterface name=\"" + interface + "\"" +
         (loopback ? " multicast=\"false\"" : "") + "/></Interfaces><AllowMulticast>" + (loopback ? "false" : "spdp") +
         "</AllowMulticast></General><Discovery><ParticipantIndex>auto</ParticipantIndex>"
         "<MaxAutoParticipantIndex>32</MaxAutoParticipantIndex>" +
         (loopback ? "<Peers><Peer address=\"localhost\"/></Peers>" : "") +
         "</Discovery><Internal><WriterLingerDuration>0s</WriterLingerDuration></Internal></Domain></CycloneDDS>";
}

Error cyclone_error(const char* what, dds_return_t code) {
  return make_error(Errc::kIo, "DDS cannot %s: %s", what, dds_strretcode(code));
}

}  // namespace

WallTime to_wall_time(TimePoint t) noexcept {
  if (t == TimePoint{}) return {};
  const Duration ago = std::chrono::steady_clock::now() - t;
  return std::chrono::time_point_cast<Duration>(std::chrono::system_clock::now()) - ago;
}

class DdsPublisher::Impl {
 public:
  Impl() = default;
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl() {
    if (domain_ > 0) dds_delete(domain_);  // and all that is in it
  }

  Status open(const DdsConfig& config);
  bool write(dds_entity_t writer, const void* sample) { return count(dds_write(writer, sample) == DDS_RETCODE_OK); }
  bool count(bool ok) {
    (ok ? published_ : failed_).fetch_add(1, std::memory_order_relaxed);
    return ok;
  }
  [[nodiscard]] Counters counters() const {
    return {published_.load(std::memory_order_relaxed), failed_.load(std::memory_order_relaxed)};
  }

  dds_entity_t joint_states{0}, hand_pose{0}, hand_state{0}, hand_telemetry{0}, markers{0}, status{0};
  std::size_t filtered_sockets{0};

 private:
  Status open_writers(const DdsConfig& config);
  Result<dds_entity_t> open_writer(const std::string& topic_name, const dds_topic_descriptor_t& type);

  dds_entity_t domain_{0}, participant_{0};
  std::atomic<std::uint64_t> published_{0}, failed_{0};
};

Status DdsPublisher::Impl::open(const DdsConfig& config) {
  const auto networks = accepted_networks(config);
  if (!networks) return networks.error();
  const auto before = dds::udp_sockets();
  if (!before) return before.error();

  domain_ = dds_create_domain(static_cast<dds_domainid_t>(config.domain), cyclone_config(config.interface).c_str());
  if (domain_ == DDS_RETCODE_PRECONDITION_NOT_MET)
    return make_error(Errc::kRefused, "DDS domain %d is already open in this process", config.domain);
  if (domain_ < 0)
    return make_error(Errc::kIo,
                      "cannot open DDS domain %d on interface %s (%s): are its UDP ports from %d on all taken?",
                      config.domain, config.interface.c_str(), dds_strretcode(domain_), 7410 + 250 * config.domain);

  // Cyclone opens its sockets with the domain: filter them before there is a participant to talk to.
  const auto filtered = dds::udp_sockets();
  if (!filtered) return filtered.error();
  for (const dds::UdpSocket& s : *filtered) {
    if (std::find(before->begin(), before->end(), s) != before->end()) continue;
    if (const Status attached = dds::accept_only(s.fd, *networks); !attached) return attached;
    ++filtered_sockets;
  }
  if (const Status opened = open_writers(config); !opened) return opened;

  const auto after = dds::udp_sockets();
  if (!after) return after.error();
  if (filtered_sockets < kMinSockets || *after != *filtered)
    return make_error(Errc::kIo, "%zu of %zu UDP sockets of DDS carry the source filter: refusing to go on",
                      filtered_sockets, after->size() - std::min(after->size(), before->size()));
  return {};
}

Status DdsPublisher::Impl::open_writers(const DdsConfig& config) {
  participant_ = dds_create_participant(static_cast<dds_domainid_t>(config.domain), nullptr, nullptr);
  if (participant_ < 0) return cyclone_error("create a participant", participant_);
  const std::string side = "rt/embody/" + config.side;
  const struct {
    dds_entity_t& writer;
    std::string topic;
    const dds_topic_descriptor_t& type;
  } outputs[] = {{joint_states, side + "/joint_states", sensor_msgs_msg_dds__JointState__desc},
                 {hand_pose, side + "/hand_pose", geometry_msgs_msg_dds__PoseStamped__desc},
                 {hand_state, side + "/hand_state", embody_msgs_msg_dds__HandState__desc},
                 {hand_telemetry, side + "/hand_telemetry", embody_msgs_msg_dds__HandTelemetry__desc},
                 {markers, side + "/markers", embody_msgs_msg_dds__Markers__desc},
                 {status, "rt/embody/status", embody_msgs_msg_dds__Status__desc}};
  for (const auto& output : outputs) {
    const auto writer = open_writer(output.topic, output.type);
    if (!writer) return writer.error();
    output.writer = *writer;
  }
  return {};
}

Result<dds_entity_t> DdsPublisher::Impl::open_writer(const std::string& topic_name,
                                                     const dds_topic_descriptor_t& type) {
  const std::unique_ptr<dds_qos_t, decltype(&dds_delete_qos)> qos(dds_create_qos(), &dds_delete_qos);
  dds_qset_reliability(qos.get(), DDS_RELIABILITY_RELIABLE, /*max_blocking_time=*/0);
  dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, kHistoryDepth);
  const dds_data_representation_id_t xcdr1 = DDS_DATA_REPRESENTATION_XCDR1;  // what ROS 2 reads
  dds_qset_data_representation(qos.get(), 1, &xcdr1);
  const dds_entity_t topic = dds_create_topic(participant_, &type, topic_name.c_str(), nullptr, nullptr);
  if (topic < 0) return cyclone_error(("create topic " + topic_name).c_str(), topic);
  const dds_entity_t writer = dds_create_writer(participant_, topic, qos.get(), nullptr);
  if (writer < 0) return cyclone_error(("write topic " + topic_name).c_str(), writer);
  return writer;
}

DdsPublisher::DdsPublisher(std::unique_ptr<Impl> impl) noexcept : impl_(std::move(impl)) {}
DdsPublisher::DdsPublisher(DdsPublisher&&) noexcept = default;
DdsPublisher& DdsPublisher::operator=(DdsPublisher&&) noexcept = default;
DdsPublisher::~DdsPublisher() = default;

Result<DdsPublisher> DdsPublisher::create(const DdsConfig& config) {
  if (!config.enabled) return DdsPublisher(nullptr);
  if (const Status checked = check(config); !checked) return checked.error();
  if (const Status checked = check_scheduling(); !checked) return checked.error();
  auto impl = std::make_unique<Impl>();
  if (const Status opened = impl->open(config); !opened) return opened.error();
  return DdsPublisher(std::move(impl));
}

bool DdsPublisher::publish_joint_states(std::span<const std::string> names, std::span<const double> position_rad,
                                        std::span<const double> velocity_rad_s, WallTime stamp) {
  if (!impl_) return false;
  if (position_rad.size() != names.size() || (!velocity_rad_s.empty() && velocity_rad_s.size() != names.size()))
    return impl_->count(false);
  Names pointers(names.size());
  std::transform(names.begin(), names.end(), pointers.begin(), c_text);
  const std::string no_frame;
  const sensor_msgs_msg_dds__JointState_ sample{{to_message(stamp), c_text(no_frame)},
                                                borrow<dds_sequence_string>(pointers),
                                                to_message(position_rad),
                                                to_message(velocity_rad_s),
                                                {}};
  return impl_->write(impl_->joint_states, &sample);
}

bool DdsPublisher::publish_hand_pose(const Pose& X_WM, std::string_view frame_id, WallTime stamp) {
  if (!impl_) return false;
  const std::string frame(frame_id);
  const geometry_msgs_msg_dds__PoseStamped_ sample{{to_message(stamp), c_text(frame)}, to_message(X_WM)};
  return impl_->write(impl_->hand_pose, &sample);
}

bool DdsPublisher::publish_hand_state(const HandState& hand) {
  if (!impl_) return false;
  const auto ns = [](TimePoint t) { return to_wall_time(t).time_since_epoch().count(); };
  embody_msgs_msg_dds__HandState_ sample{};
  sample.frame_number = hand.frame_number;
  sample.capture_ns = ns(hand.t_capture);
  sample.arrival_ns = ns(hand.t_arrival);
  sample.estimated_ns = ns(hand.t_estimated);
  sample.pose = to_message(hand.X_WM);
  std::copy_n(hand.q_rad.data(), kHandAngles, sample.q_rad);
  std::copy(hand.residual_m.begin(), hand.residual_m.end(), sample.residual_m);
  std::copy(hand.visible_markers.begin(), hand.visible_markers.end(), sample.visible_markers);
  std::transform(hand.quality.begin(), hand.quality.end(), sample.quality,
                 [](FingerQuality quality) { return static_cast<std::uint8_t>(quality); });
  std::copy(hand.confidence.begin(), hand.confidence.end(), sample.confidence);
  sample.hand_confidence = hand.hand_confidence;
  sample.valid = hand.valid;
  return impl_->write(impl_->hand_state, &sample);
}

bool DdsPublisher::publish_hand_telemetry(const HandDeviceState& hand, std::span<const std::string> joints) {
  if (!impl_) return false;
  if (hand.joint_count != joints.size() || joints.size() > kMaxHandJoints) return impl_->count(false);
  const HandTelemetry& telemetry = hand.telemetry;
  Names names(joints.size());
  std::transform(joints.begin(), joints.end(), names.begin(), c_text);
  std::vector<double> current;
  if (telemetry.t_current != TimePoint{}) {
    const std::size_t count = std::min(telemetry.current_count, kMaxHandCurrents);
    for (std::size_t i = 0; i < count; ++i) {
      current.push_back(telemetry.current_in_ampere ? telemetry.current_a[i] : telemetry.current_raw[i]);
    }
  }
  const std::span<const double> none;
  std::vector<embody_msgs_msg_dds__RawForce_> force;
  for (std::size_t i = 0; telemetry.t_force != TimePoint{} && i < kMaxHandFingers; ++i) {
    const RawForce& f = telemetry.force[i];
    if (f.measured) force.push_back({static_cast<std::uint8_t>(i), f.normal, f.tangential});
  }
  const std::string why_not(telemetry.why_not.view());
  const std::string condition = kHandConditionNames[static_cast<std::size_t>(telemetry.condition)];
  const std::string supply = kHandSupplyNames[static_cast<std::size_t>(telemetry.supply)];
  const embody_msgs_msg_dds__HandTelemetry_ sample{
      to_wall_time(hand.t_arrival).time_since_epoch().count(),
      c_text(condition),
      c_text(why_not),
      c_text(supply),
      borrow<dds_sequence_string>(names),
      to_message({hand.q_rad.data(), hand.joint_count}),
      to_message(telemetry.current_in_ampere ? std::span<const double>(current) : none),
      to_message(telemetry.current_in_ampere ? none : std::span<const double>(current)),
      borrow<dds_sequence_embody_msgs_msg_dds__RawForce_>(force)};
  return impl_->write(impl_->hand_telemetry, &sample);
}

bool DdsPublisher::publish_markers(const MarkersSample& markers) {
  if (!impl_) return false;
  std::vector<embody_msgs_msg_dds__Marker_> rows;
  for (const auto& m : markers.markers)
    rows.push_back({c_text(m.name),
                    m.finger,
                    m.seen,
                    m.verdict,
                    c_text(m.source),
                    {m.p_W.x(), m.p_W.y(), m.p_W.z()},
                    m.residual_m});
  Names findings(markers.findings.size());
  std::transform(markers.findings.begin(), markers.findings.end(), findings.begin(), c_text);
  const embody_msgs_msg_dds__Markers_ sample{markers.frame_number,
                                             markers.t_capture.time_since_epoch().count(),
                                             borrow<dds_sequence_embody_msgs_msg_dds__Marker_>(rows),
                                             c_text(markers.back),
                                             markers.back_fit_error_m,
                                             borrow<dds_sequence_string>(findings)};
  return impl_->write(impl_->markers, &sample);
}

bool DdsPublisher::publish_status(const StatusSample& status) {
  if (!impl_) return false;
  std::vector<embody_msgs_msg_dds__Counter_> counters;
  for (const auto& c : status.counters) counters.push_back({c_text(c.name), c.value});
  std::vector<embody_msgs_msg_dds__Rate_> rates;
  for (const auto& r : status.rates) rates.push_back({c_text(r.name), r.rate_hz});
  std::vector<embody_msgs_msg_dds__Latency_> latencies;
  for (const auto& l : status.latencies)
    latencies.push_back({c_text(l.name), l.count, l.p50_us, l.p99_us, l.p999_us, l.max_us});
  const embody_msgs_msg_dds__Status_ sample{to_message(status.stamp),
                                            c_text(status.mode),
                                            c_text(status.cause),
                                            status.epoch,
                                            borrow<dds_sequence_embody_msgs_msg_dds__Counter_>(counters),
                                            borrow<dds_sequence_embody_msgs_msg_dds__Rate_>(rates),
                                            borrow<dds_sequence_embody_msgs_msg_dds__Latency_>(latencies)};
  return impl_->write(impl_->status, &sample);
}

DdsPublisher::Counters DdsPublisher::counters() const noexcept {
  return impl_ ? impl_->counters() : Counters{};
}

std::size_t DdsPublisher::filtered_sockets() const noexcept {
  return impl_ ? impl_->filtered_sockets : 0;
}

}  // namespace embody
