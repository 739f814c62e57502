// A hand behind somebody else's driver, as the lab's hand: takes joint commands and publishes joint states on DDS.
#include <dds/dds.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <condition_variable>
#include <limits>
#include <mutex>
#include <optional>
#include <thread>

#include "daemon/dds/joint_state_match.hpp"
#include "daemon/dds/publisher.hpp"
#include "daemon/simlab/hands.hpp"
#include "daemon/simlab/motion_log.hpp"
#include "drivers/sim/fault_help.hpp"
#include "drivers/transport/clock.hpp"
#include "sensor_msgs.h"

namespace embody::sim {
namespace {

using Message = sensor_msgs_msg_dds__JointState_;

constexpr Duration kPeriod = std::chrono::milliseconds(10);
constexpr double kLag_s = 0.04;

enum Fault : std::size_t { kSilent, kDeaf, kFrozen, kPartial, kNan, kFaults };
struct FaultWords {
  const char* name;
  const char* meaning;
};
constexpr std::array<FaultWords, kFaults> kFaultWords{{
    {"silent", "no states are published"},
    {"deaf", "commands are not obeyed"},
    {"frozen", "the states keep their time stamp"},
    {"partial", "the last joint is missing in the states"},
    {"nan", "the states have no numbers"},
}};

/// Index and new value of a fault.
Result<std::pair<std::size_t, bool>> parse(std::string_view words) {
  for (std::size_t i = 0; i < kFaults; ++i) {
    for (const bool on : {false, true}) {
      if (words == std::string(kFaultWords[i].name) + (on ? " on" : " off")) return std::pair(i, on);
    }
  }
  return make_error(Errc::kInvalidArgument, "hand fault \"%.*s\" is none of: silent|deaf|frozen|partial|nan on|off",
                    static_cast<int>(std::min<std::size_t>(words.size(), 40)), words.data());
}

Error cyclone_error(const char* what, dds_return_t code) {
  return make_error(Errc::kIo, "the simulated hand cannot %s: %s", what, dds_strretcode(code));
}

class DdsHand final : public SimulatedHand {
 public:
  DdsHand(const config::EmbodyConfig& config, const HandOptions& options)
      : config_(config),
        joints_(config.hand.embodiment.motors),
        log_(options.log_length_s, [this] { return joint_angles_rad(); }) {
    for (std::size_t i = 0; i < joints_.size(); ++i) {
      q_rad_[i] = std::clamp(0.0, config.hand.embodiment.motor_lower_rad[i], config.hand.embodiment.motor_upper_rad[i]);
    }
    target_rad_ = q_rad_;
    for (std::string& joint : joints_) names_.push_back(joint.data());
  }
  ~DdsHand() override {
    thread_ = {};  // before what it uses
    if (participant_ > 0) dds_delete(participant_);
  }

  [[nodiscard]] const char* name() const noexcept override { return "hand"; }
  Status start() override {
    if (Status opened = open(); !opened) return opened;
    thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
    log_.start();
    return {};
  }
  [[nodiscard]] std::string device() const override { return config_.hand.joint_state.command_topic; }
  [[nodiscard]] bool in_use() const override {
    dds_publication_matched_status_t heard{};
    dds_subscription_matched_status_t hears{};
    return dds_get_publication_matched_status(writer_, &heard) == DDS_RETCODE_OK && heard.current_count > 0 &&
           dds_get_subscription_matched_status(reader_, &hears) == DDS_RETCODE_OK && hears.current_count > 0;
  }
  [[nodiscard]] std::vector<double> joint_angles_rad() const override {
    const std::scoped_lock lock(mutex_);
    return {q_rad_.begin(), q_rad_.begin() + static_cast<std::ptrdiff_t>(joints_.size())};
  }
  [[nodiscard]] std::vector<HandSample> log() const override { return log_.samples(); }
  [[nodiscard]] std::vector<HandCounter> counters() const override {
    return {{"motions", motions_}, {"states", states_}, {"incomplete", incomplete_}};
  }
  Status fault(std::string_view words) override {
    const auto fault = parse(words);
    if (!fault) return fault.error();
    faults_[fault->first] = fault->second;
    return {};
  }
  [[nodiscard]] Status check_fault(std::string_view words) const override {
    const auto fault = parse(words);
    return fault ? Status() : Status(fault.error());
  }
  [[nodiscard]] std::string fault_help() const override {
    std::string help;
    for (const auto& [name, meaning] : kFaultWords) add_fault_help(help, std::string(name) + " on|off", meaning);
    return help;
  }

 private:
  Status open();
  Result<dds_entity_t> open_topic(const std::string& name) const {
    const dds_entity_t topic =
        dds_create_topic(participant_, &sensor_msgs_msg_dds__JointState__desc, name.c_str(), nullptr, nullptr);
    if (topic < 0) return cyclone_error(("create topic " + name).c_str(), topic);
    return topic;
  }
  void run(const std::stop_token& stop);
  void take_commands();
  void move(double dt_s);
  void publish();

