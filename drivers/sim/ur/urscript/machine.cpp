#include "drivers/sim/ur/urscript/machine.hpp"

#include <cstdarg>
#include <cstdio>

namespace embody::sim::urscript {

Machine::Machine(const Code& code)
    : code_(code),
      stack_(std::make_unique<Value[]>(kMaxStack)),
      variables_(std::make_unique<Value[]>(code.variables.size())) {}

void Machine::start() noexcept {
  for (std::size_t i = 0; i < code_.variables.size(); ++i) variables_[i] = Value();
  depth_ = calls_ = next_ = 0;
  wait_ = Wait::kNone;
  outcome_ = Outcome::kRunning;
  error_ = {};
}

Outcome Machine::cycle(ScriptHost& host) noexcept {
  if (outcome_ != Outcome::kRunning || still_waiting(host)) return outcome_;
  for (int i = 0; i < kInstructionsPerCycle; ++i) {
    step(host);
    if (outcome_ != Outcome::kRunning || wait_ != Wait::kNone) return outcome_;
  }
  fail("C218: the program '%s' used too much time without a call that waits", code_.name.c_str());
  return outcome_ = Outcome::kTooMuchTime;
}

int Machine::line() const noexcept {
  return next_ < code_.instructions.size() ? code_.instructions[next_].line : 0;
}

// Motion proceeds with the speed slider, time does not.
bool Machine::still_waiting(ScriptHost& host) noexcept {
  if (wait_ == Wait::kNone) return false;
  wait_s_ -= host.step_time_s() * (wait_ == Wait::kServo ? host.speed_scaling() : 1.0);
  const bool waiting = wait_s_ > 1e-9 || (wait_ == Wait::kStop && !host.at_rest());
  if (waiting) return true;
  if (wait_ != Wait::kTime) host.motion_done();
  wait_ = Wait::kNone;
  return false;
}

void Machine::step(ScriptHost& host) noexcept {
  const Instruction& at = code_.instructions[next_++];
  switch (at.op) {
    case Op::kConstant:
      return push(Value(code_.constants[static_cast<std::size_t>(at.a)]));
    case Op::kGlobal:
    case Op::kLocal:
      return load(variable(at, at.op == Op::kGlobal));
    case Op::kSetGlobal:
    case Op::kSetLocal:
      return assign(variable(at, at.op == Op::kSetGlobal));
    case Op::kItem: {
      const Value index = top();
      drop(1);
      const Value list = top();
      top() = index;
      return load_item(list);
    }
    case Op::kGlobalItem:
    case Op::kLocalItem:
      return load_item(variable(at, at.op == Op::kGlobalItem));
    case Op::kSetGlobalItem:
    case Op::kSetLocalItem:
      return assign_item(variable(at, at.op == Op::kSetGlobalItem));
    case Op::kList:
    case Op::kPose:
      return make_list(static_cast<std::size_t>(at.a), at.op == Op::kPose);
    case Op::kNegate:
    case Op::kNot:
      return unary(at.op);
    case Op::kJump:
      next_ = static_cast<std::size_t>(at.a);
      return;
    case Op::kJumpIfFalse:
      return jump_if_false(at.a);
    case Op::kSetArgument:
      top(static_cast<std::size_t>(at.a) + 1) = top();
      return drop(1);
    case Op::kCall:
      return call(code_.functions[static_cast<std::size_t>(at.a)]);
    case Op::kBuiltin:
      return builtin(host, at.a);
    case Op::kReturn:
      return return_from_function();
    case Op::kPop:
      return drop(1);
    case Op::kHalt:
      outcome_ = Outcome::kEnded;
      return;
    default:
      return binary(at.op);
  }
}

void Machine::fail(const char* format, ...) noexcept {
  if (outcome_ != Outcome::kRunning) return;
  char text[161];
  va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(text, sizeof text, format, arguments);
  va_end(arguments);
  const Instruction& at = code_.instructions[next_ > 0 ? next_ - 1 : 0];
  error_ = {at.line, at.column, std::string_view(text)};
  outcome_ = Outcome::kFailed;
}

void Machine::push(const Value& value) noexcept {
  if (depth_ == kMaxStack) return fail("Runtime error: the program needs too much memory");
  stack_[depth_++] = value;
}

Value& Machine::variable(const Instruction& at, bool program) noexcept {
  const auto slot = static_cast<std::size_t>(at.a);
  return program ? variables_[slot] : stack_[frames_[calls_ - 1].base + slot];
}

void Machine::load(Value& from) noexcept {
  if (from.type == Type::kNone) return fail("Runtime error: a variable is used before it has a value");
  push(from);
}

// A variable keeps the type of its first value; int and float count as one type.
void Machine::assign(Value& to) noexcept {
  const Value& value = top();
  const bool same = value.type == to.type || (value.is_number() && to.is_number());
  if (value.type == Type::kNone) return fail("Type error: the function returns nothing to assign");
  if (to.type != Type::kNone && !same) {
    return fail("Type error: a variable that is a %s cannot become a %s", type_name(to.type), type_name(value.type));
  }
  to = value;
  drop(1);
}

bool Machine::index_of(const Value& list, const Value& index, std::size_t& at) noexcept {
  if (!list.has_items()) {
    fail("Type error: %s has no items", type_name(list.type));
  } else if (index.type != Type::kInt) {
    fail("Type error: an index must be int, not %s", type_name(index.type));
  } else if (index.number < 0.0 || index.number >= static_cast<double>(list.size)) {
    fail("Index out of range: %.0f of %d", index.number, int{list.size});
  } else {
    at = static_cast<std::size_t>(index.number);
    return true;
  }
  return false;
}

void Machine::load_item(const Value& list) noexcept {
  std::size_t at = 0;
  if (!index_of(list, top(), at)) return;
  top() = Value(Scalar{list.item_type, list.items[at]});
}

void Machine::assign_item(Value& list) noexcept {
  std::size_t at = 0;
  const Value& value = top();
  if (!index_of(list, top(1), at)) return;
  const bool fits = value.type == list.item_type || (value.type == Type::kInt && list.item_type == Type::kFloat);
  if (!fits) {
    return fail("Type error: a list of %s does not take %s", type_name(list.item_type), type_name(value.type));
  }
  list.items[at] = value.number;
  drop(2);
}

// Ints among floats become floats.
void Machine::make_list(std::size_t count, bool pose) noexcept {
  Value list;
  list.type = pose ? Type::kPose : Type::kList;
  list.item_type = pose ? Type::kFloat : Type::kNone;
  list.size = static_cast<std::uint8_t>(count);
  for (std::size_t i = 0; i < count; ++i) {
    const Value& item = top(count - 1 - i);
    const Type before = list.item_type;
    const bool numbers = item.is_number() && (before == Type::kInt || before == Type::kFloat);
    const bool fits =
        (item.is_number() || item.type == Type::kBool) && (before == Type::kNone || numbers || before == item.type);
    if (!fits) return fail("Type error: %s cannot be an item of this list", type_name(item.type));
    if (before == Type::kNone || item.type == Type::kFloat) list.item_type = item.type;
    list.items[i] = item.number;
  }
  drop(count);
  push(list);
}

void Machine::jump_if_false(std::int32_t target) noexcept {
  if (top().type != Type::kBool) return fail("Type error: a condition must be bool, not %s", type_name(top().type));
  if (top().number == 0.0) next_ = static_cast<std::size_t>(target);
  drop(1);
}

void Machine::call(const Function& function) noexcept {
  const auto parameters = static_cast<std::size_t>(function.parameters);
  const auto locals = static_cast<std::size_t>(function.locals);
  if (calls_ == kMaxCalls) return fail("Runtime error: functions call each other too deeply");
  for (std::size_t i = 0; i < parameters; ++i) {
    if (top(i).type == Type::kNone) return fail("Type error: an argument of '%s' is nothing", function.name.c_str());
  }
  frames_[calls_++] = {static_cast<std::int32_t>(next_), depth_ - parameters};
  for (std::size_t i = parameters; i < locals && outcome_ == Outcome::kRunning; ++i) push(Value());
  next_ = static_cast<std::size_t>(function.entry);
}

void Machine::return_from_function() noexcept {
  const Value result = top();
  const Frame& frame = frames_[--calls_];
  depth_ = frame.base;
  next_ = static_cast<std::size_t>(frame.return_to);
  push(result);
}

}  // namespace embody::sim::urscript
