#pragma once
// Version of the product; set by CMake, so that it works without git.

namespace embody {

inline constexpr const char* kVersion = EMBODY_VERSION;

}  // namespace embody
