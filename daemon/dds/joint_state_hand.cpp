#include "daemon/dds/joint_state_hand.hpp"

#include <dds/dds.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <set>

#include "daemon/dds/joint_state_match.hpp"
#include "daemon/dds/publisher.hpp"
#include "daemon/dds/source_filter.hpp"
#include "daemon/handoff/latest.hpp"
#include "drivers/transport/clock.hpp"
#include "drivers/transport/unique_fd.hpp"
#include "sensor_msgs.h"

namespace embody::dds {
namespace {

constexpr std::size_t kMaxName = 40;
constexpr int kMaxTakes = 8;  ///< messages per wake-up; more are taken in the next
constexpr Duration kLook = std::chrono::milliseconds(10);

Error cyclone_error(const char* what, dds_return_t code) {
  return make_error(Errc::kIo, "DDS cannot %s: %s", what, dds_strretcode(code));
}

bool is_topic(const std::string& name) {
  return !name.empty() && name.size() <= 200 && std::all_of(name.begin(), name.end(), [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '/';
  });
}

Status check(const JointStateHandConfig& config) {
  if (config.joints.empty() || config.joints.size() > kMaxHandJoints)
    return make_error(Errc::kInvalidArgument, "a hand on DDS needs 1 to %zu joints, not %zu", kMaxHandJoints,
                      config.joints.size());
  for (const std::string& joint : config.joints) {
    if (joint.empty() || joint.size() > kMaxName)
      return make_error(Errc::kInvalidArgument, "'%.60s' is no joint name: 1 to %zu characters", joint.c_str(),
                        kMaxName);
  }
  const std::set<std::string> different(config.joints.begin(), config.joints.end());
  if (different.size() != config.joints.size())
    return make_error(Errc::kInvalidArgument, "a joint of the hand on DDS is listed twice");
  for (const std::string* topic : {&config.command_topic, &config.state_topic}) {
    if (!is_topic(*topic))
      return make_error(Errc::kInvalidArgument, "'%.60s' is no DDS topic name: letters, digits, '_' and '/'",
                        topic->c_str());
  }
  if (config.command_topic == config.state_topic)
    return make_error(Errc::kInvalidArgument, "commands and states of the hand need two topics, not '%.60s' for both",
                      config.state_topic.c_str());
  if (!std::isfinite(config.rate_hz) || config.rate_hz <= 0.0 || config.rate_hz > 1000.0)
    return make_error(Errc::kInvalidArgument, "the rate of the hand on DDS must be up to 1000 Hz");
  if (config.state_timeout <= Duration::zero() || config.connect_timeout <= Duration::zero())
    return make_error(Errc::kInvalidArgument, "the time-outs of the hand on DDS must be positive");
  return {};
}

bool has_locked_filter(int fd) noexcept {
  int locked = 0;
  socklen_t size = sizeof locked;
  return ::getsockopt(fd, SOL_SOCKET, SO_LOCK_FILTER, &locked, &size) == 0 && locked == 1;
}

/// No socket that has appeared since `before` is open to everybody.
Status check_new_sockets(const std::vector<UdpSocket>& before) {
  const auto after = udp_sockets();
  if (!after) return after.error();
  for (const UdpSocket& s : *after) {
    if (std::find(before.begin(), before.end(), s) == before.end() && !has_locked_filter(s.fd))
      return make_error(Errc::kRefused, "a new UDP socket without source filter appeared: not listening for a hand");
  }
  return {};
}

struct State {
  std::array<double, kMaxHandJoints> q_rad{};
  TimePoint t_arrival{};
  std::uint64_t number{0};
};

/// Written by Cyclone's receive thread, read by the owner of the driver.
struct Inbox {
  explicit Inbox(JointStateHandCounters& all) : counters(all) {}

  static constexpr std::size_t kNoneMissing = ~std::size_t{0};
  JointStateHandCounters& counters;
  std::vector<std::string> joints;
  transport::UniqueFd wake;
  Latest<State> latest;
  std::atomic<bool> seen{false};                   ///< a whole state has come
  std::atomic<std::size_t> missing{kNoneMissing};  ///< the joint that the last partial message lacked
  std::uint64_t number{0};
  std::int64_t last_stamp_ns{0};

