#pragma once
// What `embodyctl hand` does with a connected robot hand.
#include <span>
#include <string>

#include "core/hal/hand_driver.hpp"

namespace embody::ctl {

struct HandTaskOptions {
  bool json{false};
  bool watch{false};  ///< show: until Ctrl-C
  bool tare{false};   ///< show: take what is measured first for zero force
};

/// Outcome for people and, as JSON, for programs.
struct HandAnswer {
  std::string json{"{}"};
  std::string text;  ///< lines; empty: "done"
};

struct HandTask {
  const char* name;
  const char* help;
  Result<HandAnswer> (*run)(HandDriver& hand, const HandInfo& info, const HandTaskOptions& options);
};

/// calibrate, activate (these move the hand), tare, show (these do not).
[[nodiscard]] std::span<const HandTask> hand_tasks() noexcept;

/// From now on Ctrl-C makes the actions end early and in order.
void catch_interrupts();
[[nodiscard]] bool interrupted() noexcept;

}  // namespace embody::ctl
