#pragma once
// Script text to code in one pass over the tokens. Everything is checked before anything runs: syntax, names, numbers
// of arguments.
//
// The subset of URScript (vendor's Script Manual): one program "def name():" or "sec name():", or a single statement;
// functions inside it; while, if, elif, else, break, continue, return, halt, pass; local and global; int, float, bool,
// string, list of numbers or bools, and pose; the functions of builtins.hpp. Threads, sockets, matrices and structs are
// not part of it and give errors.
#include <string_view>
#include <variant>

#include "drivers/sim/ur/urscript/code.hpp"
#include "drivers/sim/ur/urscript/script_error.hpp"

namespace embody::sim::urscript {

inline constexpr std::size_t kMaxText = std::size_t{256} * 1024;  ///< bytes
inline constexpr std::size_t kMaxInstructions = 65'536;
inline constexpr int kMaxNesting = 48;             ///< of blocks and brackets together
inline constexpr std::size_t kMaxVariables = 256;  ///< of the program, and of each function
inline constexpr std::size_t kMaxFunctions = 256;

/// Errors point at the first offence.
[[nodiscard]] std::variant<Code, ScriptError> compile(std::string_view text);

}  // namespace embody::sim::urscript
