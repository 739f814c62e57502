// Any text as a script: it compiles or gives an error with a place, and what compiles runs for 200 control cycles
// without leaving its bounds.
#include <cmath>
#include <cstdlib>

#include "drivers/sim/ur/urscript/compiler.hpp"
#include "drivers/sim/ur/urscript/machine.hpp"

namespace {

using namespace embody;
using namespace embody::sim::urscript;

void require(bool holds) {
  if (!holds) std::abort();
}

/// Checks what the interpreter promises to its host.
class CheckingHost final : public ScriptHost {
 public:
  explicit CheckingHost(std::size_t salt) : salt_(salt) {}
  [[nodiscard]] double step_time_s() const noexcept override { return salt_ % 2 == 0 ? 0.002 : 0.008; }
  [[nodiscard]] double speed_scaling() const noexcept override { return salt_ % 3 == 0 ? 0.5 : 1.0; }
  [[nodiscard]] bool at_rest() const noexcept override { return true; }
  [[nodiscard]] Vector6 joints(JointQuantity) const noexcept override { return Vector6::Constant(0.5); }
  [[nodiscard]] bool within_limits(const Vector6&) const noexcept override { return true; }
  [[nodiscard]] std::int32_t input_int(int address) const noexcept override {
    check(address);
    return static_cast<std::int32_t>(cycle % 11);
  }
  [[nodiscard]] double input_double(int address) const noexcept override {
    check(address);
    return cycle % 7 == 0 ? std::nan("") : 0.5;
  }
  [[nodiscard]] bool input_bool(int address) const noexcept override { return check(address), cycle % 2 == 0; }
  void set_output_int(int address, std::int32_t) noexcept override { check(address); }
  void set_output_double(int address, double) noexcept override { check(address); }
  void set_output_bool(int address, bool) noexcept override { check(address); }
  void servoj(const ServoCommand& command) noexcept override {
    require(command.q_rad.allFinite() && command.time_s > 0.0 && command.gain >= 100.0 && command.lookahead_s >= 0.03);
  }
  void stopj(double deceleration_rad_s2) noexcept override { require(deceleration_rad_s2 > 0.0); }
  void motion_done() noexcept override {}
  bool set_watchdog(std::string_view, double hz, bool) noexcept override { return require(hz > 0.0), true; }
  void message(MessageKind, std::string_view text) noexcept override { require(text.size() <= 160); }

  std::size_t cycle{0};

 private:
  static void check(int address) noexcept { require(address >= 0 && address < kRegisters); }
  std::size_t salt_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(data, data + size);
  const auto compiled = compile(text);
  if (const auto* const error = std::get_if<ScriptError>(&compiled)) {
    require(error->line >= 1 && error->column >= 1 && !error->text.empty());
    return 0;
  }
  const Code& code = std::get<Code>(compiled);
  Machine machine(code);
  CheckingHost host(size);
  machine.start();
  Outcome outcome = Outcome::kRunning;
  for (; host.cycle < 200 && outcome == Outcome::kRunning; ++host.cycle) outcome = machine.cycle(host);
  require(machine.cycle(host) == outcome || outcome == Outcome::kRunning);
  return 0;
}
