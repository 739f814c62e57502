#include "drivers/mia/motion_queue.hpp"

#include <algorithm>
#include <utility>

namespace embody::mia {

void MotionQueue::queue(std::size_t motor, int value, TimePoint t_expires, TimePoint now, Duration refresh) noexcept {
  const Told& told = told_[motor];
  const bool news = !told.known || told.value != value || now - told.when >= refresh;
  waiting_[motor] = {news, value, t_expires};
}

void MotionQueue::drop() noexcept {
  waiting_ = {};
}

void MotionQueue::forget() noexcept {
  told_ = {};
}

std::optional<int> MotionQueue::take(std::size_t motor, TimePoint now, Counter& expired) noexcept {
  Waiting& waiting = waiting_[motor];
  if (!std::exchange(waiting.pending, false)) return std::nullopt;
  if (now > waiting.t_expires) {
    ++expired;
    return std::nullopt;
  }
  told_[motor].known = false;  // until it is heard
  return waiting.value;
}

bool MotionQueue::empty() const noexcept {
  return std::none_of(waiting_.begin(), waiting_.end(), [](const Waiting& waiting) { return waiting.pending; });
}

}  // namespace embody::mia
