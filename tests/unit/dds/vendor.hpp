#pragma once
// The driver of a hand's vendor, as it is seen over DDS, for tests of our end.
#include <dds/dds.h>
#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "sensor_msgs.h"

namespace embody::dds::test {

/// Publishes states, reads commands. Its entities live in a participant of its own.
class Vendor {
 public:
  using Message = sensor_msgs_msg_dds__JointState_;

  explicit Vendor(int domain, bool listens = true) {
    participant_ = dds_create_participant(static_cast<dds_domainid_t>(domain), nullptr, nullptr);
    const auto topic = [this](const char* name) {
      return dds_create_topic(participant_, &sensor_msgs_msg_dds__JointState__desc, name, nullptr, nullptr);
    };
    const std::unique_ptr<dds_qos_t, decltype(&dds_delete_qos)> qos(dds_create_qos(), &dds_delete_qos);
    dds_qset_reliability(qos.get(), DDS_RELIABILITY_RELIABLE, 0);
    dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, 10);
    writer_ = dds_create_writer(participant_, topic("rt/joint_states"), qos.get(), nullptr);
    if (listens) reader_ = dds_create_reader(participant_, topic("rt/embody/right/hand_command"), qos.get(), nullptr);
  }
  Vendor(const Vendor&) = delete;
  Vendor& operator=(const Vendor&) = delete;
  ~Vendor() { dds_delete(participant_); }

  void publish(const std::vector<std::string>& names, const std::vector<double>& q_rad, std::int64_t stamp_ns = -1) {
    if (stamp_ns < 0) stamp_ns = ++stamp_ns_;
    std::vector<char*> pointers;
    for (const std::string& name : names) pointers.push_back(const_cast<char*>(name.c_str()));
    char frame[] = "";
    Message message{};
    message.header.stamp.sec = static_cast<std::int32_t>(stamp_ns / 1'000'000'000);
    message.header.stamp.nanosec = static_cast<std::uint32_t>(stamp_ns % 1'000'000'000);
    message.header.frame_id = frame;
    const auto count = static_cast<std::uint32_t>(names.size());
    const auto positions = static_cast<std::uint32_t>(q_rad.size());
    message.name = {count, count, pointers.data(), false};
    message.position = {positions, positions, const_cast<double*>(q_rad.data()), false};
    EXPECT_EQ(dds_write(writer_, &message), DDS_RETCODE_OK);
  }

  struct Command {
    std::vector<std::string> names;
    std::vector<double> q_rad;
    double age_s{0.0};  ///< by its stamp
  };
  /// Commands since the last call.
  std::vector<Command> commands() {
    std::vector<Command> result;
    while (true) {
      void* sample = nullptr;
      dds_sample_info_t info{};
      if (dds_take(reader_, &sample, &info, 1, 1) != 1) return result;
      const auto& m = *static_cast<const Message*>(sample);
      if (info.valid_data) {
        const std::chrono::duration<double> wall = std::chrono::system_clock::now().time_since_epoch();
        result.push_back({{m.name._buffer, m.name._buffer + m.name._length},
                          {m.position._buffer, m.position._buffer + m.position._length},
                          wall.count() - m.header.stamp.sec - 1e-9 * m.header.stamp.nanosec});
      }
      (void)dds_return_loan(reader_, &sample, 1);
    }
  }

 private:
  dds_entity_t participant_{0}, writer_{0}, reader_{0};
  std::int64_t stamp_ns_{0};
};

}  // namespace embody::dds::test
