#include "daemon/simlab/motion_log.hpp"

#include <algorithm>
#include <utility>

#include "drivers/transport/clock.hpp"

namespace embody::sim {
namespace {

constexpr Duration kPeriod = std::chrono::milliseconds(10);

HandSample sample_of(const std::vector<double>& q_rad, TimePoint t) {
  HandSample sample;
  sample.t = t;
  sample.count = std::min(q_rad.size(), sample.q_rad.size());
  std::copy_n(q_rad.begin(), sample.count, sample.q_rad.begin());
  return sample;
}

}  // namespace

MotionLog::MotionLog(double length_s, std::function<std::vector<double>()> look)
    : look_(std::move(look)), capacity_(static_cast<std::size_t>(std::max(1.0, length_s / to_seconds(kPeriod)))) {}

MotionLog::~MotionLog() = default;

void MotionLog::start() {
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

void MotionLog::run(const std::stop_token& stop) {
  TimePoint t_next = transport::now();
  while (!stop.stop_requested()) {
    const HandSample sample = sample_of(look_(), transport::now());
    t_next =
        std::max(t_next + kPeriod, transport::now() - kPeriod);  // moments that the host missed are not made up for
    std::unique_lock lock(mutex_);
    if (samples_.size() < capacity_) {
      samples_.push_back(sample);
    } else {
      samples_[next_] = sample;
      next_ = (next_ + 1) % capacity_;
    }
    never_.wait_until(lock, stop, t_next, [] { return false; });
  }
}

std::vector<HandSample> MotionLog::samples() const {
  const std::scoped_lock lock(mutex_);
  std::vector<HandSample> ordered(samples_);
  std::rotate(ordered.begin(), ordered.begin() + static_cast<std::ptrdiff_t>(next_), ordered.end());
  return ordered;
}

}  // namespace embody::sim
