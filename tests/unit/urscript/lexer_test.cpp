#include "drivers/sim/ur/urscript/lexer.hpp"

#include <gtest/gtest.h>

#include <random>
#include <string>
#include <vector>

namespace embody::sim::urscript {
namespace {

std::vector<Token> all(std::string_view text) {
  Lexer lexer(text);
  std::vector<Token> tokens;
  do tokens.push_back(lexer.next());
  while (tokens.back().kind != TokenKind::kEnd && tokens.back().kind != TokenKind::kBad);
  return tokens;
}

TEST(Lexer, KnowsNamesNumbersStringsAndSymbolsWithTheirPlaces) {
  const auto tokens = all("x_1 = p[0.5, 1e-3] # note\n  if a >= \"b c\":");
  const std::vector<std::string_view> texts{"x_1", "=",  "p", "[",  "0.5", ",", "1e-3", "]",
                                            "",    "if", "a", ">=", "b c", ":", ""};
  ASSERT_EQ(tokens.size(), texts.size());
  for (std::size_t i = 0; i < texts.size(); ++i) EXPECT_EQ(tokens[i].text, texts[i]) << i;
  EXPECT_EQ(tokens[4].kind, TokenKind::kFloat);
  EXPECT_DOUBLE_EQ(tokens[6].number, 1e-3);
  EXPECT_EQ(tokens[8].kind, TokenKind::kNewline);
  EXPECT_EQ(tokens[9].line, 2);
  EXPECT_EQ(tokens[9].column, 3);
  EXPECT_EQ(tokens[12].kind, TokenKind::kString);
}

TEST(Lexer, LineEndsInsideBracketsDoNotCount) {
  for (const Token& token : all("(1,\n 2)[\n3]")) EXPECT_NE(token.kind, TokenKind::kNewline);
}

TEST(Lexer, RefusesWhatIsNoToken) {
  for (const char* text :
       {"$", "2147483648", "1.5.2", "12ab", "1e999", "\"open", "'line\nend'", "!", "a & b", "\x80"}) {
    EXPECT_EQ(all(text).back().kind, TokenKind::kBad) << text;
  }
  EXPECT_EQ(all("2147483647")[0].kind, TokenKind::kInt);
}

TEST(Lexer, AnyBytesEndWithinTheirLength) {
  std::mt19937 random(7);
  for (int round = 0; round < 2000; ++round) {
    std::string text(random() % 60, ' ');
    for (char& c : text) c = static_cast<char>(random() % 3 == 0 ? random() : "ab1.\n([])\"#=<"[random() % 14]);
    ASSERT_LE(all(text).size(), text.size() + 2) << "round " << round;
  }
}

}  // namespace
}  // namespace embody::sim::urscript