  config::EmbodyConfig config_;
  std::vector<std::string> joints_;
  std::vector<char*> names_;
  std::optional<DdsPublisher> domain_;  ///< with the daemon's own rules of who may be heard
  dds_entity_t participant_{0}, writer_{0}, reader_{0};
  mutable std::mutex mutex_;  // of the angles
  std::condition_variable_any never_;
  std::array<double, kMaxHandJoints> q_rad_{};
  std::array<double, kMaxHandJoints> target_rad_{};
  std::array<std::atomic<bool>, kFaults> faults_{};
  std::atomic<std::uint64_t> motions_{0}, states_{0}, incomplete_{0};
  std::chrono::nanoseconds stamp_{0};
  std::jthread thread_;
  MotionLog log_;
};

Status DdsHand::open() {
  DdsConfig dds;
  dds.domain = config_.dds.domain;
  dds.interface = config_.dds.interface;
  dds.networks = config_.dds.networks;
  dds.side = kSideNames[static_cast<std::size_t>(config_.subject.side)];
  auto domain = DdsPublisher::create(dds);
  if (!domain) return domain.error();
  domain_.emplace(std::move(*domain));
  participant_ = dds_create_participant(static_cast<dds_domainid_t>(dds.domain), nullptr, nullptr);
  if (participant_ < 0) return cyclone_error("create a participant", participant_);
  const std::unique_ptr<dds_qos_t, decltype(&dds_delete_qos)> qos(dds_create_qos(), &dds_delete_qos);
  dds_qset_reliability(qos.get(), DDS_RELIABILITY_RELIABLE, 0);
  dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, 1);
  const auto states = open_topic(config_.hand.joint_state.state_topic);
  if (!states) return states.error();
  writer_ = dds_create_writer(participant_, *states, qos.get(), nullptr);
  if (writer_ < 0) return cyclone_error("write its states", writer_);
  const auto commands = open_topic(config_.hand.joint_state.command_topic);
  if (!commands) return commands.error();
  reader_ = dds_create_reader(participant_, *commands, qos.get(), nullptr);
  return reader_ < 0 ? Status(cyclone_error("read its commands", reader_)) : Status();
}

void DdsHand::run(const std::stop_token& stop) {
  TimePoint t = transport::now();
  while (!stop.stop_requested()) {
    take_commands();
    const TimePoint now = transport::now();
    move(to_seconds(now - t));
    t = now;
    if (!faults_[kSilent]) publish();
    std::unique_lock lock(mutex_);
    never_.wait_until(lock, stop, now + kPeriod, [] { return false; });
  }
}

void DdsHand::take_commands() {
  void* sample = nullptr;
  dds_sample_info_t info{};
  while (dds_take(reader_, &sample, &info, 1, 1) == 1) {
    const auto& command = *static_cast<const Message*>(sample);
    if (info.valid_data && !faults_[kDeaf]) {
      const dds::MatchedJoints matched = dds::match_joints(
          {command.name._buffer, command.name._length}, {command.position._buffer, command.position._length}, joints_);
      const bool whole = matched.match == dds::JointStateMatch::kWhole;
      if (whole) target_rad_ = matched.q_rad;
      ++(whole ? motions_ : incomplete_);
    }
    static_cast<void>(dds_return_loan(reader_, &sample, 1));
    sample = nullptr;
  }
}

/// First-order lag, within the limits of the hand file.
void DdsHand::move(double dt_s) {
  const auto& hand = config_.hand.embodiment;
  const std::scoped_lock lock(mutex_);
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    const double target = std::clamp(target_rad_[i], hand.motor_lower_rad[i], hand.motor_upper_rad[i]);
    q_rad_[i] += (target - q_rad_[i]) * (1.0 - std::exp(-dt_s / kLag_s));
  }
}

void DdsHand::publish() {
  std::vector<double> q_rad = joint_angles_rad();
  if (faults_[kNan]) std::fill(q_rad.begin(), q_rad.end(), std::numeric_limits<double>::quiet_NaN());
  if (!faults_[kFrozen]) stamp_ = std::chrono::system_clock::now().time_since_epoch();
  const auto count = static_cast<std::uint32_t>(joints_.size() - (faults_[kPartial] ? 1 : 0));
  char no_frame[1]{};
  Message message{};
  message.header.stamp.sec = static_cast<std::int32_t>(stamp_.count() / 1'000'000'000);
  message.header.stamp.nanosec = static_cast<std::uint32_t>(stamp_.count() % 1'000'000'000);
  message.header.frame_id = no_frame;
  message.name = {count, count, names_.data(), false};
  message.position = {count, count, q_rad.data(), false};
  if (dds_write(writer_, &message) == DDS_RETCODE_OK) ++states_;
}

}  // namespace

std::unique_ptr<SimulatedHand> make_dds_hand(const config::EmbodyConfig& config, const HandOptions& options) {
  return std::make_unique<DdsHand>(config, options);
}

}  // namespace embody::sim
