#pragma once
// What the robot has to say to people: a bounded queue, emptied by whoever sends it on. The newest win.
#include <array>
#include <cstdint>
#include <optional>

#include "core/base/fixed_string.hpp"

namespace embody::sim {

struct RobotText {
  enum class Kind : std::uint8_t {
    kText,       ///< textmsg
    kPopup,      ///< popup
    kException,  ///< a script does not compile, or failed: line and column
    kStopCode,   ///< protective stop: code and argument, C204A1 for instance
    kStarted,    ///< text: the program's name
    kStopped,
  };
  Kind kind{Kind::kText};
  int code{0};
  int argument{0};
  int line{0};
  int column{0};
  FixedString<160> text;
};

class RobotTexts {
 public:
  void push(const RobotText& text) noexcept {
    ring_[(first_ + count_) % kCapacity] = text;
    if (count_ == kCapacity) {
      first_ = (first_ + 1) % kCapacity;
      ++dropped_;
    } else {
      ++count_;
    }
  }
  [[nodiscard]] std::optional<RobotText> pop() noexcept {
    if (count_ == 0) return std::nullopt;
    const std::size_t at = first_;
    first_ = (first_ + 1) % kCapacity;
    --count_;
    return ring_[at];
  }
  [[nodiscard]] std::uint64_t dropped() const noexcept { return dropped_; }

 private:
  static constexpr std::size_t kCapacity = 32;
  std::array<RobotText, kCapacity> ring_{};
  std::size_t first_{0};
  std::size_t count_{0};
  std::uint64_t dropped_{0};
};

}  // namespace embody::sim
