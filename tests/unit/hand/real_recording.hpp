#pragma once
// A real recording of the 13-marker glove, which lives outside of the product: tests that use it are skipped without
// it.
#include <vector>

#include "core/hand/glove_layout.hpp"

namespace embody::test {

/// Frames of the Qualisys text export `path` in the slots of `glove`, m. Empty when the file is not there or holds no
/// such markers.
[[nodiscard]] std::vector<MarkerFrame> read_recording(const char* path, const hand::GloveLayout& glove);

/// All 13 markers of frame 1 of that recording, m, in the slots of paper_glove().
[[nodiscard]] MarkerFrame first_real_frame();

}  // namespace embody::test