  void take(const sensor_msgs_msg_dds__JointState_& message, TimePoint now) noexcept {
    const MatchedJoints matched = match_joints({message.name._buffer, message.name._length},
                                               {message.position._buffer, message.position._length}, joints);
    switch (matched.match) {
      case JointStateMatch::kOther:
        return;
      case JointStateMatch::kPartial:
        missing.store(matched.missing, std::memory_order_relaxed);
        ++counters.partial;
        return;
      case JointStateMatch::kBroken:
        ++counters.broken;
        return;
      case JointStateMatch::kWhole:
        break;
    }
    const auto& stamp = message.header.stamp;
    const std::int64_t stamp_ns = std::int64_t{stamp.sec} * 1'000'000'000 + stamp.nanosec;
    const bool again = stamp_ns != 0 && stamp_ns == last_stamp_ns;
    last_stamp_ns = stamp_ns;
    if (again) {
      ++counters.repeated;
      return;
    }
    latest.publish({matched.q_rad, now, ++number});
    ++counters.states;
    seen.store(true, std::memory_order_relaxed);
    const std::uint64_t one = 1;
    static_cast<void>(!::write(wake.get(), &one, sizeof one));
  }
};

/// Cyclone's receive thread.
void on_data(dds_entity_t reader, void* argument) {
  auto* inbox = static_cast<Inbox*>(argument);
  std::array<void*, kMaxTakes> samples{};
  std::array<dds_sample_info_t, kMaxTakes> infos{};
  const dds_return_t count = dds_take(reader, samples.data(), infos.data(), kMaxTakes, kMaxTakes);
  if (count <= 0) return;
  const TimePoint now = transport::now();
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    if (infos[i].valid_data) inbox->take(*static_cast<const sensor_msgs_msg_dds__JointState_*>(samples[i]), now);
  }
  static_cast<void>(dds_return_loan(reader, samples.data(), count));
}

}  // namespace

class JointStateHand::Session {
 public:
  explicit Session(JointStateHandCounters& counters) : inbox(counters) {}
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;
  ~Session() {
    if (participant_ > 0) dds_delete(participant_);  // and all that is in it; waits for on_data()
  }

  Status open(const JointStateHandConfig& config);
  Status wait_for_other_end(const JointStateHandConfig& config);

  /// Publishes `q_rad`, stamped with this moment.
  dds_return_t publish(std::span<const double> q_rad) noexcept {
    const auto now = std::chrono::system_clock::now().time_since_epoch();
    const auto seconds = std::chrono::floor<std::chrono::seconds>(now);
    message_.header.stamp.sec = static_cast<std::int32_t>(seconds.count());
    message_.header.stamp.nanosec =
        static_cast<std::uint32_t>(std::chrono::duration_cast<std::chrono::nanoseconds>(now - seconds).count());
    std::copy(q_rad.begin(), q_rad.end(), positions_.begin());
    return dds_write(writer_, &message_);
  }

  Inbox inbox;
  State last;  ///< taken last

 private:
  [[nodiscard]] bool has_listener() const {
    dds_publication_matched_status_t status{};
    return dds_get_publication_matched_status(writer_, &status) == DDS_RETCODE_OK && status.current_count > 0;
  }
  Result<dds_entity_t> open_topic(const std::string& name) const;
  void prepare_message();

  dds_entity_t participant_{0}, writer_{0}, reader_{0};
  std::vector<char*> names_;
  std::array<double, kMaxHandJoints> positions_{};
  char no_frame_[1]{};
  sensor_msgs_msg_dds__JointState_ message_{};
};

Result<dds_entity_t> JointStateHand::Session::open_topic(const std::string& name) const {
  const dds_entity_t topic =
      dds_create_topic(participant_, &sensor_msgs_msg_dds__JointState__desc, name.c_str(), nullptr, nullptr);
  if (topic < 0) return cyclone_error(("create topic " + name).c_str(), topic);
  return topic;
}

void JointStateHand::Session::prepare_message() {
  for (std::string& joint : inbox.joints) names_.push_back(joint.data());
  const auto count = static_cast<std::uint32_t>(names_.size());
  message_.header.frame_id = no_frame_;
  message_.name = {count, count, names_.data(), false};
  message_.position = {count, count, positions_.data(), false};
}

