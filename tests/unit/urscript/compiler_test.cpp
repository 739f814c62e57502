#include "drivers/sim/ur/urscript/compiler.hpp"

#include <gtest/gtest.h>

#include <string>

namespace embody::sim::urscript {
namespace {

/// "line:column text" of the error; empty when it compiles.
std::string error_of(const std::string& text) {
  const auto result = compile(text);
  const auto* const error = std::get_if<ScriptError>(&result);
  if (error == nullptr) return "";
  return std::to_string(error->line) + ":" + std::to_string(error->column) + " " + error->text.c_str();
}

std::string in_program(const std::string& body) {
  return error_of("def prog():\n" + body + "\nend\n");
}

// The first two texts are what users of real controllers have reported.
TEST(Compiler, NamesTheLineAndTheOffenceLikeTheController) {
  EXPECT_EQ(error_of("def f():\n  textmsg(\"log \", get_steptime()\nend\n"), "3:1 syntax_error_on_line:3:end:");
  EXPECT_EQ(error_of("def f():\n  textmsg(\"log \", get_tcp_pose())\nend\n"),
            "2:19 compile_error_name_not_found:get_tcp_pose:");
  EXPECT_EQ(in_program("  x = y"), "2:7 compile_error_name_not_found:y:");
  EXPECT_EQ(in_program("  x = x + 1"), "2:7 compile_error_name_not_found:x:");
  EXPECT_EQ(in_program("  x[0] = 1"), "2:3 compile_error_name_not_found:x:");
  EXPECT_EQ(in_program("  x = abs(1)"), "2:7 compile_error_name_not_found:abs:") << "URScript has no abs";
  EXPECT_EQ(in_program("  sqrt(1, 2)"), "2:3 compile_error_wrong_number_of_arguments:sqrt:");
  EXPECT_EQ(in_program("  sqrt()"), "2:3 compile_error_wrong_number_of_arguments:sqrt:");
  EXPECT_EQ(in_program("  servoj(t=0.002)"), "2:3 compile_error_wrong_number_of_arguments:servoj:");
  EXPECT_EQ(in_program("  servoj([0,0,0,0,0,0], time=1)"), "2:25 compile_error_name_not_found:time:");
}

TEST(Compiler, RefusesWhatIsNoUrscript) {
  for (const char* body : {"  x = 1 +",
                           "  x == 1",
                           "  x = 1 2",
                           "  if True\n  end",
                           "  if True:\n",
                           "  while 1 < 2 < 3:\n  end",
                           "  break",
                           "  continue",
                           "  else:\n  end",
                           "  x += 1",
                           "  1",
                           "  end\nend",
                           "  def = 1",
                           "  sqrt = 2",
                           "  x = [1,]",
                           "  x = (1",
                           "  x = p[1,2,3]",
                           "  local textmsg(1)",
                           "  thread t():\n  end",
                           "  socket_open(\"127.0.0.1\", 50001)",
                           "  x = not",
                           "  servoj(t=0.1, [0,0,0,0,0,0])",
                           "  servoj([0,0,0,0,0,0], t=1, t=2)",
                           "  def f(a, a):\n  end",
                           "  def f():\n  end\n  f = 1",
                           "  def f():\n  end\n  def f():\n  end",
                           "  def f():\n    def g():\n    end\n  end",
                           "  f()\n  def f():\n  end",
                           "  def f(a):\n  end\n  f(1, 2)",
                           "  x = 'a",
                           "  if True: x = 1\n  end"}) {
    EXPECT_NE(in_program(body), "") << body;
  }
  for (const char* text : {"", "\n\n", "def f()\nend\n", "def f(x):\nend\n", "def f():\n", "def f():\nend\nx = 1\n",
                           "def f():\nend\ndef g():\nend\n", "end", "def 1():\nend"}) {
    EXPECT_NE(error_of(text), "") << text;
  }
}

TEST(Compiler, TakesProgramsSecondaryProgramsAndSingleLines) {
  EXPECT_EQ(error_of("def f():\nend"), "");
  EXPECT_EQ(error_of("\n# note\ndef f(): # note\n\n  pass\r\n  # note\nend\n\n# note"), "");
  EXPECT_EQ(error_of("popup(\"hello\")\n"), "");
  const auto secondary = compile("sec blink():\n  textmsg(1)\nend\n");
  ASSERT_TRUE(std::holds_alternative<Code>(secondary));
  EXPECT_TRUE(std::get<Code>(secondary).secondary);
  EXPECT_EQ(std::get<Code>(secondary).name, "blink");
}

TEST(Compiler, BoundsDepthSizeAndNumbers) {
  const std::string deep(60, '(');
  EXPECT_NE(in_program("  x = " + deep + "1" + std::string(60, ')')).find("nested_too_deep"), std::string::npos);
  EXPECT_NE(in_program("  x = " + std::string(100'000, '-') + "1").find("nested_too_deep"), std::string::npos);
  std::string blocks;
  for (int i = 0; i < 60; ++i) blocks += "if True:\n";
  EXPECT_NE(in_program(blocks).find("nested_too_deep"), std::string::npos);
  std::string items = "  x = [0";
  for (int i = 0; i < 64; ++i) items += ",0";
  EXPECT_NE(in_program(items + "]").find("list_too_long"), std::string::npos);
  std::string variables;
  for (int i = 0; i < 300; ++i) variables += "v" + std::to_string(i) + " = 0\n";
  EXPECT_NE(in_program(variables).find("too_many_variables"), std::string::npos);
  std::string functions;
  for (int i = 0; i < 300; ++i) functions += "def f" + std::to_string(i) + "():\nend\n";
  EXPECT_NE(in_program(functions).find("too_many_functions"), std::string::npos);
  std::string lines;
  for (int i = 0; i < 40'000; ++i) lines += "x=1\n";
  EXPECT_NE(in_program(lines).find("too_large"), std::string::npos);
  EXPECT_NE(error_of(std::string(256 * 1024 + 1, '\n')).find("too_large"), std::string::npos);
}

TEST(Compiler, ErrorTextsArePrintable) {
  EXPECT_EQ(in_program("  x = \x01\x80"), "2:7 syntax_error_on_line:2:x = ??:");
}

}  // namespace
}  // namespace embody::sim::urscript
