#pragma once
// Qualisys Track Manager (QTM) as a hand tracker, over its real-time protocol 1.25 (Qualisys, "QTM RT Server Protocol
// Documentation"). Two TCP connections: one streams marker frames to the tracker loop, the other carries parameters,
// so that no XML ever reaches the loop.
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/hal/hand_tracker.hpp"

namespace embody::qualisys {

struct QualisysConfig {
  std::string host{"127.0.0.1"};
  std::uint16_t port{22223};   ///< QTM's little-endian port: its base port (22222) plus one
  bool allow_playback{false};  ///< accept frames that QTM plays back from a file
  Duration reply_timeout{std::chrono::seconds(2)};
};

/// One session with QTM. Threads as HandTracker says: connect() and service() on one thread, read() on another.
/// Errors of connect() and service() are sentences for the operator; nothing is sent that changes QTM's state.
class QualisysTracker final : public HandTracker {
 public:
  /// `marker_names[i]` becomes `MarkerFrame::markers[i]`: at most kMaxMarkers distinct names.
  QualisysTracker(QualisysConfig config, std::vector<std::string> marker_names);
  ~QualisysTracker() override;

  /// Opens both connections, checks calibration, axis (+Z up), labels and playback, and asks for all frames. Takes at
  /// most 5 s, except that resolving a host *name* takes as long as the system's resolver does.
  /// Errors: kInvalidArgument (names), kNotFound (host, markers), kDisconnected, kTimeout, kUnsupported (version),
  /// kRefused (not calibrated, wrong axis, playback), kMalformed.
  Result<TrackerInfo> connect() override;

  /// Reads the 3D parameters again. A change of labels, axis or calibration ends the session: read() then returns
  /// kDisconnected, and connect() validates anew. QTM itself tells nobody when labels change.
  Status service() override;

  /// One frame per call, in order. `t_capture` is the sensor's time stamp mapped by the fastest arrivals, so it is late
  /// by the shortest latency of the session. Ends the session when the number of markers changes, when playback starts
  /// and is not allowed, or when bytes break the protocol.
  IoStatus read(MarkerFrame& frame) noexcept override;

 private:
  struct Session;
  IoStatus end_session(const Error& error) noexcept;
  IoStatus take_packet(std::span<const std::byte> packet, MarkerFrame& frame) noexcept;
  IoStatus take_data(std::span<const std::byte> packet, MarkerFrame& frame) noexcept;

  QualisysConfig config_;
  std::vector<std::string> marker_names_;
  std::unique_ptr<Session> session_;
  std::uint32_t label_epoch_{0};
};

}  // namespace embody::qualisys
