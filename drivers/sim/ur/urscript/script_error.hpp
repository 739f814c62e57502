#pragma once
// Why a script does not run, in the controller's kind of text.
#include "core/base/fixed_string.hpp"

namespace embody::sim::urscript {

/// Like the controller's runtime exception message: a place in the script and a text. Lines and columns count from 1.
/// Texts of syntax errors ("syntax_error_on_line:3:end:") and unknown names ("compile_error_name_not_found:foo:") are
/// those that controllers are known to send; the others are modelled on them.
struct ScriptError {
  int line{0};
  int column{0};
  FixedString<160> text;
};

}  // namespace embody::sim::urscript
