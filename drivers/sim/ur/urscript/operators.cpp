// Operators of the machine. Ints have 32 bits; dividing ints gives a float.
#include <algorithm>
#include <cmath>
#include <limits>

#include "drivers/sim/ur/urscript/machine.hpp"

namespace embody::sim::urscript {

void Machine::set_integer(Value& value, double result) noexcept {
  using Limits = std::numeric_limits<std::int32_t>;
  if (!(result >= Limits::min() && result <= Limits::max())) return fail("Runtime error: int out of range");
  value = Value::integer(static_cast<std::int32_t>(result));
}

void Machine::unary(Op op) noexcept {
  Value& value = top();
  if (op == Op::kNot) {
    if (value.type != Type::kBool) return fail("Type error: 'not' needs bool, not %s", type_name(value.type));
    value.number = 1.0 - value.number;
  } else if (value.type == Type::kInt) {
    set_integer(value, 0.0 - value.number);
  } else if (value.type == Type::kFloat) {
    value.number = -value.number;
  } else {
    fail("Type error: '-' needs a number, not %s", type_name(value.type));
  }
}

void Machine::binary(Op op) noexcept {
  const Value& right = top();
  Value& left = top(1);
  if (op == Op::kAnd || op == Op::kOr || op == Op::kXor) {
    logic(op, left, right);
  } else if (op >= Op::kEqual && op <= Op::kGreaterEqual) {
    compare(op, left, right);
  } else {
    arithmetic(op, left, right);
  }
  drop(1);
}

void Machine::arithmetic(Op op, Value& left, const Value& right) noexcept {
  if (!left.is_number() || !right.is_number()) {
    return fail("Type error: no arithmetic with %s and %s", type_name(left.type), type_name(right.type));
  }
  const double a = left.number;
  const double b = right.number;
  if ((op == Op::kDivide || op == Op::kModulo) && b == 0.0) return fail("Runtime error: division by zero");
  double result = 0.0;
  if (op == Op::kAdd) result = a + b;
  if (op == Op::kSubtract) result = a - b;
  if (op == Op::kMultiply) result = a * b;
  if (op == Op::kDivide) result = a / b;
  if (op == Op::kModulo) result = std::fmod(a, b);
  if (op != Op::kDivide && left.type == Type::kInt && right.type == Type::kInt) return set_integer(left, result);
  left = Value::real(result);
}

void Machine::compare(Op op, Value& left, const Value& right) noexcept {
  const bool numbers = left.is_number() && right.is_number();
  const bool equality = op == Op::kEqual || op == Op::kNotEqual;
  if (!numbers && !(equality && left.type == right.type && left.type != Type::kNone)) {
    return fail("Type error: %s and %s cannot be compared", type_name(left.type), type_name(right.type));
  }
  const double a = left.number;
  const double b = right.number;
  bool equal = a == b;
  if (left.type == Type::kString) equal = text(left) == text(right);
  if (left.has_items()) {
    equal = std::equal(left.items.begin(), left.items.begin() + left.size, right.items.begin(),
                       right.items.begin() + right.size);
  }
  bool result = equal;
  if (op == Op::kNotEqual) result = !equal;
  if (op == Op::kLess) result = a < b;
  if (op == Op::kLessEqual) result = a <= b;
  if (op == Op::kGreater) result = a > b;
  if (op == Op::kGreaterEqual) result = a >= b;
  left = Value::boolean(result);
}

// Both sides have been evaluated: a script that relies on anything else does not pass here.
void Machine::logic(Op op, Value& left, const Value& right) noexcept {
  if (left.type != Type::kBool || right.type != Type::kBool) {
    return fail("Type error: 'and', 'or', 'xor' need bool, not %s and %s", type_name(left.type), type_name(right.type));
  }
  const bool a = left.number != 0.0;
  const bool b = right.number != 0.0;
  left = Value::boolean(op == Op::kAnd ? (a && b) : op == Op::kOr ? (a || b) : a != b);
}

}  // namespace embody::sim::urscript
