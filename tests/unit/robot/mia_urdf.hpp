#pragma once
// The shipped Mia description as text.
#include <fstream>
#include <iterator>
#include <string>

namespace embody::test {

inline std::string mia_urdf() {
  std::ifstream file(EMBODY_SOURCE_DIR "/config/hands/mia.urdf");
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

}  // namespace embody::test
