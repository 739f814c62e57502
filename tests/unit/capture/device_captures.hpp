#pragma once
// Captures of the simulated devices, made with the real drivers through the proxies. They are short, so that one fits
// into the source tree as a fixture (docs/capture.md).
#include <string>
#include <vector>

namespace embody::test {

const std::vector<std::string>& captured_markers();
constexpr double kCapturedArmRate_hz = 125.0;
// Positions between two questions for currents or forces, 0: none. Said here, since a replay answers only what was
// asked when it was recorded: a driver with another default would wait for answers that are not in the fixture.
constexpr unsigned kSerialTelemetry_cycles = 0;
constexpr unsigned kTunnelTelemetry_cycles = 4;

/// Each writes a capture to `path` and returns how many frames or states the driver had read by its end.
std::size_t capture_tracker(const std::string& path);
std::size_t capture_arm(const std::string& path);
std::size_t capture_hand(const std::string& path);
std::size_t capture_can_tunnel(const std::string& path);  ///< the serial protocol in segments of our own
std::size_t capture_can_compact(const std::string& path);

}  // namespace embody::test
