#pragma once
// What the arm's loop tells the links thread: the newest modes and settings of the controller, by atomics only.
#include <array>
#include <atomic>

#include "drivers/ur_rtde/arm_package.hpp"

namespace embody::ur {

struct ArmSnapshot {
  std::uint64_t packages{0};  ///< since connect(); 0: nothing known yet
  std::uint64_t commands{0};  ///< sent since connect()
  rtde::ControllerStatus controller;
  bool answers{true};  ///< the program repeats our sequences
};

/// One writer (the arm's loop), any number of readers. The modes of a snapshot are of one package; counters and
/// settings may be newer.
class SharedArmStatus {
 public:
  void reset() noexcept {
    packages_.store(0, std::memory_order_relaxed);
    commands_.store(0, std::memory_order_relaxed);
    for (auto& value : settings_) value.store(0.0, std::memory_order_relaxed);
  }
  void publish(std::uint64_t packages, const rtde::ControllerStatus& status, bool answers) noexcept;
  void publish_settings(const rtde::ArmSettings& settings) noexcept;
  void count_command() noexcept { commands_.fetch_add(1, std::memory_order_relaxed); }

  [[nodiscard]] ArmSnapshot snapshot() const noexcept;
  [[nodiscard]] rtde::ArmSettings settings() const noexcept;

 private:
  std::atomic<std::uint64_t> packages_{0};
  std::atomic<std::uint64_t> commands_{0};
  std::atomic<std::uint64_t> modes_{0};
  std::array<std::atomic<double>, 10> settings_{};  // payload, centre of gravity, tool centre point
};

}  // namespace embody::ur
