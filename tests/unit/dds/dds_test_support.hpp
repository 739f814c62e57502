#pragma once
// A private DDS domain per test process, and a reader of one topic in it.
#include <dds/dds.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <memory>
#include <string>
#include <vector>

#include "daemon/dds/publisher.hpp"
#include "daemon/dds/source_filter.hpp"

namespace embody::dds::test {

/// 20 to 99: other processes' DDS traffic stays apart, and all ports stay below the ephemeral range.
inline int private_domain() {
  return 20 + static_cast<int>(::getpid() % 80);
}

inline DdsConfig private_config() {
  DdsConfig config;
  config.domain = private_domain();
  return config;
}

inline bool has_locked_filter(int fd) {
  int locked = 0;
  socklen_t size = sizeof locked;
  return ::getsockopt(fd, SOL_SOCKET, SO_LOCK_FILTER, &locked, &size) == 0 && locked == 1;
}

/// Reads `topic` in the domain that a DdsPublisher of this process has opened.
template <class Message>
class Reader {
 public:
  Reader(const dds_topic_descriptor_t& type, const std::string& topic) {
    participant_ = dds_create_participant(static_cast<dds_domainid_t>(private_domain()), nullptr, nullptr);
    const std::unique_ptr<dds_qos_t, decltype(&dds_delete_qos)> qos(dds_create_qos(), &dds_delete_qos);
    dds_qset_reliability(qos.get(), DDS_RELIABILITY_RELIABLE, 0);
    dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, 10);
    const dds_entity_t entity = dds_create_topic(participant_, &type, topic.c_str(), nullptr, nullptr);
    reader_ = dds_create_reader(participant_, entity, qos.get(), nullptr);
    dds_set_status_mask(reader_, DDS_DATA_AVAILABLE_STATUS);
    waitset_ = dds_create_waitset(participant_);
    dds_waitset_attach(waitset_, reader_, 0);
  }
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;
  ~Reader() {
    give_back();
    dds_delete(participant_);
  }

  /// The next sample, or null after five seconds. Valid until the next call.
  const Message* next() {
    give_back();
    dds_sample_info_t info{};
    if (dds_waitset_wait(waitset_, nullptr, 0, 5'000'000'000) <= 0) return nullptr;
    if (dds_take(reader_, &sample_, &info, 1, 1) != 1 || !info.valid_data) return nullptr;
    return static_cast<const Message*>(sample_);
  }

 private:
  void give_back() {
    if (sample_ != nullptr) (void)dds_return_loan(reader_, &sample_, 1);
    sample_ = nullptr;
  }

  dds_entity_t participant_{0}, reader_{0}, waitset_{0};
  void* sample_{nullptr};
};

}  // namespace embody::dds::test
