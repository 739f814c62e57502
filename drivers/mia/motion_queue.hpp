#pragma once
// Targets that wait for their turn on the line: the newest wins, none leaves after its time, none is said twice without
// need. No I/O, no clock.
#include <array>
#include <optional>

#include "core/base/time.hpp"
#include "core/hal/counter.hpp"
#include "drivers/mia/transmission.hpp"

namespace embody::mia {

class MotionQueue {
 public:
  /// Queues `value` (unit of the wire) for `motor`, unless that motor was told it less than `refresh` ago.
  void queue(std::size_t motor, int value, TimePoint t_expires, TimePoint now, Duration refresh) noexcept;
  /// Forgets what waits.
  void drop() noexcept;
  /// Nobody knows any more what the motors were told.
  void forget() noexcept;

  /// Takes what waits for `motor`. What has expired is dropped and counted in `expired`.
  std::optional<int> take(std::size_t motor, TimePoint now, Counter& expired) noexcept;
  /// `motor` has heard `value`, sent at `t_sent`.
  void heard(std::size_t motor, int value, TimePoint t_sent) noexcept { told_[motor] = {true, value, t_sent}; }

  /// Something newer than what was last taken waits for `motor`, or what was taken has expired meanwhile.
  [[nodiscard]] bool superseded(std::size_t motor, TimePoint now) const noexcept {
    return waiting_[motor].pending || now > waiting_[motor].t_expires;
  }
  [[nodiscard]] bool empty() const noexcept;

 private:
  struct Waiting {
    bool pending{false};
    int value{0};
    TimePoint t_expires{};
  };
  struct Told {
    bool known{false};
    int value{0};
    TimePoint when{};
  };
  std::array<Waiting, kMotors> waiting_{};
  std::array<Told, kMotors> told_{};
};

}  // namespace embody::mia
