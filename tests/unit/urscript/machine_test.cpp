#include "drivers/sim/ur/urscript/machine.hpp"

#include <gtest/gtest.h>

#include "tests/support/heap_counter.hpp"
#include "tests/unit/urscript/recording_host.hpp"

namespace embody::sim::urscript {
namespace {

/// A compiled program with its host.
struct Program {
  explicit Program(const std::string& body) : code(compiled("def prog():\n" + body + "\nend\n")), machine(code) {
    machine.start();
  }
  static Code compiled(const std::string& text) {
    auto result = compile(text);
    if (const auto* const error = std::get_if<ScriptError>(&result)) {
      ADD_FAILURE() << error->line << ": " << error->text.c_str() << " in\n" << text;
      return std::get<Code>(compile("def empty():\nend"));
    }
    return std::move(std::get<Code>(result));
  }
  Outcome cycle() { return machine.cycle(host); }
  Code code;
  Machine machine;
  RecordingHost host;
};

/// What textmsg says, in one cycle.
std::vector<std::string> output_of(const std::string& body) {
  Program run(body);
  EXPECT_EQ(run.cycle(), Outcome::kEnded) << run.machine.error().text.c_str() << " in\n" << body;
  return run.host.messages;
}

std::string value_of(const std::string& expression) {
  const auto messages = output_of("  textmsg(" + expression + ")");
  return messages.empty() ? "" : messages[0];
}

std::string error_of(const std::string& body) {
  Program run(body);
  EXPECT_EQ(run.cycle(), Outcome::kFailed) << body;
  return std::to_string(run.machine.error().line) + ": " + run.machine.error().text.c_str();
}

TEST(Machine, EvaluatesExpressions) {
  EXPECT_EQ(value_of("1 + 2 * 3 - 4"), "3");
  EXPECT_EQ(value_of("(1 + 2) * 3"), "9");
  EXPECT_EQ(value_of("7 % 4"), "3");
  EXPECT_EQ(value_of("7 / 2"), "3.5");
  EXPECT_EQ(value_of("10 - 2 - 3"), "5");
  EXPECT_EQ(value_of("- -3 * -2"), "-6");
  EXPECT_EQ(value_of("1 < 2 and not 2 < 1 or False"), "True");
  EXPECT_EQ(value_of("True xor True"), "False");
  EXPECT_EQ(value_of("1.0 == 1"), "True");
  EXPECT_EQ(value_of("\"a\" == 'a'"), "True");
  EXPECT_EQ(value_of("\"a\" != \"b\""), "True");
  EXPECT_EQ(value_of("[1, 2.5, 3]"), "[1, 2.5, 3]");
  EXPECT_EQ(value_of("[True, False]"), "[True, False]");
  EXPECT_EQ(value_of("p[1, 2, 3, 4, 5, 6][2]"), "3");
  EXPECT_EQ(value_of("[1, 2] == [1, 2]"), "True");
  EXPECT_EQ(value_of("[[1, 2][1], 3][0] + 1"), "3");
}

TEST(Machine, KnowsTheUsualFunctions) {
  EXPECT_EQ(value_of("norm(-2)"), "2");
  EXPECT_EQ(value_of("norm([3, 4])"), "5");
  EXPECT_EQ(value_of("floor(-1.5)"), "-2");
  EXPECT_EQ(value_of("ceil(1.2)"), "2");
  EXPECT_EQ(value_of("sqrt(16)"), "4");
  EXPECT_EQ(value_of("pow(2, 10)"), "1024");
  EXPECT_EQ(value_of("r2d(atan2(1, 1))"), "45");
  EXPECT_EQ(value_of("length([1, 2, 3])"), "3");
  EXPECT_EQ(value_of("get_steptime()"), "0.002");
  EXPECT_EQ(value_of("get_actual_joint_positions()"), "[1, 1, 1, 1, 1, 1]");
  EXPECT_EQ(value_of("get_target_joint_speeds()[5]"), "4");
  EXPECT_EQ(value_of("is_within_safety_limits([0, 0, 0, 7, 0, 0])"), "False");
  EXPECT_EQ(value_of("\"a\", 1"), "a1");
}

TEST(Machine, ControlsItsFlow) {
  EXPECT_EQ(
      output_of("  i = 0\n  sum = 0\n  while True:\n    i = i + 1\n    if i > 10:\n      break\n    elif i % 2 == 0:\n"
                "      continue\n    else:\n      sum = sum + i\n    end\n  end\n  textmsg(sum)"),
      std::vector<std::string>{"25"});
  EXPECT_EQ(
      output_of("  if False:\n    textmsg(1)\n  elif False:\n    textmsg(2)\n  else:\n    textmsg(3)\n  end\n  halt\n"
                "  textmsg(4)"),
      std::vector<std::string>{"3"});
}

TEST(Machine, CallsFunctionsWithTheirOwnVariables) {
  EXPECT_EQ(
      output_of("  def factorial(n):\n    if n <= 1:\n      return 1\n    end\n    return n * factorial(n - 1)\n  end\n"
                "  textmsg(factorial(10))"),
      std::vector<std::string>{"3628800"});
  EXPECT_EQ(output_of("  a = 1\n  def f(x):\n    local a = x\n    b = a + 1\n    global c = b\n    return a\n  end\n"
                      "  r = f(5)\n  textmsg(a, r)"),
            std::vector<std::string>{"15"});
  EXPECT_EQ(output_of("  a = 1\n  def f():\n    a = 2\n  end\n  f()\n  textmsg(a)"), std::vector<std::string>{"2"})
      << "a function sees its program's variables";
}

TEST(Machine, AssignmentCopiesLists) {
  EXPECT_EQ(output_of("  a = [1, 2, 3]\n  b = a\n  b[0] = 9\n  def change(x):\n    x[1] = 7\n    return x\n  end\n"
                      "  c = change(a)\n  textmsg(a)\n  textmsg(b)\n  textmsg(c)"),
            (std::vector<std::string>{"[1, 2, 3]", "[9, 2, 3]", "[1, 7, 3]"}));
}

TEST(Machine, PassesNamedArgumentsInAnyOrder) {
  Program run("  servoj([1, 2, 3, 4, 5, 6], gain=500, t=0.004, lookahead_time=0.05)");
  EXPECT_EQ(run.cycle(), Outcome::kRunning);
  EXPECT_EQ(run.host.servo.q_rad[5], 6.0);
  EXPECT_EQ(run.host.servo.time_s, 0.004);
  EXPECT_EQ(run.host.servo.lookahead_s, 0.05);
  EXPECT_EQ(run.host.servo.gain, 500.0);
  Program positional("  servoj([1, 2, 3, 4, 5, 6], 0, 0, 0.002)");
  EXPECT_EQ(positional.cycle(), Outcome::kRunning);
  EXPECT_EQ(positional.host.servo.gain, 300.0);
}

TEST(Machine, FailsWithLineAndReason) {
  EXPECT_EQ(error_of("  x = [1, 2]\n  y = x[2]"), "3: Index out of range: 2 of 2");
  EXPECT_EQ(error_of("  x = [1]\n  x[-1] = 2"), "3: Index out of range: -1 of 1");
  EXPECT_EQ(error_of("  x = [1]\n  x[0] = 1.5"), "3: Type error: a list of int does not take float");
  EXPECT_EQ(error_of("  x = 1\n  x = \"a\""), "3: Type error: a variable that is a int cannot become a string");
  EXPECT_EQ(error_of("  if 1:\n  end"), "2: Type error: a condition must be bool, not int");
  EXPECT_EQ(error_of("  x = 1 + True"), "2: Type error: no arithmetic with int and bool");
  EXPECT_EQ(error_of("  x = 1 and True"), "2: Type error: 'and', 'or', 'xor' need bool, not int and bool");
  EXPECT_EQ(error_of("  x = \"a\" < \"b\""), "2: Type error: string and string cannot be compared");
  EXPECT_EQ(error_of("  x = 1 / 0"), "2: Runtime error: division by zero");
  EXPECT_EQ(error_of("  x = 2147483647 + 1"), "2: Runtime error: int out of range");
  EXPECT_EQ(error_of("  x = sqrt(-1)"), "2: Runtime error: sqrt of -1");
  EXPECT_EQ(error_of("  x = floor(1.0e300)"), "2: Runtime error: int out of range");
  EXPECT_EQ(error_of("  x = [1, \"a\"]"), "2: Type error: string cannot be an item of this list");
  EXPECT_EQ(error_of("  x = [[1], [2]]"), "2: Type error: list cannot be an item of this list");
  EXPECT_EQ(error_of("  if False:\n    x = 1\n  end\n  textmsg(x)"),
            "5: Runtime error: a variable is used before it has a value");
  EXPECT_EQ(error_of("  def f():\n  end\n  x = f()"), "4: Type error: the function returns nothing to assign");
  EXPECT_EQ(error_of("  read_input_integer_register(48)"), "2: Runtime error: there is no such register (0 to 47)");
  EXPECT_EQ(error_of("  write_output_integer_register(1, 1.5)"), "2: Type error: float does not go into this register");
  EXPECT_EQ(error_of("  servoj([0, 0])"), "2: Type error: six joint positions are needed, not list");
  EXPECT_EQ(error_of("  servoj([0,0,0,0,0,0], lookahead_time=0.01)"),
            "2: servoj: lookahead_time = 0.01 is not within 0.03 to 0.2");
  EXPECT_EQ(error_of("  servoj([0,0,0,0,0,0], gain=5000)"), "2: servoj: gain = 5000 is not within 100 to 2000");
  EXPECT_EQ(error_of("  rtde_set_watchdog(\"nothing\", 10)"), "2: rtde_set_watchdog: there is no input 'nothing'");
}

TEST(Machine, BoundsRecursionAndMemory) {
  EXPECT_EQ(error_of("  def f(n):\n    return f(n + 1)\n  end\n  f(0)"),
            "3: Runtime error: functions call each other too deeply");
  std::string wide = "  def f(n):\n";
  for (int i = 0; i < 100; ++i) wide += "    v" + std::to_string(i) + " = n\n";
  EXPECT_NE(error_of(wide + "    return f(n + 1)\n  end\n  f(0)").find("too much memory"), std::string::npos);
}

TEST(Machine, ALoopWithoutAWaitingCallIsStoppedByTheController) {
  Program run("  i = 0\n  while True:\n    i = 1 - i\n  end");
  EXPECT_EQ(run.cycle(), Outcome::kTooMuchTime);
  EXPECT_EQ(run.machine.error().text.view().substr(0, 5), "C218:");
  EXPECT_EQ(run.cycle(), Outcome::kTooMuchTime) << "and stays so";
}

TEST(Machine, WaitsForControlCyclesSleepMotionAndStandstill) {
  Program run(
      "  textmsg(0)\n  sync()\n  textmsg(1)\n  sleep(0.006)\n  textmsg(2)\n  servoj([0,0,0,0,0,0], t=0.004)\n  "
      "textmsg(3)\n"
      "  stopj(2)\n  textmsg(4)");
  std::vector<std::size_t> said;
  const auto cycle = [&] { run.cycle(), said.push_back(run.host.messages.size()); };
  for (int i = 0; i < 5; ++i) cycle();  // at once, after the sync, and 3 cycles of sleep later
  EXPECT_EQ(said, (std::vector<std::size_t>{1, 2, 2, 2, 3}));
  run.host.scaling = 0.5;  // 4 ms of servoj take 8 ms
  run.host.rest = false;
  said.clear();
  for (int i = 0; i < 5; ++i) cycle();
  EXPECT_EQ(said, (std::vector<std::size_t>{3, 3, 3, 4, 4}));
  EXPECT_EQ(run.host.stop_deceleration, 2.0);
  for (int i = 0; i < 10; ++i) EXPECT_EQ(run.cycle(), Outcome::kRunning) << "not at rest yet";
  run.host.rest = true;
  EXPECT_EQ(run.cycle(), Outcome::kEnded);
  EXPECT_EQ(run.host.messages.back(), "4");
  EXPECT_EQ(run.host.motions_done, 2);
}

TEST(Machine, ASecondaryProgramMustNotMove) {
  const Code code = Program::compiled("sec s():\n  stopj(1)\nend\n");
  Machine machine(code);
  RecordingHost host;
  machine.start();
  EXPECT_EQ(machine.cycle(host), Outcome::kFailed);
  EXPECT_EQ(machine.error().text.view().substr(0, 5), "C271:");
}

TEST(Machine, StartsAgainWithoutItsOldVariables) {
  Program run("  if read_input_integer_register(0) == 0:\n    x = 1\n  end\n  sync()\n  textmsg(x)");
  run.cycle();
  EXPECT_EQ(run.cycle(), Outcome::kEnded);
  run.host.ints_in[0] = 1;
  run.machine.start();
  run.cycle();
  EXPECT_EQ(run.cycle(), Outcome::kFailed);
}

TEST(Machine, NeverAllocatesWhileItRuns) {
  Program run(
      "  def f(x):\n    y = x\n    y[0] = 1\n    return y\n  end\n  a = [1, 2, 3]\n  while True:\n    a = f(a)\n"
      "    textmsg(\"a = \", a)\n    servoj([0,0,0,0,0,0], t=0.002)\n  end");
  run.host.keep_messages = false;
  const auto before = test::heap_allocations();
  for (int i = 0; i < 100; ++i) ASSERT_EQ(run.cycle(), Outcome::kRunning);
  run.machine.start();
  EXPECT_EQ(test::heap_allocations(), before);
}

}  // namespace
}  // namespace embody::sim::urscript
