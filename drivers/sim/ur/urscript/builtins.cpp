#include "drivers/sim/ur/urscript/builtins.hpp"

#include <algorithm>

namespace embody::sim::urscript {
namespace {

constexpr Scalar kRequired{};
constexpr Scalar kFalse{Type::kBool, 0.0};
constexpr Scalar kText{Type::kString, 0.0};

constexpr Scalar real(double f) noexcept {
  return {Type::kFloat, f};
}

using B = Builtin;
constexpr std::array kBuiltins{
    BuiltinInfo{B::kAcos, "acos", {{{"f", kRequired}}}},
    BuiltinInfo{B::kAsin, "asin", {{{"f", kRequired}}}},
    BuiltinInfo{B::kAtan, "atan", {{{"f", kRequired}}}},
    BuiltinInfo{B::kAtan2, "atan2", {{{"x", kRequired}, {"y", kRequired}}}},
    BuiltinInfo{B::kCeil, "ceil", {{{"f", kRequired}}}},
    BuiltinInfo{B::kCos, "cos", {{{"f", kRequired}}}},
    BuiltinInfo{B::kDegreesToRadians, "d2r", {{{"d", kRequired}}}},
    BuiltinInfo{B::kFloor, "floor", {{{"f", kRequired}}}},
    BuiltinInfo{B::kGetActualJointPositions, "get_actual_joint_positions"},
    BuiltinInfo{B::kGetActualJointSpeeds, "get_actual_joint_speeds"},
    BuiltinInfo{B::kGetSteptime, "get_steptime"},
    BuiltinInfo{B::kGetTargetJointPositions, "get_target_joint_positions"},
    BuiltinInfo{B::kGetTargetJointSpeeds, "get_target_joint_speeds"},
    BuiltinInfo{B::kIsWithinSafetyLimits, "is_within_safety_limits", {{{"qpose", kRequired}}}},
    BuiltinInfo{B::kLength, "length", {{{"v", kRequired}}}},
    BuiltinInfo{B::kLog, "log", {{{"b", kRequired}, {"f", kRequired}}}},
    BuiltinInfo{B::kNorm, "norm", {{{"a", kRequired}}}},
    BuiltinInfo{
        B::kPopup,
        "popup",
        {{{"s", kRequired}, {"title", kText, "Popup"}, {"warning", kFalse}, {"error", kFalse}, {"blocking", kFalse}}}},
    BuiltinInfo{B::kPow, "pow", {{{"base", kRequired}, {"exponent", kRequired}}}},
    BuiltinInfo{B::kRadiansToDegrees, "r2d", {{{"r", kRequired}}}},
    BuiltinInfo{B::kReadInputBoolean, "read_input_boolean_register", {{{"address", kRequired}}}},
    BuiltinInfo{B::kReadInputFloat, "read_input_float_register", {{{"address", kRequired}}}},
    BuiltinInfo{B::kReadInputInteger, "read_input_integer_register", {{{"address", kRequired}}}},
    BuiltinInfo{B::kSetWatchdog,
                "rtde_set_watchdog",
                {{{"variable_name", kRequired}, {"min_frequency", kRequired}, {"action", kText, "pause"}}}},
    BuiltinInfo{B::kServoj,
                "servoj",
                {{{"q", kRequired},
                  {"a", real(0.0)},
                  {"v", real(0.0)},
                  {"t", real(0.002)},
                  {"lookahead_time", real(0.1)},
                  {"gain", real(300.0)}}}},
    BuiltinInfo{B::kSin, "sin", {{{"f", kRequired}}}},
    BuiltinInfo{B::kSleep, "sleep", {{{"t", kRequired}}}},
    BuiltinInfo{B::kSqrt, "sqrt", {{{"f", kRequired}}}},
    BuiltinInfo{B::kStopj, "stopj", {{{"a", kRequired}}}},
    BuiltinInfo{B::kSync, "sync"},
    BuiltinInfo{B::kTan, "tan", {{{"f", kRequired}}}},
    BuiltinInfo{B::kTextmsg, "textmsg", {{{"s1", kRequired}, {"s2", kText, ""}}}},
    BuiltinInfo{
        B::kWriteOutputBoolean, "write_output_boolean_register", {{{"address", kRequired}, {"value", kRequired}}}},
    BuiltinInfo{B::kWriteOutputFloat, "write_output_float_register", {{{"address", kRequired}, {"value", kRequired}}}},
    BuiltinInfo{
        B::kWriteOutputInteger, "write_output_integer_register", {{{"address", kRequired}, {"value", kRequired}}}},
};

constexpr bool in_order() noexcept {
  for (std::size_t i = 0; i < kBuiltins.size(); ++i) {
    if (static_cast<std::size_t>(kBuiltins[i].id) != i) return false;
  }
  return true;
}
static_assert(in_order());

}  // namespace

const BuiltinInfo* find_builtin(std::string_view name) noexcept {
  const auto* const found =
      std::find_if(kBuiltins.begin(), kBuiltins.end(), [&](const BuiltinInfo& info) { return info.name == name; });
  return found == kBuiltins.end() ? nullptr : found;
}

const BuiltinInfo& builtin_info(Builtin id) noexcept {
  return kBuiltins[static_cast<std::size_t>(id)];  // in the order of the enumeration, as is checked above
}

}  // namespace embody::sim::urscript
