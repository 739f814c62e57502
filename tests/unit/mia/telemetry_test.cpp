#include "drivers/mia/telemetry.hpp"

#include <gtest/gtest.h>

namespace embody::mia {
namespace {

constexpr TimePoint kNow{std::chrono::seconds(100)};

TelemetryConfig every(unsigned cycles) {
  TelemetryConfig config;
  config.every_cycles = cycles;
  return config;
}

TEST(MiaTelemetry, AsksForCurrentsAndForcesInTurnEverySoManyCycles) {
  TelemetryReader reader(every(3));
  std::string asked;
  for (int i = 0; i < 12; ++i) {
    reader.count_cycle();
    while (const char channel = reader.next_channel()) asked += channel;
  }
  EXPECT_EQ(asked, "CACA");
  TelemetryConfig forces = every(1);
  forces.currents = false;
  TelemetryReader only_forces(forces);
  for (int i = 0; i < 3; ++i) {
    only_forces.count_cycle();
    EXPECT_EQ(only_forces.next_channel(), 'A');
  }
  TelemetryReader off{every(0)};
  off.count_cycle();
  EXPECT_EQ(off.next_channel(), '\0');
}

TEST(MiaTelemetry, DoesNotAskForEverWhatNobodyAnswers) {
  TelemetryReader reader(every(1));
  for (int i = 0; i < 3; ++i) reader.missed('A');
  for (int i = 0; i < 4; ++i) {
    reader.count_cycle();
    EXPECT_EQ(reader.next_channel(), 'C');
  }
  reader.begin();
  EXPECT_TRUE(reader.wants('A')) << "a new session asks again";
}

TEST(MiaTelemetry, PutsEachFieldWhereTheConfigurationSays) {
  TelemetryReader reader(every(1));
  ASSERT_TRUE(reader.take(encode_strain_gauges({1, 2, 3, 4, 5, 6, 7, 8}).view(), kNow));
  const MiaTelemetry& data = reader.data();
  EXPECT_EQ(data.force[0].normal, 5);
  EXPECT_EQ(data.force[0].tangential, 4);
  EXPECT_EQ(data.force[1].normal, 2);
  EXPECT_EQ(data.force[1].tangential, 3);
  EXPECT_EQ(data.force[2].normal, 6);
  EXPECT_EQ(data.force[2].tangential, 1);
  TelemetryConfig other = every(1);
  std::swap(other.strain_fields[1], other.strain_fields[2]);
  TelemetryReader swapped(other);
  ASSERT_TRUE(swapped.take(encode_strain_gauges({1, 2, 3, 4, 5, 6, 7, 8}).view(), kNow));
  EXPECT_EQ(swapped.data().force[1].normal, 3);
  ASSERT_TRUE(reader.take(encode_triple(TripleLine::kCurrent, {10, 20, 1024}).view(), kNow));
  EXPECT_EQ(data.current, (std::array<int, 3>{10, 20, 1024}));
  EXPECT_FALSE(reader.take("a rubbish line\n", kNow));
  EXPECT_EQ(data.force_samples, 1u);
}

TEST(MiaTelemetry, TareTakesTheMeanOfTheNextReadingsForZero) {
  TelemetryReader reader(every(1));
  const auto feed = [&reader](int base) {
    std::array<int, kStrainFields> values{};
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = base + static_cast<int>(i);
    ASSERT_TRUE(reader.take(encode_strain_gauges(values).view(), kNow));
  };
  feed(200);
  EXPECT_EQ(reader.data().force[0].normal, 204);
  reader.tare();
  for (int i = 0; i < TelemetryReader::kTareSamples; ++i) feed(i % 2 == 0 ? 198 : 202);
  EXPECT_EQ(reader.data().tares, 1u);
  feed(200);
  for (const FingerForce& force : reader.data().force) {
    EXPECT_EQ(force.normal, 0);
    EXPECT_EQ(force.tangential, 0);
  }
  reader.begin();
  feed(230);
  EXPECT_EQ(reader.data().force[1].normal, 30) << "offsets outlive the session";
}

TEST(MiaTelemetry, RefusesAFieldOrderThatIsNoOrder) {
  EXPECT_TRUE(check(TelemetryConfig{}).ok());
  TelemetryConfig config;
  config.strain_fields[0] = StrainField::kUnused;
  EXPECT_FALSE(check(config).ok());
  config = {};
  config.strain_fields[6] = StrainField::kMrlNormal;
  EXPECT_FALSE(check(config).ok());
}

}  // namespace
}  // namespace embody::mia
