#pragma once
// Captures of the simulated devices, made with the real drivers through the proxies. They are short, so that one fits
// into the source tree as a fixture (docs/capture.md).
#include <string>
#include <vector>

namespace embody::test {

const std::vector<std::string>& captured_markers();
constexpr double kCapturedArmRate_hz = 125.0;

/// Each writes a capture to `path` and returns how many frames or states the driver had read by its end.
std::size_t capture_tracker(const std::string& path);
std::size_t capture_arm(const std::string& path);
std::size_t capture_hand(const std::string& path);

}  // namespace embody::test
