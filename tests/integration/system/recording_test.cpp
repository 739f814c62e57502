// The shipped recording is what its generator makes.
#include <gtest/gtest.h>

#include "daemon/simlab/demo_recording.hpp"
#include "drivers/recording/tsv_recording.hpp"

namespace embody::sim {
namespace {

TEST(ShippedRecording, EqualsWhatTheGeneratorMakesWithinAMicrometre) {
  const auto shipped = recording::load_tsv(std::string(EMBODY_SOURCE_DIR) + "/config/recordings/demo.tsv");
  ASSERT_TRUE(shipped.ok()) << shipped.error().detail.view();
  const recording::Recording made = make_demo_recording();
  ASSERT_EQ(shipped->marker_names, made.marker_names);
  ASSERT_EQ(shipped->frames.size(), made.frames.size());
  for (std::size_t k = 0; k < made.frames.size(); ++k) {
    for (std::size_t i = 0; i < made.marker_names.size(); ++i) {
      ASSERT_EQ(shipped->frames[k][i].visible, made.frames[k][i].visible) << k << " " << made.marker_names[i];
      if (!made.frames[k][i].visible) continue;
      ASSERT_LE((shipped->frames[k][i].p_W - made.frames[k][i].p_W).cwiseAbs().maxCoeff(), 1.0e-6)
          << k << " " << made.marker_names[i] << "; refresh with: embody-sim generate config/recordings/demo.tsv";
    }
  }
}

}  // namespace
}  // namespace embody::sim
