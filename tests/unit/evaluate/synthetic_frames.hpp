#pragma once
// The made-up recording of the demo as frames, and the models that fit it.
#include <gtest/gtest.h>

#include <vector>

#include "core/hand/synthetic_motion.hpp"
#include "daemon/app/operator_models.hpp"

namespace embody::test {

inline std::vector<MarkerFrame> synthetic_frames(std::size_t first, std::size_t count) {
  const hand::SyntheticMotion motion;
  std::vector<MarkerFrame> frames;
  for (std::size_t k = first; k < first + count; ++k) frames.push_back(motion.frame(k).markers);
  return frames;
}

/// Of `config`, which must be acceptable.
inline OperatorModels models_of(const config::EmbodyConfig& config = {}) {
  Result<OperatorModels> models = make_operator_models(config);
  EXPECT_TRUE(models.ok()) << models.error().detail.view();
  return models.ok() ? *models : OperatorModels{};
}

}  // namespace embody::test
