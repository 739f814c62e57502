#pragma once
// A compiled script: flat instructions for a stack machine. Running it needs no recursion, so it can stop anywhere and
// go on in the next control cycle.
#include <cstdint>
#include <string>
#include <vector>

#include "drivers/sim/ur/urscript/value.hpp"

namespace embody::sim::urscript {

/// `a` is the instruction's argument; what it takes from the stack comes before the arrow, what it leaves after it.
enum class Op : std::uint8_t {
  kConstant,       ///< -> constants[a]
  kGlobal,         ///< -> variable a of the program
  kLocal,          ///< -> variable a of the function
  kSetGlobal,      ///< value ->
  kSetLocal,       ///< value ->
  kItem,           ///< list, index -> item
  kGlobalItem,     ///< index -> item of variable a, without copying the list
  kLocalItem,      ///< index -> item of variable a
  kSetGlobalItem,  ///< index, value ->
  kSetLocalItem,   ///< index, value ->
  kList,           ///< a items -> list
  kPose,           ///< six numbers -> pose
  kNegate,
  kNot,
  kAdd,
  kSubtract,
  kMultiply,
  kDivide,
  kModulo,
  kEqual,
  kNotEqual,
  kLess,
  kLessEqual,
  kGreater,
  kGreaterEqual,
  kAnd,
  kOr,
  kXor,
  kJump,         ///< to instruction a
  kJumpIfFalse,  ///< bool ->, jumps to instruction a
  kSetArgument,  ///< value ->, replaces the value that lies a below the top
  kCall,         ///< arguments -> result of functions[a]
  kBuiltin,      ///< arguments -> result of Builtin a
  kReturn,       ///< value -> (value to the caller)
  kPop,          ///< value ->
  kHalt,         ///< ends the program
};

struct Instruction {
  Op op{Op::kHalt};
  std::int32_t a{0};
  std::int32_t line{0};
  std::int32_t column{0};
};

struct Function {
  std::string name;
  std::int32_t entry{0};
  std::int32_t parameters{0};
  std::int32_t locals{0};  ///< parameters included
};

struct Code {
  std::string name;       ///< of the program
  bool secondary{false};  ///< begins with "sec": one cycle, no motion
  std::vector<Instruction> instructions;
  std::vector<Scalar> constants;
  std::vector<std::string> strings;
  std::vector<Function> functions;
  std::vector<std::string> variables;  ///< names of the program's variables
};

}  // namespace embody::sim::urscript
