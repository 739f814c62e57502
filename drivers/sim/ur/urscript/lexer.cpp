#include "drivers/sim/ur/urscript/lexer.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

namespace embody::sim::urscript {
namespace {

bool is_digit(char c) noexcept {
  return c >= '0' && c <= '9';
}
bool is_letter(char c) noexcept {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
}
bool is_blank(char c) noexcept {
  return c == ' ' || c == '\t' || c == '\r';
}

}  // namespace

Token Lexer::next() noexcept {
  const Token before{TokenKind::kNewline, {}, line_, static_cast<int>(at_ - line_start_) + 1};
  if (skip_blanks()) return before;
  Token token{TokenKind::kEnd, {}, line_, static_cast<int>(at_ - line_start_) + 1};
  if (at_ == text_.size()) return token;
  const char c = peek();
  if (is_letter(c)) {
    std::size_t size = 1;
    while (is_letter(peek(size)) || is_digit(peek(size))) ++size;
    return take(token, TokenKind::kName, size);
  }
  if (is_digit(c) || (c == '.' && is_digit(peek(1)))) return number(token);
  if (c == '"' || c == '\'') return string(token);
  return symbol(token);
}

std::string_view Lexer::line_text(int line) const noexcept {
  std::string_view rest = text_;
  for (int i = 1; i < line; ++i) rest.remove_prefix(std::min(rest.size(), rest.find('\n') + 1));
  rest = rest.substr(0, rest.find('\n'));
  while (!rest.empty() && is_blank(rest.front())) rest.remove_prefix(1);
  while (!rest.empty() && is_blank(rest.back())) rest.remove_suffix(1);
  return rest;
}

bool Lexer::skip_blanks() noexcept {
  bool line_end = false;
  while (at_ < text_.size()) {
    if (peek() == '\n') {
      line_end = line_end || brackets_ == 0;
      new_line();
    } else if (peek() == '#') {
      while (at_ < text_.size() && peek() != '\n') ++at_;
    } else if (is_blank(peek())) {
      ++at_;
    } else {
      break;
    }
  }
  return line_end;
}

void Lexer::new_line() noexcept {
  ++at_;
  ++line_;
  line_start_ = at_;
}

Token Lexer::number(Token token) noexcept {
  const char* const first = text_.data() + at_;
  const char* const last = text_.data() + text_.size();
  const auto [end, error] = std::from_chars(first, last, token.number);
  const auto size = static_cast<std::size_t>(end - first);
  const bool whole = std::all_of(first, end, is_digit);
  const bool fits = std::isfinite(token.number) && (!whole || token.number <= std::numeric_limits<std::int32_t>::max());
  const bool ends = !is_letter(peek(size)) && peek(size) != '.';
  if (error != std::errc{} || !fits || !ends) return take(token, TokenKind::kBad, std::max<std::size_t>(size, 1));
  return take(token, whole ? TokenKind::kInt : TokenKind::kFloat, size);
}

Token Lexer::string(Token token) noexcept {
  constexpr std::size_t kMaxSize = 255;
  const std::size_t end = text_.find(peek(), at_ + 1);
  const std::string_view inner = text_.substr(at_ + 1, end == std::string_view::npos ? end : end - at_ - 1);
  if (end == std::string_view::npos || inner.size() > kMaxSize || inner.find('\n') != std::string_view::npos) {
    return take(token, TokenKind::kBad, 1);
  }
  token = take(token, TokenKind::kString, inner.size() + 2);
  token.text = inner;
  return token;
}

Token Lexer::symbol(Token token) noexcept {
  constexpr std::string_view kSingle = "()[]+-*/%<>=,:";
  const char c = peek();
  if (peek(1) == '=' && (c == '=' || c == '!' || c == '<' || c == '>')) return take(token, TokenKind::kSymbol, 2);
  if (kSingle.find(c) == std::string_view::npos || c == '\0') return take(token, TokenKind::kBad, 1);
  if (c == '(' || c == '[') ++brackets_;
  if ((c == ')' || c == ']') && brackets_ > 0) --brackets_;
  return take(token, TokenKind::kSymbol, 1);
}

Token Lexer::take(Token token, TokenKind kind, std::size_t size) noexcept {
  token.kind = kind;
  token.text = text_.substr(at_, size);
  at_ += token.text.size();
  return token;
}

}  // namespace embody::sim::urscript
