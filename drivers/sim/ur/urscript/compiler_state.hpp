#pragma once
// What the parts of the compiler share: the current token, the first error, the code so far, and the names in sight.
#include <optional>
#include <string_view>
#include <vector>

#include "drivers/sim/ur/urscript/compiler.hpp"
#include "drivers/sim/ur/urscript/lexer.hpp"

namespace embody::sim::urscript {

/// After the first error the current token is kEnd for ever, so that every loop over tokens ends.
class CompilerState {
 public:
  explicit CompilerState(std::string_view text) noexcept : lexer_(text) { advance(); }

  // --- tokens
  [[nodiscard]] const Token& token() const noexcept { return token_; }
  [[nodiscard]] bool at(std::string_view word) const noexcept { return token_.is(word); }
  [[nodiscard]] bool at_end() const noexcept { return token_.kind == TokenKind::kEnd; }
  void advance() noexcept;
  /// A copy, to look ahead of the current token.
  [[nodiscard]] Lexer lexer() const noexcept { return lexer_; }
  bool accept(std::string_view word) noexcept;
  void expect(std::string_view word) noexcept;
  void skip_newlines() noexcept;
  /// A name that is no keyword; an error otherwise.
  [[nodiscard]] Token take_name() noexcept;

  // --- errors
  [[nodiscard]] const std::optional<ScriptError>& error() const noexcept { return error_; }
  void syntax_error(const Token& where) noexcept;
  void name_not_found(const Token& name) noexcept;
  void fail(const Token& where, const char* kind, std::string_view detail) noexcept;
  /// Counts the depth of blocks and brackets; false, with an error, when it is too deep.
  bool enter() noexcept;
  void leave() noexcept { --nesting_; }

  // --- code
  std::size_t emit(Op op, const Token& where, std::int32_t a = 0);
  void emit_constant(const Token& where, Scalar scalar);
  void emit_string(const Token& where, std::string_view text);
  [[nodiscard]] std::int32_t here() const noexcept { return static_cast<std::int32_t>(code_.instructions.size()); }
  /// Lets the jump at `at` go to here().
  void patch(std::size_t at) noexcept;
  [[nodiscard]] Code& code() noexcept { return code_; }

  // --- names
  enum class Where : std::uint8_t { kProgram, kFunction };
  struct Variable {
    Where where;
    std::int32_t slot;
  };
  enum class Declaration : std::uint8_t { kNone, kLocal, kGlobal };
  /// The variable of this name that is in sight here, if a line above assigns it.
  [[nodiscard]] std::optional<Variable> find_variable(std::string_view name) const noexcept;
  /// The variable that an assignment means; a new one if there is none yet.
  [[nodiscard]] Variable assigned_variable(const Token& name, Declaration declaration);
  [[nodiscard]] std::optional<std::int32_t> find_function(std::string_view name) const noexcept;
  void begin_function() noexcept;
  void end_function() noexcept { in_function_ = false; }
  [[nodiscard]] bool in_function() const noexcept { return in_function_; }
  [[nodiscard]] std::size_t function_variables() const noexcept { return function_names_.size(); }

 private:
  Lexer lexer_;
  Token token_;
  std::optional<ScriptError> error_;
  int nesting_{0};
  Code code_;
  bool in_function_{false};
  std::vector<std::string> function_names_;
};

/// Code for the expression that begins at the current token. Leaves one value.
void compile_expression(CompilerState& state);
/// Code for a call; the current token is the opening bracket behind `name`. Leaves one value.
void compile_call(CompilerState& state, const Token& name);

}  // namespace embody::sim::urscript
