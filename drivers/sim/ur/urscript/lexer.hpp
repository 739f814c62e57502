#pragma once
// Script text to tokens, one at a time. Pure; allocates nothing, tokens point into the text.
#include <cstdint>
#include <string_view>

namespace embody::sim::urscript {

enum class TokenKind : std::uint8_t {
  kEnd,      ///< end of the text
  kNewline,  ///< one or several line ends; none inside brackets
  kName,     ///< also keywords
  kInt,
  kFloat,
  kString,  ///< text without its quotes
  kSymbol,  ///< operator or bracket
  kBad,     ///< no token begins like this, or a number or string is broken
};

struct Token {
  TokenKind kind{TokenKind::kEnd};
  std::string_view text;
  int line{1};
  int column{1};
  double number{0.0};  ///< of kInt (fits 32 bits) and kFloat

  [[nodiscard]] bool is(std::string_view word) const noexcept {
    return (kind == TokenKind::kName || kind == TokenKind::kSymbol) && text == word;
  }
};

class Lexer {
 public:
  explicit Lexer(std::string_view text) noexcept : text_(text) {}
  [[nodiscard]] Token next() noexcept;
  /// The line's text without surrounding blanks, for error messages.
  [[nodiscard]] std::string_view line_text(int line) const noexcept;

 private:
  [[nodiscard]] char peek(std::size_t ahead = 0) const noexcept {
    return at_ + ahead < text_.size() ? text_[at_ + ahead] : '\0';
  }
  /// Skips blanks, comments and, inside brackets, line ends; true if a line end that counts was skipped.
  bool skip_blanks() noexcept;
  void new_line() noexcept;
  Token number(Token token) noexcept;
  Token string(Token token) noexcept;
  Token symbol(Token token) noexcept;
  Token take(Token token, TokenKind kind, std::size_t size) noexcept;

  std::string_view text_;
  std::size_t at_{0};
  std::size_t line_start_{0};
  int line_{1};
  int brackets_{0};
};

}  // namespace embody::sim::urscript
