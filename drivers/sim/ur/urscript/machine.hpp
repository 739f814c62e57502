#pragma once
// Runs compiled scripts with the controller's model of time: in each control cycle a program goes on until a call that
// takes time (servoj, stopj, sync, sleep), and continues there when that time is over.
#include <memory>

#include "drivers/sim/ur/urscript/code.hpp"
#include "drivers/sim/ur/urscript/script_error.hpp"
#include "drivers/sim/ur/urscript/script_host.hpp"

namespace embody::sim::urscript {

enum class Outcome : std::uint8_t {
  kRunning,
  kEnded,        ///< by its last line or by halt
  kFailed,       ///< a runtime error, see error()
  kTooMuchTime,  ///< a cycle without a call that takes time: C218
};

/// Memory is taken once, by the constructor; start() and cycle() never allocate.
class Machine {
 public:
  static constexpr int kInstructionsPerCycle = 20'000;
  static constexpr std::size_t kMaxStack = 512;  ///< values
  static constexpr std::size_t kMaxCalls = 32;   ///< functions within functions

  /// @param code  must outlive the machine.
  explicit Machine(const Code& code);

  /// From the first line, without variables.
  void start() noexcept;
  /// One control cycle. After an outcome other than kRunning nothing happens any more until start().
  Outcome cycle(ScriptHost& host) noexcept;
  /// Of kFailed and kTooMuchTime.
  [[nodiscard]] const ScriptError& error() const noexcept { return error_; }
  /// Line that comes next, or that waits.
  [[nodiscard]] int line() const noexcept;

 private:
  enum class Wait : std::uint8_t { kNone, kTime, kServo, kStop };
  struct Frame {
    std::int32_t return_to{0};
    std::size_t base{0};
  };

  [[nodiscard]] bool still_waiting(ScriptHost& host) noexcept;
  void step(ScriptHost& host) noexcept;
  void fail(const char* format, ...) noexcept __attribute__((format(printf, 2, 3)));

  [[nodiscard]] Value& top(std::size_t below = 0) noexcept { return stack_[depth_ - 1 - below]; }
  void push(const Value& value) noexcept;
  void drop(std::size_t count) noexcept { depth_ -= count; }
  [[nodiscard]] Value& variable(const Instruction& at, bool program) noexcept;

  void load(Value& from) noexcept;
  void assign(Value& to) noexcept;
  void load_item(const Value& list) noexcept;
  void assign_item(Value& list) noexcept;
  [[nodiscard]] bool index_of(const Value& list, const Value& index, std::size_t& at) noexcept;
  void make_list(std::size_t count, bool pose) noexcept;
  void jump_if_false(std::int32_t target) noexcept;
  void call(const Function& function) noexcept;
  void return_from_function() noexcept;

  void unary(Op op) noexcept;
  void binary(Op op) noexcept;
  void arithmetic(Op op, Value& left, const Value& right) noexcept;
  void compare(Op op, Value& left, const Value& right) noexcept;
  void logic(Op op, Value& left, const Value& right) noexcept;
  void set_integer(Value& value, double result) noexcept;

  void builtin(ScriptHost& host, std::int32_t id) noexcept;
  [[nodiscard]] Value calculate(std::int32_t id, const Value* arguments) noexcept;
  [[nodiscard]] Value registers(ScriptHost& host, std::int32_t id, const Value* arguments) noexcept;
  [[nodiscard]] Value ask(ScriptHost& host, std::int32_t id, const Value* arguments) noexcept;
  void servoj(ScriptHost& host, const Value* arguments) noexcept;
  void stopj(ScriptHost& host, const Value& deceleration) noexcept;
  void sleep(const Value& seconds) noexcept;
  void watchdog(ScriptHost& host, const Value* arguments) noexcept;
  void say(ScriptHost& host, MessageKind kind, const Value& first, const Value& second) noexcept;
  [[nodiscard]] double number(const Value& value) noexcept;
  [[nodiscard]] int address(const Value& value) noexcept;
  [[nodiscard]] Vector6 six(const Value& value) noexcept;
  [[nodiscard]] std::string_view text(const Value& value) noexcept;
  [[nodiscard]] bool may_move() noexcept;

  const Code& code_;
  std::unique_ptr<Value[]> stack_;
  std::unique_ptr<Value[]> variables_;
  std::size_t depth_{0};
  std::array<Frame, kMaxCalls> frames_{};
  std::size_t calls_{0};
  std::size_t next_{0};
  Wait wait_{Wait::kNone};
  double wait_s_{0.0};
  Outcome outcome_{Outcome::kEnded};
  ScriptError error_;
};

}  // namespace embody::sim::urscript