Status JointStateHand::Session::open(const JointStateHandConfig& config) {
  const auto domain = static_cast<dds_domainid_t>(config.domain);
  // Without a domain of ours, Cyclone would open one with its own settings, for the whole network.
  if (config.domain < 0 || dds_lookup_participant(domain, nullptr, 0) <= 0)
    return make_error(Errc::kRefused, "DDS domain %d is not open: a hand on DDS needs [dds] to be enabled",
                      config.domain);
  inbox.joints = config.joints;
  prepare_message();
  inbox.wake.reset(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC));
  if (!inbox.wake) return make_error(Errc::kIo, "cannot create an eventfd: %s", std::strerror(errno));
  const auto before = udp_sockets();
  if (!before) return before.error();
  participant_ = dds_create_participant(domain, nullptr, nullptr);
  if (participant_ < 0) return cyclone_error("create a participant", participant_);

  const std::unique_ptr<dds_qos_t, decltype(&dds_delete_qos)> qos(dds_create_qos(), &dds_delete_qos);
  dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, 1);
  const dds_data_representation_id_t xcdr1 = DDS_DATA_REPRESENTATION_XCDR1;  // what ROS 2 reads
  dds_qset_data_representation(qos.get(), 1, &xcdr1);
  const auto commands = open_topic(config.command_topic);
  if (!commands) return commands.error();
  // Volatile: who comes late never gets an old target.
  dds_qset_reliability(qos.get(), DDS_RELIABILITY_RELIABLE, /*max_blocking_time=*/0);
  writer_ = dds_create_writer(participant_, *commands, qos.get(), nullptr);
  if (writer_ < 0) return cyclone_error("write the hand's commands", writer_);
  const auto states = open_topic(config.state_topic);
  if (!states) return states.error();
  dds_qset_reliability(qos.get(), DDS_RELIABILITY_BEST_EFFORT, 0);  // hears reliable writers too
  dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, kMaxTakes);    // several devices may share the topic
  const std::unique_ptr<dds_listener_t, decltype(&dds_delete_listener)> listener(dds_create_listener(&inbox),
                                                                                 &dds_delete_listener);
  dds_lset_data_available(listener.get(), &on_data);
  reader_ = dds_create_reader(participant_, *states, qos.get(), listener.get());
  if (reader_ < 0) return cyclone_error("read the hand's states", reader_);
  return check_new_sockets(*before);
}

Status JointStateHand::Session::wait_for_other_end(const JointStateHandConfig& config) {
  const TimePoint deadline = transport::now() + config.connect_timeout;
  bool seen = false;
  while (!(has_listener() && seen) && transport::now() < deadline) {
    pollfd entry{inbox.wake.get(), POLLIN, 0};
    const timespec pause{0, kLook.count()};
    if (!seen || !has_listener()) ::ppoll(seen ? nullptr : &entry, seen ? 0 : 1, &pause, nullptr);
    seen = inbox.seen.load(std::memory_order_relaxed);
  }
  if (seen && has_listener()) return {};
  const std::size_t missing = inbox.missing.load(std::memory_order_relaxed);
  if (!seen && missing != Inbox::kNoneMissing)
    return make_error(Errc::kTimeout, "the joint states on %.60s lack '%s' of the hand file",
                      config.state_topic.c_str(), inbox.joints[std::min(missing, inbox.joints.size() - 1)].c_str());
  if (!seen)
    return make_error(Errc::kTimeout, "no joint states of the hand on %.60s: does its driver run, in DDS domain %d?",
                      config.state_topic.c_str(), config.domain);
  return make_error(Errc::kTimeout, "nobody reads the hand's commands on %.60s: does its driver run?",
                    config.command_topic.c_str());
}

JointStateHand::JointStateHand(JointStateHandConfig config) : config_(std::move(config)) {
  show({{"states", &counters_.states},
        {"partial", &counters_.partial},
        {"broken", &counters_.broken},
        {"repeated", &counters_.repeated},
        {"commands", &counters_.commands},
        {"stops", &counters_.stops},
        {"throttled", &counters_.throttled},
        {"failed", &counters_.failed}});
}

JointStateHand::~JointStateHand() {
  if (!lost_ && moved_ && !latched_) publish_stop();
}

