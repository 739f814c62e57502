#pragma once
// A tracker of 21 hand landmarks that sends UDP datagrams (docs/landmarks.md) as a HandTracker.
#include <array>
#include <cstdint>
#include <string>

#include "core/hal/hand_tracker.hpp"
#include "core/teleop/clock_map.hpp"
#include "drivers/landmarks/codec.hpp"
#include "drivers/transport/udp.hpp"

namespace embody::landmarks {

inline constexpr std::uint16_t kDefaultPort = 21021;

struct LandmarkConfig {
  std::string address{"127.0.0.1"};  ///< of the interface to receive at, IPv4
  std::uint16_t port{kDefaultPort};  ///< 0: a free one, see port()
  double rate_hz{30.0};              ///< nominal frame rate of the sender
  Side side{Side::kRight};           ///< datagrams of the other hand are not used
};

/// What came and what of it was not used, since the driver exists.
struct LandmarkCounters {
  Counter received;    ///< datagrams, whatever they were
  Counter malformed;   ///< broke the format; dropped
  Counter foreign;     ///< from an address outside of the interface's network; dropped
  Counter other_hand;  ///< of the other hand; dropped
  Counter duplicates;  ///< same frame number as the one before; dropped
  Counter restarts;    ///< the frame number went back: the sender started again; used
};

/// Binds a socket; whoever sends valid datagrams from the interface's network is the sensor. There is no handshake, so
/// the session ends only when the socket breaks. Threads as HandTracker says; counters() from any.
class LandmarkTracker final : public HandTracker {
 public:
  explicit LandmarkTracker(LandmarkConfig config);

  /// Errors: kInvalidArgument, kNotFound (address), kIo (the port is taken).
  Result<TrackerInfo> connect() override;
  /// The sender has no upkeep: succeeds while there is a session.
  Status service() override;
  /// One frame per call: `markers[i]` is landmark i of core/hand/landmark_layout.hpp, not visible with confidence 0.
  /// `t_capture` is the sender's time mapped by the fastest arrivals of the session, or the arrival when it tells none.
  /// At most 16 datagrams that are not used are dropped per call; then kEmpty, though more may wait.
  IoStatus read(MarkerFrame& frame) noexcept override;

  [[nodiscard]] const LandmarkCounters& counters() const noexcept { return counters_; }
  /// Port of the present session, 0 without one.
  [[nodiscard]] std::uint16_t port() const noexcept { return port_; }

 private:
  [[nodiscard]] bool take(std::span<const std::byte> datagram, TimePoint t_arrival, MarkerFrame& frame) noexcept;
  [[nodiscard]] bool is_new(std::uint64_t frame_number) noexcept;

  LandmarkConfig config_;
  transport::UniqueFd fd_;
  transport::Network network_;
  std::uint16_t port_{0};
  teleop::ClockMap clock_;
  bool started_{false};  // a frame was used in this connection
  std::uint64_t last_frame_{0};
  std::uint32_t epoch_{0};
  LandmarkCounters counters_;
};

}  // namespace embody::landmarks
