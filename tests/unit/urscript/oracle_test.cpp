// The script, run by the interpreter, against the same rules written in C++.
#include <gtest/gtest.h>

#include "tests/unit/urscript/adversary.hpp"
#include "tests/unit/urscript/register_oracle.hpp"
#include "tests/unit/urscript/script_runner.hpp"

namespace embody::sim {
namespace {

rtde::ControlScriptConfig random_config(std::mt19937_64& random) {
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  rtde::ControlScriptConfig config;
  for (int i = 0; i < 6; ++i) {
    config.max_velocity_rad_s[i] = 0.2 + 3.0 * unit(random);
    config.max_acceleration_rad_s2[i] = 1.0 + 20.0 * unit(random);
    config.min_angle_rad[i] = kStart[i] - 0.05 - 3.0 * unit(random);
    config.max_angle_rad[i] = kStart[i] + 0.05 + 3.0 * unit(random);
  }
  config.approach_gain_1_s = 5.0 + 40.0 * unit(random);
  config.stale_after = std::chrono::milliseconds(20 + random() % 70);
  return config;
}

TEST(ScriptAndOracle, AgreeCycleByCycleWhateverTheRegistersHold) {
  int tracking = 0;
  double largest = 0.0;
  for (unsigned seed = 1; seed <= 20; ++seed) {
    std::mt19937_64 random(seed);
    const rtde::ControlScriptConfig config = seed == 1 ? rtde::ControlScriptConfig{} : random_config(random);
    const Duration cycle = seed % 2 == 0 ? kCb3 : kESeries;
    Adversary adversary(seed);
    ScriptRunner script(kStart, config, cycle);
    RegisterOracle oracle(config);
    for (int i = 0; i < 4000; ++i) {
      const RegisterInputs in = adversary(oracle.outputs().q_rad);
      if (i == 0) oracle.start(kStart, in.sequence);  // the script is past its stop only now
      ASSERT_EQ(script.step(in), urscript::Outcome::kRunning) << script.program().error().text.c_str();
      const OracleOutputs& expected = oracle.step(in, cycle);
      ASSERT_EQ(script.out().state, expected.state) << "seed " << seed << " cycle " << i;
      ASSERT_EQ(script.out().fault, expected.fault) << "seed " << seed << " cycle " << i;
      ASSERT_EQ(script.out().sequence, expected.sequence);
      ASSERT_EQ(script.out().version, 1);
      largest = std::max(largest, (script.q() - expected.q_rad).cwiseAbs().maxCoeff());
      ASSERT_LT(largest, 1e-12) << "seed " << seed << " cycle " << i;
      tracking += expected.state == ProgramState::kTracking ? 1 : 0;
    }
  }
  RecordProperty("largest_difference_rad", std::to_string(largest));
  EXPECT_GT(tracking, 10'000) << "the values must get past arming, or this proves nothing";
}

}  // namespace
}  // namespace embody::sim
