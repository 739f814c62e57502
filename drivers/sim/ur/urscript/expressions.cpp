// Expressions, loosest binding first: or xor, and, not, comparison, + -, * / %, unary -, [index], then literals, names,
// calls and brackets.
#include "drivers/sim/ur/urscript/builtins.hpp"
#include "drivers/sim/ur/urscript/compiler_state.hpp"

namespace embody::sim::urscript {
namespace {

struct Operator {
  std::string_view word;
  Op op;
};
constexpr std::array kDisjunctions{Operator{"or", Op::kOr}, Operator{"xor", Op::kXor}};
constexpr std::array kConjunctions{Operator{"and", Op::kAnd}};
constexpr std::array kComparisons{Operator{"==", Op::kEqual},  Operator{"!=", Op::kNotEqual},
                                  Operator{"<", Op::kLess},    Operator{"<=", Op::kLessEqual},
                                  Operator{">", Op::kGreater}, Operator{">=", Op::kGreaterEqual}};
constexpr std::array kSums{Operator{"+", Op::kAdd}, Operator{"-", Op::kSubtract}};
constexpr std::array kProducts{Operator{"*", Op::kMultiply}, Operator{"/", Op::kDivide}, Operator{"%", Op::kModulo}};

template <std::size_t N>
const Operator* operator_at(const CompilerState& state, const std::array<Operator, N>& operators) noexcept {
  for (const Operator& candidate : operators) {
    if (state.at(candidate.word)) return &candidate;
  }
  return nullptr;
}

/// operand {operator operand}, from left to right.
template <std::size_t N>
void compile_chain(CompilerState& state, const std::array<Operator, N>& operators, void (*operand)(CompilerState&)) {
  operand(state);
  while (const Operator* const found = operator_at(state, operators)) {
    const Token where = state.token();
    state.advance();
    operand(state);
    state.emit(found->op, where);
  }
}

void compile_list(CompilerState& state, const Token& where, bool pose) {
  state.expect("[");
  std::int32_t count = 0;
  while (!state.at("]") && !state.at_end()) {
    if (count > 0) state.expect(",");
    compile_expression(state);
    if (++count > static_cast<std::int32_t>(Value::kMaxItems)) {
      state.fail(where, "compile_error_list_too_long", where.text);
    }
  }
  state.expect("]");
  if (pose && count != 6) state.fail(where, "compile_error_pose_needs_six_numbers", where.text);
  state.emit(pose ? Op::kPose : Op::kList, where, count);
}

void compile_variable(CompilerState& state, const Token& name) {
  const auto variable = state.find_variable(name.text);
  if (!variable) return state.name_not_found(name);
  const bool program = variable->where == CompilerState::Where::kProgram;
  if (state.accept("[")) {
    compile_expression(state);
    state.expect("]");
    state.emit(program ? Op::kGlobalItem : Op::kLocalItem, name, variable->slot);
  } else {
    state.emit(program ? Op::kGlobal : Op::kLocal, name, variable->slot);
  }
}

void compile_name(CompilerState& state) {
  const Token name = state.take_name();
  if (name.is("p") && state.at("[")) return compile_list(state, name, true);
  if (state.at("(")) return compile_call(state, name);
  compile_variable(state, name);
}

void compile_primary(CompilerState& state) {
  const Token token = state.token();
  if (token.kind == TokenKind::kInt || token.kind == TokenKind::kFloat) {
    state.advance();
    state.emit_constant(token, {token.kind == TokenKind::kInt ? Type::kInt : Type::kFloat, token.number});
  } else if (token.kind == TokenKind::kString) {
    state.advance();
    state.emit_string(token, token.text);
  } else if (token.is("True") || token.is("False")) {
    state.advance();
    state.emit_constant(token, {Type::kBool, token.is("True") ? 1.0 : 0.0});
  } else if (state.accept("(")) {
    compile_expression(state);
    state.expect(")");
  } else if (token.is("[")) {
    compile_list(state, token, false);
  } else {
    compile_name(state);
  }
}

void compile_postfix(CompilerState& state) {
  compile_primary(state);
  while (state.at("[")) {
    const Token where = state.token();
    state.advance();
    compile_expression(state);
    state.expect("]");
    state.emit(Op::kItem, where);
  }
}

/// A prefix operator: any number of them, each a level of nesting.
void compile_prefix(CompilerState& state, std::string_view word, Op op, void (*operand)(CompilerState&)) {
  if (!state.at(word)) return operand(state);
  const Token where = state.token();
  state.advance();
  if (state.enter()) compile_prefix(state, word, op, operand);
  state.leave();
  state.emit(op, where);
}

void compile_unary(CompilerState& state) {
  compile_prefix(state, "-", Op::kNegate, compile_postfix);
}

void compile_product(CompilerState& state) {
  compile_chain(state, kProducts, compile_unary);
}

void compile_sum(CompilerState& state) {
  compile_chain(state, kSums, compile_product);
}

void compile_comparison(CompilerState& state) {
  compile_sum(state);
  const Operator* const found = operator_at(state, kComparisons);  // only one: a < b < c is an error
  if (found == nullptr) return;
  const Token where = state.token();
  state.advance();
  compile_sum(state);
  state.emit(found->op, where);
}

void compile_negation(CompilerState& state) {
  compile_prefix(state, "not", Op::kNot, compile_comparison);
}

void compile_conjunction(CompilerState& state) {
  compile_chain(state, kConjunctions, compile_negation);
}

void emit_fallback(CompilerState& state, const Token& where, const Parameter& parameter) {
  if (parameter.fallback.type == Type::kString) return state.emit_string(where, parameter.text);
  state.emit_constant(where, parameter.fallback);
}

/// Arguments by position first, then by name in any order: those take the places of defaults that are already stacked.
void compile_builtin_arguments(CompilerState& state, const Token& name, const BuiltinInfo& info) {
  const std::size_t count = info.count();
  const auto wrong_count = [&] { state.fail(name, "compile_error_wrong_number_of_arguments", name.text); };
  std::array<bool, 6> given{};
  std::size_t stacked = 0;
  bool named = false;
  for (bool first = true; !state.at(")") && !state.at_end(); first = false) {
    if (!first) state.expect(",");
    Lexer ahead = state.lexer();
    const Token word = state.token();
    if (word.kind == TokenKind::kName && ahead.next().is("=")) {
      for (; stacked < count; ++stacked) emit_fallback(state, name, info.parameters[stacked]);
      named = true;
      state.advance();
      state.advance();
      std::size_t place = 0;
      while (place < count && info.parameters[place].name != word.text) ++place;
      if (place == count) return state.name_not_found(word);
      if (given[place]) return state.syntax_error(word);
      given[place] = true;
      compile_expression(state);
      state.emit(Op::kSetArgument, word, static_cast<std::int32_t>(count - 1 - place));
    } else {
      if (named) return state.syntax_error(word);
      if (stacked == count) return wrong_count();
      given[stacked++] = true;
      compile_expression(state);
    }
  }
  for (; stacked < count; ++stacked) emit_fallback(state, name, info.parameters[stacked]);
  for (std::size_t i = 0; i < count; ++i) {
    if (!given[i] && info.parameters[i].fallback.type == Type::kNone) return wrong_count();
  }
}

void compile_function_arguments(CompilerState& state, const Token& name, std::int32_t expected) {
  std::int32_t count = 0;
  while (!state.at(")") && !state.at_end()) {
    if (count > 0) state.expect(",");
    compile_expression(state);
    ++count;
  }
  if (count != expected) state.fail(name, "compile_error_wrong_number_of_arguments", name.text);
}

}  // namespace

void compile_expression(CompilerState& state) {
  if (state.enter()) compile_chain(state, kDisjunctions, compile_conjunction);
  state.leave();
}

void compile_call(CompilerState& state, const Token& name) {
  const auto function = state.find_function(name.text);
  const BuiltinInfo* const builtin = find_builtin(name.text);
  if (!function && builtin == nullptr) return state.name_not_found(name);
  state.expect("(");
  if (function) {
    compile_function_arguments(state, name, state.code().functions[static_cast<std::size_t>(*function)].parameters);
  } else {
    compile_builtin_arguments(state, name, *builtin);
  }
  state.expect(")");
  state.emit(function ? Op::kCall : Op::kBuiltin, name, function ? *function : static_cast<std::int32_t>(builtin->id));
}

}  // namespace embody::sim::urscript
