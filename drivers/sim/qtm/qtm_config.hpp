#pragma once
// Settings of the simulated QTM.
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/base/time.hpp"
#include "drivers/sim/qtm/rigid_body.hpp"

namespace embody::sim {

struct QtmServerConfig {
  std::string address{"127.0.0.1"};
  std::uint16_t port{0};  ///< of the little-endian protocol, QTM's 22223; 0: a free one
  bool calibrated{true};
  std::string axis{"+Z"};           ///< AxisUpwards of the 3D parameters
  bool present_as_playback{false};  ///< state "RT from file" instead of a live measurement
  bool loop{false};                 ///< the motion starts again at its end; numbers and time stamps too

  // Other ports of QTM; nothing: not served; 0: a free one.
  std::optional<std::uint16_t> big_endian_port;  ///< QTM's 22224
  std::optional<std::uint16_t> legacy_port;      ///< QTM's 22222, protocol 1.0: refused with a sentence
  std::optional<std::uint16_t> discovery_port;   ///< QTM's 22226, UDP
  bool allow_remote{false};                      ///< UDP streams to, and discovery from, other computers

  /// Rigid bodies. When empty: one called "hand" by hand_top, hand_left and hand_right (BodyFrame::kMarkers), if the
  /// motion has these markers.
  std::vector<QtmBody> bodies;

  // Control by clients.
  bool control_enabled{true};
  std::string password;
  bool start_on_trigger{false};
  std::vector<std::string> files{"recording.qtm"};  ///< that can be loaded
  Duration calibration_time{std::chrono::milliseconds(500)};

  bool camera_time{false};  ///< component Timecode carries the camera time
};

}  // namespace embody::sim
