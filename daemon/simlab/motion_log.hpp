#pragma once
// The log of a simulated hand that keeps none itself: looks 100 times a second.
#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

#include "daemon/simlab/follow_report.hpp"

namespace embody::sim {

class MotionLog {
 public:
  /// `look` returns the joint angles (rad); it is called from a thread of the log's own.
  MotionLog(double length_s, std::function<std::vector<double>()> look);
  ~MotionLog();
  MotionLog(const MotionLog&) = delete;
  MotionLog& operator=(const MotionLog&) = delete;

  void start();
  [[nodiscard]] std::vector<HandSample> samples() const;  ///< oldest first

 private:
  void run(const std::stop_token& stop);

  std::function<std::vector<double>()> look_;
  std::size_t capacity_;
  mutable std::mutex mutex_;
  std::condition_variable_any never_;  ///< only to be woken by the end
  std::vector<HandSample> samples_;
  std::size_t next_{0};
  std::jthread thread_;
};

}  // namespace embody::sim
