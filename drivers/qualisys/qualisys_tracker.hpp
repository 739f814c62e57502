#pragma once
// Qualisys Track Manager (QTM) as a hand tracker, over its real-time protocol 1.8 to 1.28 (Qualisys, "QTM RT Server
// Protocol Documentation"). Two TCP connections: one streams frames to the tracker loop (or carries events while frames
// come over UDP), the other carries parameters, so that no XML ever reaches the loop.
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/hal/hand_tracker.hpp"
#include "drivers/qualisys/codec.hpp"
#include "drivers/qualisys/setup_check.hpp"

namespace embody::qualisys {

enum class Transport : std::uint8_t { kTcp, kUdp };

struct QualisysConfig {
  std::string host{"127.0.0.1"};
  std::uint16_t port{22223};                  ///< QTM's base port (22222) plus one: little endian; plus two: big endian
  ByteOrder byte_order{ByteOrder::kLittle};   ///< of that port
  Transport transport{Transport::kTcp};       ///< of frames
  std::string udp_address;                    ///< IPv4 to receive datagrams at; empty: where the connection to QTM is
  std::uint16_t udp_port{0};                  ///< 0: a free one
  std::string rigid_body;                     ///< becomes MarkerFrame::body; empty: none
  std::vector<std::string> optional_markers;  ///< slots that stay not visible where QTM has no such label
  bool allow_playback{false};                 ///< accept frames that QTM plays back from a file
  Duration reply_timeout{std::chrono::seconds(2)};
  /// Frames are skipped, up to the newest, once those waiting are as old as this.
  Duration backlog_limit{std::chrono::milliseconds(100)};
};

/// What came and what of it was not used, since the driver exists.
struct QualisysCounters {
  Counter frames;           ///< handed to the loop
  Counter skipped;          ///< frames left out to catch up with the newest
  Counter drains;           ///< times that frames were left out
  Counter missing;          ///< frame numbers that were passed over: lost datagrams, or QTM left frames out
  Counter useless;          ///< packets out of order or twice
  Counter incomplete;       ///< frames of which a component never came
  Counter foreign;          ///< datagrams of other hosts
  Counter malformed;        ///< datagrams that break the format
  Counter other_packets;    ///< packets that are neither frames nor events
  Counter clock_restarts;   ///< QTM's time went back or leapt
  Counter doubtful_events;  ///< events that began a new label epoch
  Counter label_epochs;     ///< begun: one per session, doubtful event and clock restart
};

/// One session with QTM. Threads as HandTracker says: connect() and service() on one thread, read() on another.
/// Errors of connect() and service() are sentences for the operator; nothing is sent that changes QTM's state.
class QualisysTracker final : public HandTracker {
 public:
  /// `marker_names[i]` becomes `MarkerFrame::markers[i]`: at most kMaxMarkers distinct names.
  QualisysTracker(QualisysConfig config, std::vector<std::string> marker_names);
  ~QualisysTracker() override;

  /// Opens both connections, checks calibration, axis (+Z up), labels, rigid body and what QTM is doing, and asks for
  /// all frames. Takes at most 5 s, 2 s where nobody answers, except that resolving a host *name* takes as long as the
  /// system's resolver does. TrackerInfo::peer names what in QTM's settings may keep frames away.
  /// Errors: kInvalidArgument (names, address), kNotFound (host, markers, body), kDisconnected, kTimeout, kUnsupported
  /// (version), kRefused (not calibrated, wrong axis, playback, ...), kMalformed.
  Result<TrackerInfo> connect() override;

  /// Reads the parameters and the state again. The session ends (read() then returns kDisconnected, and connect()
  /// validates anew) when labels, axis, calibration, rate, rigid bodies or processing changed, of which QTM itself
  /// tells nobody; when QTM measures, but sent nothing for 3 s; when frames over UDP do not begin within 1 s.
  Status service() override;

  /// One frame per call, in order. `t_capture` is the sensor's time stamp mapped by the fastest arrivals, so it is late
  /// by the shortest latency of the session. `label_epoch` changes with each session, with events after which labels
  /// may mean something else, and when QTM's clock starts anew. Ends the session when the number of markers or bodies
  /// changes, when QTM calibrates, reprocesses, closes its cameras or itself, or plays back and may not, when frames
  /// lag by more than a second for a second, or when bytes break the protocol.
  IoStatus read(MarkerFrame& frame) noexcept override;

  /// From any thread.
  [[nodiscard]] const QualisysCounters& counters() const noexcept { return counters_; }

 private:
  struct Session;
  enum class Taken { kNothing, kFrame, kEnd };

  Status upkeep();
  Status check_flow(Event state) const;
  Taken take_packet(std::span<const std::byte> packet, MarkerFrame& frame) noexcept;
  Taken take_event(std::span<const std::byte> packet) noexcept;
  Taken take_data(std::span<const std::byte> packet, MarkerFrame& frame) noexcept;
  Taken fill(const DataPacket& data, MarkerFrame& frame) noexcept;
  void begin_label_epoch() noexcept;
  void count_missing(std::uint64_t frame_number) noexcept;
  void count_session() noexcept;
  Taken end_session(const Error& error) noexcept;
  [[nodiscard]] bool is_backlog(Duration age) noexcept;
  IoStatus deliver(const MarkerFrame& frame, std::uint64_t waiting) noexcept;

  QualisysConfig config_;
  Wanted wanted_;
  QualisysCounters counters_;
  QualisysCounters before_;  ///< at the last connect()
  std::unique_ptr<Session> session_;
  std::uint32_t label_epoch_{0};
};

}  // namespace embody::qualisys
