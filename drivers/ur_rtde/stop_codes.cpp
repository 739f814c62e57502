#include "drivers/ur_rtde/stop_codes.hpp"

#include <array>

namespace embody::ur {
namespace {

constexpr int kAny = -1;

struct Entry {
  int code;
  int argument;  // kAny: whatever the argument
  const char* text;
};

constexpr std::array<Entry, 20> kEntries{{
    {153, kAny, "a joint's position deviates from its target: collision, or a wrong payload"},
    {157, kAny, "collision: a joint was pushed off its target, or the payload is wrong"},
    {162, kAny, "the forces do not fit the payload: check payload and centre of gravity in the installation"},
    {163, kAny, "more than 50 protective stops in 8 hours: find their cause"},
    {164, kAny, "the wrist is too near a safety plane: move the work away from it"},
    {173, kAny, "a joint's torque is too high: too heavy, too fast, or pushed against something"},
    {174, kAny, "a joint's torque jumped: collision"},
    {191, kAny, "a safety limit was exceeded (joint or tool position or speed, power, momentum, stopping time)"},
    {204, 1, "sudden change of the target position"},
    {204, 2, "target position and target speed do not fit each other"},
    {204, 3, "sudden stop of the target motion"},
    {204, 4, "the arm did not stop in time"},
    {204, 5, "invalid set-point"},
    {204, 7, "too near a singularity"},
    {204, kAny, "the path of the set-points cannot be followed"},
    {205, kAny, "the target speed does not fit the target position"},
    {206, kAny, "the target speed does not fit the target position"},
    {210, kAny, "the port is read-only in local control: switch the robot to Remote Control"},
    {218, kAny, "the program used too much time in one control cycle"},
    {271, kAny, "the program is too far behind real time"},
}};

}  // namespace

const char* stop_code_text(int code, int argument) noexcept {
  for (const Entry& entry : kEntries) {
    if (entry.code == code && (entry.argument == argument || entry.argument == kAny)) return entry.text;
  }
  return "";
}

}  // namespace embody::ur
