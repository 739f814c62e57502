#include "drivers/sim/ur/urscript/compiler_state.hpp"

#include <algorithm>
#include <array>
#include <cstdio>

#include "drivers/sim/ur/urscript/builtins.hpp"

namespace embody::sim::urscript {
namespace {

bool is_keyword(std::string_view name) noexcept {
  constexpr std::array<std::string_view, 27> kKeywords{
      "def",    "sec",   "end",    "while", "if",     "elif", "else",   "break", "continue",
      "return", "halt",  "pass",   "local", "global", "and",  "or",     "not",   "xor",
      "True",   "False", "thread", "run",   "join",   "kill", "switch", "case",  "struct"};
  return std::find(kKeywords.begin(), kKeywords.end(), name) != kKeywords.end();
}

std::optional<std::int32_t> index_of(const std::vector<std::string>& names, std::string_view name) noexcept {
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end()) return std::nullopt;
  return static_cast<std::int32_t>(found - names.begin());
}

}  // namespace

void CompilerState::advance() noexcept {
  if (error_) return;
  token_ = lexer_.next();
  if (token_.kind == TokenKind::kBad) syntax_error(token_);
}

bool CompilerState::accept(std::string_view word) noexcept {
  if (!at(word)) return false;
  advance();
  return true;
}

void CompilerState::expect(std::string_view word) noexcept {
  if (!accept(word)) syntax_error(token_);
}

void CompilerState::skip_newlines() noexcept {
  while (token_.kind == TokenKind::kNewline) advance();
}

Token CompilerState::take_name() noexcept {
  const Token name = token_;
  if (name.kind != TokenKind::kName || is_keyword(name.text)) {
    syntax_error(name);
  } else {
    advance();
  }
  return name;
}

void CompilerState::syntax_error(const Token& where) noexcept {
  char kind[48];
  std::snprintf(kind, sizeof kind, "syntax_error_on_line:%d", where.line);
  fail(where, kind, lexer_.line_text(where.line));
}

void CompilerState::name_not_found(const Token& name) noexcept {
  fail(name, "compile_error_name_not_found", name.text);
}

void CompilerState::fail(const Token& where, const char* kind, std::string_view detail) noexcept {
  constexpr std::size_t kMaxDetail = 100;
  if (error_) return;
  char text[161];
  std::snprintf(text, sizeof text, "%s:%.*s:", kind, static_cast<int>(std::min(detail.size(), kMaxDetail)),
                detail.data());
  for (char* c = text; *c != '\0'; ++c) *c = (*c < ' ' || *c > '~') ? '?' : *c;
  error_ = ScriptError{where.line, where.column, text};
  token_ = Token{TokenKind::kEnd, {}, where.line, where.column};
}

bool CompilerState::enter() noexcept {
  if (++nesting_ > kMaxNesting) fail(token_, "compile_error_nested_too_deep", token_.text);
  return !error_;
}

std::size_t CompilerState::emit(Op op, const Token& where, std::int32_t a) {
  if (code_.instructions.size() >= kMaxInstructions) {
    fail(where, "compile_error_program_too_large", where.text);
    return 0;
  }
  code_.instructions.push_back({op, a, where.line, where.column});
  return code_.instructions.size() - 1;
}

void CompilerState::emit_constant(const Token& where, Scalar scalar) {
  emit(Op::kConstant, where, static_cast<std::int32_t>(code_.constants.size()));
  if (!error_) code_.constants.push_back(scalar);
}

void CompilerState::emit_string(const Token& where, std::string_view text) {
  emit_constant(where, {Type::kString, static_cast<double>(code_.strings.size())});
  if (!error_) code_.strings.emplace_back(text);
}

void CompilerState::patch(std::size_t at) noexcept {
  if (at < code_.instructions.size()) code_.instructions[at].a = here();
}

std::optional<CompilerState::Variable> CompilerState::find_variable(std::string_view name) const noexcept {
  if (in_function_) {
    if (const auto slot = index_of(function_names_, name)) return Variable{Where::kFunction, *slot};
  }
  if (const auto slot = index_of(code_.variables, name)) return Variable{Where::kProgram, *slot};
  return std::nullopt;
}

CompilerState::Variable CompilerState::assigned_variable(const Token& name, Declaration declaration) {
  if (find_builtin(name.text) != nullptr || find_function(name.text)) syntax_error(name);
  const bool in_program = !in_function_ || declaration == Declaration::kGlobal;
  if (const auto known = find_variable(name.text)) {
    const bool other_scope = in_function_ && declaration != Declaration::kNone &&
                             (known->where == Where::kProgram) != (declaration == Declaration::kGlobal);
    if (!other_scope) return *known;
  }
  std::vector<std::string>& names = in_program ? code_.variables : function_names_;
  if (const auto slot = index_of(names, name.text)) return {in_program ? Where::kProgram : Where::kFunction, *slot};
  if (names.size() >= kMaxVariables) fail(name, "compile_error_too_many_variables", name.text);
  names.emplace_back(name.text);
  return {in_program ? Where::kProgram : Where::kFunction, static_cast<std::int32_t>(names.size() - 1)};
}

std::optional<std::int32_t> CompilerState::find_function(std::string_view name) const noexcept {
  const auto& functions = code_.functions;
  const auto found =
      std::find_if(functions.begin(), functions.end(), [&](const Function& f) { return f.name == name; });
  if (found == functions.end()) return std::nullopt;
  return static_cast<std::int32_t>(found - functions.begin());
}

void CompilerState::begin_function() noexcept {
  in_function_ = true;
  function_names_.clear();
}

}  // namespace embody::sim::urscript