Result<HandInfo> JointStateHand::connect() {
  if (!lost_ && moved_ && !latched_) publish_stop();
  session_.reset();
  lost_ = true;
  if (const Status usable = check(config_); !usable) return usable.error();
  auto session = std::make_unique<Session>(counters_);
  if (const Status opened = session->open(config_); !opened) return opened.error();
  if (const Status there = session->wait_for_other_end(config_); !there) return there.error();
  session_ = std::move(session);
  lost_ = latched_ = hold_seen_ = moved_ = false;
  next_command_ = {};
  reason_ = {};
  static_cast<void>(take_states());
  HandInfo info;
  info.fd = session_->inbox.wake.get();
  info.rate_hz = config_.rate_hz;
  info.joint_count = config_.joints.size();
  for (std::size_t i = 0; i < info.joint_count; ++i) info.joint_names[i] = std::string_view(config_.joints[i]);
  std::array<char, 121> peer{};
  std::snprintf(peer.data(), peer.size(), "hand on DDS, states %.40s, commands %.40s", config_.state_topic.c_str(),
                config_.command_topic.c_str());
  info.peer = peer.data();
  return info;
}

/// True when there is a state that was not there before.
bool JointStateHand::take_states() noexcept {
  if (!session_->inbox.latest.update()) return false;
  session_->last = session_->inbox.latest.get();
  return true;
}

void JointStateHand::lose(std::string_view why) noexcept {
  lost_ = true;
  reason_ = why;
}

IoStatus JointStateHand::read(HandDeviceState& state) noexcept {
  if (lost_) return IoStatus::kDisconnected;
  std::uint64_t count = 0;
  static_cast<void>(!::read(session_->inbox.wake.get(), &count, sizeof count));
  if (!take_states()) {
    if (transport::now() - session_->last.t_arrival <= config_.state_timeout) return IoStatus::kEmpty;
    lose("the hand's joint states have stopped: does its driver still run?");
    return IoStatus::kDisconnected;
  }
  state.reply = session_->last.number;
  state.t_arrival = session_->last.t_arrival;
  state.joint_count = config_.joints.size();
  std::copy_n(session_->last.q_rad.begin(), state.joint_count, state.q_rad.begin());
  state.telemetry = {};  // the hand's own driver knows more, and has its own topics
  if (latched_ && !hold_seen_) {
    state.telemetry.condition = HandCondition::kStopped;
    state.telemetry.why_not = "the hand was stopped: hold first";
  }
  return IoStatus::kDone;
}

IoStatus JointStateHand::write(const HandCommand& command, TimePoint now) noexcept {
  if (lost_) return IoStatus::kDisconnected;
  switch (command.action) {
    case HandAction::kHold:
      hold_seen_ = latched_;
      return IoStatus::kDone;
    case HandAction::kStop:
      if (!latched_) publish_stop();
      latched_ = true;
      hold_seen_ = false;
      return lost_ ? IoStatus::kDisconnected : IoStatus::kDone;
    case HandAction::kMove:
      break;
  }
  if (!may_move(command, now)) return IoStatus::kRefused;
  latched_ = false;
  if (now < next_command_) {
    ++counters_.throttled;
    return IoStatus::kEmpty;
  }
  // The caller's clock may run at the same rate: half a millisecond early is no violation.
  next_command_ = now + from_seconds(1.0 / config_.rate_hz) - std::chrono::microseconds(500);
  const dds_return_t written = session_->publish({command.q_rad.data(), command.joint_count});
  if (written == DDS_RETCODE_OK) {
    moved_ = true;
    ++counters_.commands;
    return IoStatus::kDone;
  }
  ++counters_.failed;
  if (written == DDS_RETCODE_TIMEOUT) return IoStatus::kEmpty;
  lose("DDS takes no commands for the hand any more");
  return IoStatus::kDisconnected;
}

bool JointStateHand::may_move(const HandCommand& command, TimePoint now) const noexcept {
  if (now > command.t_expires || command.joint_count != config_.joints.size() || (latched_ && !hold_seen_))
    return false;
  return std::all_of(command.q_rad.begin(), command.q_rad.begin() + static_cast<std::ptrdiff_t>(command.joint_count),
                     [](double q) { return std::isfinite(q); });
}

/// Nothing is published for a hand that we have not moved: it is not ours to hold.
void JointStateHand::publish_stop() noexcept {
  if (!config_.stop_publishes_position || !moved_) return;
  static_cast<void>(take_states());
  const auto written = session_->publish({session_->last.q_rad.data(), config_.joints.size()});
  ++(written == DDS_RETCODE_OK ? counters_.stops : counters_.failed);
  if (written == DDS_RETCODE_OK) ++counters_.commands;
}

}  // namespace embody::dds
