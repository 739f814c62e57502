// The controller's own functions, as the machine runs them.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "drivers/sim/ur/urscript/builtins.hpp"
#include "drivers/sim/ur/urscript/machine.hpp"

namespace embody::sim::urscript {
namespace {

Value list_of(const Vector6& joints) noexcept {
  Value list;
  list.type = Type::kList;
  list.item_type = Type::kFloat;
  list.size = 6;
  std::copy_n(joints.data(), 6, list.items.begin());
  return list;
}

double norm_of(const Value& value) noexcept {
  if (!value.has_items()) return std::abs(value.number);
  double sum = 0.0;
  for (std::size_t i = 0; i < value.size; ++i) sum += value.items[i] * value.items[i];
  return std::sqrt(sum);
}

/// Sized for a message; longer text is cut.
void append(char* text, std::size_t capacity, const char* format, auto... arguments) noexcept {
  const std::size_t used = std::char_traits<char>::length(text);
  std::snprintf(text + used, capacity - used, format, arguments...);
}

void append_number(char* text, std::size_t capacity, Type type, double number) noexcept {
  if (type == Type::kBool) return append(text, capacity, "%s", number != 0.0 ? "True" : "False");
  append(text, capacity, type == Type::kInt ? "%.0f" : "%g", number);
}

}  // namespace

// A call takes its arguments from the stack and leaves one value, "nothing" where the function has no result.
void Machine::builtin(ScriptHost& host, std::int32_t id) noexcept {
  const std::size_t count = builtin_info(static_cast<Builtin>(id)).count();
  const Value* const arguments = stack_.get() + (depth_ - count);
  Value result;
  switch (static_cast<Builtin>(id)) {
    case Builtin::kServoj:
      servoj(host, arguments);
      break;
    case Builtin::kStopj:
      stopj(host, arguments[0]);
      break;
    case Builtin::kSync:
      wait_ = Wait::kTime;
      wait_s_ = host.step_time_s();
      break;
    case Builtin::kSleep:
      sleep(arguments[0]);
      break;
    case Builtin::kSetWatchdog:
      watchdog(host, arguments);
      break;
    case Builtin::kTextmsg:
      say(host, MessageKind::kText, arguments[0], arguments[1]);
      break;
    case Builtin::kPopup:
      say(host, MessageKind::kPopup, arguments[0], arguments[1]);
      break;
    case Builtin::kReadInputBoolean:
    case Builtin::kReadInputFloat:
    case Builtin::kReadInputInteger:
    case Builtin::kWriteOutputBoolean:
    case Builtin::kWriteOutputFloat:
    case Builtin::kWriteOutputInteger:
      result = registers(host, id, arguments);
      break;
    case Builtin::kGetActualJointPositions:
    case Builtin::kGetActualJointSpeeds:
    case Builtin::kGetSteptime:
    case Builtin::kGetTargetJointPositions:
    case Builtin::kGetTargetJointSpeeds:
    case Builtin::kIsWithinSafetyLimits:
      result = ask(host, id, arguments);
      break;
    default:
      result = calculate(id, arguments);
  }
  drop(count);
  push(result);
}

Value Machine::calculate(std::int32_t id, const Value* arguments) noexcept {
  constexpr double kDegree = std::numbers::pi / 180.0;
  const auto which = static_cast<Builtin>(id);
  const Value& first = arguments[0];
  if (which == Builtin::kLength || (which == Builtin::kNorm && first.has_items())) {
    if (!first.has_items()) fail("Type error: length needs a list, not %s", type_name(first.type));
    return which == Builtin::kLength ? Value::integer(first.size) : Value::real(norm_of(first));
  }
  const double a = number(first);
  const bool two = which == Builtin::kAtan2 || which == Builtin::kPow || which == Builtin::kLog;
  const double b = two ? number(arguments[1]) : 0.0;
  Value whole;
  switch (which) {
    case Builtin::kAcos:
      return Value::real(std::acos(a));
    case Builtin::kAsin:
      return Value::real(std::asin(a));
    case Builtin::kAtan:
      return Value::real(std::atan(a));
    case Builtin::kAtan2:
      return Value::real(std::atan2(a, b));
    case Builtin::kCos:
      return Value::real(std::cos(a));
    case Builtin::kSin:
      return Value::real(std::sin(a));
    case Builtin::kTan:
      return Value::real(std::tan(a));
    case Builtin::kDegreesToRadians:
      return Value::real(a * kDegree);
    case Builtin::kRadiansToDegrees:
      return Value::real(a / kDegree);
    case Builtin::kPow:
      return Value::real(std::pow(a, b));
    case Builtin::kLog:
      return Value::real(std::log(b) / std::log(a));
    case Builtin::kSqrt:
      if (a < 0.0) fail("Runtime error: sqrt of %g", a);
      return Value::real(std::sqrt(a));
    case Builtin::kFloor:
    case Builtin::kCeil:
      set_integer(whole, which == Builtin::kFloor ? std::floor(a) : std::ceil(a));
      return whole;
    default:  // kNorm of a number
      return Value(Scalar{first.type, std::abs(a)});
  }
}

Value Machine::registers(ScriptHost& host, std::int32_t id, const Value* arguments) noexcept {
  const int at = address(arguments[0]);
  Value result;
  if (outcome_ != Outcome::kRunning) return result;
  const auto which = static_cast<Builtin>(id);
  if (which == Builtin::kReadInputInteger) return Value::integer(host.input_int(at));
  if (which == Builtin::kReadInputFloat) return Value::real(host.input_double(at));
  if (which == Builtin::kReadInputBoolean) return Value::boolean(host.input_bool(at));
  const Value& value = arguments[1];
  if (which == Builtin::kWriteOutputFloat) {
    const double written = number(value);
    if (outcome_ == Outcome::kRunning) host.set_output_double(at, written);
  } else if (which == Builtin::kWriteOutputInteger && value.type == Type::kInt) {
    host.set_output_int(at, static_cast<std::int32_t>(value.number));
  } else if (which == Builtin::kWriteOutputBoolean && value.type == Type::kBool) {
    host.set_output_bool(at, value.number != 0.0);
  } else {
    fail("Type error: %s does not go into this register", type_name(value.type));
  }
  return result;
}

Value Machine::ask(ScriptHost& host, std::int32_t id, const Value* arguments) noexcept {
  switch (static_cast<Builtin>(id)) {
    case Builtin::kGetSteptime:
      return Value::real(host.step_time_s());
    case Builtin::kGetActualJointSpeeds:
      return list_of(host.joints(JointQuantity::kActualSpeed));
    case Builtin::kGetTargetJointPositions:
      return list_of(host.joints(JointQuantity::kTargetPosition));
    case Builtin::kGetTargetJointSpeeds:
      return list_of(host.joints(JointQuantity::kTargetSpeed));
    case Builtin::kIsWithinSafetyLimits:
      return Value::boolean(host.within_limits(six(arguments[0])));
    default:
      return list_of(host.joints(JointQuantity::kActualPosition));
  }
}

void Machine::servoj(ScriptHost& host, const Value* arguments) noexcept {
  const ServoCommand command{six(arguments[0]), number(arguments[3]), number(arguments[4]), number(arguments[5])};
  (void)number(arguments[1]);  // acceleration and speed have no effect, but must be numbers
  (void)number(arguments[2]);
  if (!may_move()) return;
  if (!command.q_rad.allFinite()) return fail("C204A5: servoj got a joint position that is not finite");
  if (!(command.time_s > 0.0 && command.time_s <= 60.0))
    return fail("servoj: t = %g s is not possible", command.time_s);
  if (!(command.lookahead_s >= 0.03 && command.lookahead_s <= 0.2)) {
    return fail("servoj: lookahead_time = %g is not within 0.03 to 0.2", command.lookahead_s);
  }
  if (!(command.gain >= 100.0 && command.gain <= 2000.0)) {
    return fail("servoj: gain = %g is not within 100 to 2000", command.gain);
  }
  host.servoj(command);
  wait_ = Wait::kServo;
  wait_s_ = command.time_s;
}

void Machine::stopj(ScriptHost& host, const Value& deceleration) noexcept {
  const double a = number(deceleration);
  if (!may_move()) return;
  if (!(a > 0.0 && a < 1e3)) return fail("stopj: a = %g rad/s^2 is not possible", a);
  host.stopj(a);
  wait_ = Wait::kStop;
  wait_s_ = host.step_time_s();
}

void Machine::sleep(const Value& seconds) noexcept {
  wait_s_ = number(seconds);
  if (!(wait_s_ >= 0.0 && wait_s_ < 1e9)) return fail("sleep: %g s is not possible", wait_s_);
  wait_ = Wait::kTime;
}

void Machine::watchdog(ScriptHost& host, const Value* arguments) noexcept {
  const std::string_view name = text(arguments[0]);
  const double frequency_hz = number(arguments[1]);
  const std::string_view action = text(arguments[2]);
  if (outcome_ != Outcome::kRunning) return;
  if (!(frequency_hz > 0.0 && frequency_hz <= 500.0)) {
    return fail("rtde_set_watchdog: %g Hz is not possible", frequency_hz);
  }
  if (action != "pause" && action != "stop" && action != "ignore") {
    return fail("rtde_set_watchdog: there is no action '%.*s'", static_cast<int>(action.size()), action.data());
  }
  if (action == "ignore") return;
  if (!host.set_watchdog(name, frequency_hz, action == "stop")) {
    fail("rtde_set_watchdog: there is no input '%.*s'", static_cast<int>(name.size()), name.data());
  }
}

void Machine::say(ScriptHost& host, MessageKind kind, const Value& first, const Value& second) noexcept {
  char line[161] = "";
  for (const Value* value : {&first, &second}) {
    if (kind == MessageKind::kPopup && value == &second) break;  // its title
    if (value->type == Type::kString) {
      const std::string_view words = text(*value);
      append(line, sizeof line, "%.*s", static_cast<int>(words.size()), words.data());
    } else if (!value->has_items()) {
      append_number(line, sizeof line, value->type, value->number);
    } else {
      append(line, sizeof line, "%s", value->type == Type::kPose ? "p[" : "[");
      for (std::size_t i = 0; i < value->size; ++i) {
        if (i > 0) append(line, sizeof line, "%s", ", ");
        append_number(line, sizeof line, value->item_type, value->items[i]);
      }
      append(line, sizeof line, "%s", "]");
    }
  }
  host.message(kind, line);
}

double Machine::number(const Value& value) noexcept {
  if (!value.is_number()) fail("Type error: a number is needed, not %s", type_name(value.type));
  return value.number;
}

int Machine::address(const Value& value) noexcept {
  const bool valid = value.type == Type::kInt && value.number >= 0.0 && value.number < kRegisters;
  if (!valid) fail("Runtime error: there is no such register (0 to %d)", kRegisters - 1);
  return valid ? static_cast<int>(value.number) : 0;
}

Vector6 Machine::six(const Value& value) noexcept {
  Vector6 joints = Vector6::Zero();
  const bool fits = value.type == Type::kList && value.size == 6 && value.item_type != Type::kBool;
  if (!fits) {
    fail("Type error: six joint positions are needed, not %s", type_name(value.type));
  } else {
    std::copy_n(value.items.begin(), 6, joints.data());
  }
  return joints;
}

std::string_view Machine::text(const Value& value) noexcept {
  if (value.type != Type::kString) {
    fail("Type error: a string is needed, not %s", type_name(value.type));
    return {};
  }
  const auto index = static_cast<std::size_t>(value.number);
  return code_.strings[index];
}

bool Machine::may_move() noexcept {
  if (code_.secondary) fail("C271: a secondary program must not move the robot");
  return outcome_ == Outcome::kRunning;
}

}  // namespace embody::sim::urscript
