// Programs, functions and statements.
#include "drivers/sim/ur/urscript/compiler.hpp"

#include <utility>

#include "drivers/sim/ur/urscript/builtins.hpp"
#include "drivers/sim/ur/urscript/compiler_state.hpp"

namespace embody::sim::urscript {
namespace {

using Where = CompilerState::Where;
using Declaration = CompilerState::Declaration;

/// A loop in the making: where `continue` goes and which jumps `break` has left to patch.
struct Loop {
  std::int32_t start{0};
  std::vector<std::size_t> breaks;
};

class Statements {
 public:
  explicit Statements(CompilerState& state) noexcept : state_(state) {}
  void program();

 private:
  void block();
  void statement();
  void compound(const Token& word);
  void simple();
  void if_statement();
  void while_statement();
  void function();
  void parameters(Function& function);
  void leave_loop(const Token& word);
  void return_statement(const Token& word);
  void assignment_or_call(Declaration declaration);
  void assign(const Token& name, Declaration declaration);
  void assign_item(const Token& name);
  void end_of_line();
  [[nodiscard]] bool at_block_end() const noexcept {
    return state_.at("end") || state_.at("elif") || state_.at("else") || state_.at_end();
  }

  CompilerState& state_;
  std::vector<Loop> loops_;
};

void Statements::program() {
  state_.skip_newlines();
  const Token word = state_.token();
  if (word.is("def") || word.is("sec")) {
    state_.advance();
    state_.code().name = state_.take_name().text;
    state_.code().secondary = word.is("sec");
    state_.expect("(");
    state_.expect(")");
    state_.expect(":");
    block();
    state_.expect("end");
  } else {
    state_.code().name = "unnamed";
    simple();
  }
  state_.emit(Op::kHalt, state_.token());
  state_.skip_newlines();
  if (!state_.at_end()) state_.syntax_error(state_.token());
}

void Statements::block() {
  if (state_.enter()) {
    if (state_.token().kind != TokenKind::kNewline) state_.syntax_error(state_.token());
    state_.skip_newlines();
    while (!at_block_end()) {
      statement();
      state_.skip_newlines();
    }
  }
  state_.leave();
}

void Statements::statement() {
  const Token word = state_.token();
  if (word.is("if") || word.is("while") || word.is("def")) {
    compound(word);
  } else {
    simple();
  }
  end_of_line();
}

void Statements::compound(const Token& word) {
  state_.advance();
  if (word.is("if")) return if_statement();
  if (word.is("while")) return while_statement();
  if (state_.in_function()) return state_.fail(word, "compile_error_function_inside_function", word.text);
  function();
}

void Statements::simple() {
  const Token word = state_.token();
  if (state_.accept("pass")) return;
  if (state_.accept("halt")) {
    state_.emit(Op::kHalt, word);
  } else if (state_.accept("return")) {
    return_statement(word);
  } else if (state_.accept("break") || state_.accept("continue")) {
    leave_loop(word);
  } else if (state_.accept("local")) {
    assignment_or_call(Declaration::kLocal);
  } else if (state_.accept("global")) {
    assignment_or_call(Declaration::kGlobal);
  } else {
    assignment_or_call(Declaration::kNone);
  }
}

void Statements::if_statement() {
  std::vector<std::size_t> ends;
  bool more = true;
  while (more) {
    const Token where = state_.token();
    compile_expression(state_);
    state_.expect(":");
    const std::size_t skip = state_.emit(Op::kJumpIfFalse, where);
    block();
    ends.push_back(state_.emit(Op::kJump, where));
    state_.patch(skip);
    more = state_.accept("elif");
  }
  if (state_.accept("else")) {
    state_.expect(":");
    block();
  }
  state_.expect("end");
  for (const std::size_t jump : ends) state_.patch(jump);
}

void Statements::while_statement() {
  loops_.push_back({state_.here(), {}});
  const Token where = state_.token();
  compile_expression(state_);
  state_.expect(":");
  const std::size_t leave = state_.emit(Op::kJumpIfFalse, where);
  block();
  state_.expect("end");
  state_.emit(Op::kJump, where, loops_.back().start);
  state_.patch(leave);
  for (const std::size_t jump : loops_.back().breaks) state_.patch(jump);
  loops_.pop_back();
}

void Statements::function() {
  const Token name = state_.take_name();
  auto& functions = state_.code().functions;
  if (find_builtin(name.text) != nullptr || state_.find_function(name.text) || state_.find_variable(name.text)) {
    return state_.syntax_error(name);
  }
  if (functions.size() >= kMaxFunctions) return state_.fail(name, "compile_error_too_many_functions", name.text);
  const std::size_t around = state_.emit(Op::kJump, name);
  std::vector<Loop> outer_loops = std::exchange(loops_, {});
  state_.begin_function();
  Function function{std::string(name.text), state_.here(), 0, 0};
  parameters(function);
  const std::size_t index = functions.size();
  functions.push_back(std::move(function));
  block();
  const Token end = state_.token();
  state_.expect("end");
  state_.emit_constant(end, {});
  state_.emit(Op::kReturn, end);
  functions[index].locals = static_cast<std::int32_t>(state_.function_variables());
  state_.end_function();
  loops_ = std::move(outer_loops);
  state_.patch(around);
}

void Statements::parameters(Function& function) {
  state_.expect("(");
  while (!state_.at(")") && !state_.at_end()) {
    if (function.parameters > 0) state_.expect(",");
    const Token name = state_.take_name();
    const auto before = state_.function_variables();
    (void)state_.assigned_variable(name, Declaration::kLocal);
    if (state_.function_variables() == before) state_.syntax_error(name);  // twice the same name
    ++function.parameters;
  }
  state_.expect(")");
  state_.expect(":");
}

void Statements::leave_loop(const Token& word) {
  if (loops_.empty()) return state_.syntax_error(word);
  const std::size_t jump = state_.emit(Op::kJump, word, loops_.back().start);
  if (word.is("break")) loops_.back().breaks.push_back(jump);
}

void Statements::return_statement(const Token& word) {
  if (state_.token().kind == TokenKind::kNewline || state_.at_end()) {
    state_.emit_constant(word, {});
  } else {
    compile_expression(state_);
  }
  state_.emit(state_.in_function() ? Op::kReturn : Op::kHalt, word);
}

void Statements::assignment_or_call(Declaration declaration) {
  const Token name = state_.take_name();
  if (state_.at("=")) return assign(name, declaration);
  if (declaration != Declaration::kNone) return state_.syntax_error(state_.token());
  if (state_.at("[")) return assign_item(name);
  if (!state_.at("(")) return state_.syntax_error(state_.token());
  compile_call(state_, name);
  state_.emit(Op::kPop, name);
}

void Statements::assign(const Token& name, Declaration declaration) {
  state_.advance();
  compile_expression(state_);
  const auto variable = state_.assigned_variable(name, declaration);
  state_.emit(variable.where == Where::kProgram ? Op::kSetGlobal : Op::kSetLocal, name, variable.slot);
}

void Statements::assign_item(const Token& name) {
  const auto variable = state_.find_variable(name.text);
  if (!variable) return state_.name_not_found(name);
  state_.advance();
  compile_expression(state_);
  state_.expect("]");
  state_.expect("=");
  compile_expression(state_);
  state_.emit(variable->where == Where::kProgram ? Op::kSetGlobalItem : Op::kSetLocalItem, name, variable->slot);
}

void Statements::end_of_line() {
  if (state_.token().kind != TokenKind::kNewline && !state_.at_end()) state_.syntax_error(state_.token());
}

}  // namespace

std::variant<Code, ScriptError> compile(std::string_view text) {
  if (text.size() > kMaxText) return ScriptError{1, 1, "compile_error_program_too_large:"};
  CompilerState state(text);
  Statements(state).program();
  if (state.error()) return *state.error();
  return std::move(state.code());
}

}  // namespace embody::sim::urscript
