#pragma once
// A simulated Qualisys Track Manager: plays a recording over real sockets with the bytes of the real-time protocol
// 1.8 to 1.28 (little-endian port, TCP, components 3D and 3DRes). Unlike QTM it serves no protocol before 1.8: a client
// that asks for data without having sent `Version` is refused instead of getting 64-bit coordinates.
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.hpp"
#include "core/base/time.hpp"
#include "drivers/recording/recording.hpp"

namespace embody::sim {

struct QtmServerConfig {
  std::string address{"127.0.0.1"};
  std::uint16_t port{0};  ///< 0: a free one
  bool calibrated{true};
  std::string axis{"+Z"};           ///< AxisUpwards of the 3D parameters
  bool present_as_playback{false};  ///< state "RT from file" instead of a live measurement
};

/// One frame that went to at least one client.
struct SentFrame {
  std::size_t index{0};  ///< in the recording
  TimePoint t_sent{};    ///< just before the first send()
};

/// Own thread, one poll loop, absolute deadlines. All functions may be called from any thread after start().
class QtmServer {
 public:
  QtmServer(QtmServerConfig config, recording::Recording recording);
  QtmServer(const QtmServer&) = delete;
  QtmServer& operator=(const QtmServer&) = delete;
  ~QtmServer();  ///< closes all connections and joins the thread

  /// Listens and starts the thread. Errors: kInvalidArgument (address, empty recording), kIo (port taken).
  [[nodiscard]] Status start();
  [[nodiscard]] std::uint16_t port() const noexcept;

  /// Plays the recording once from now on: frame k goes to every streaming client at t0 + k / rate. Before and after it
  /// clients get NoMoreData. Further calls change nothing.
  void play();

  [[nodiscard]] bool has_streaming_client() const;
  [[nodiscard]] bool finished() const;  ///< the last frame's time has passed
  [[nodiscard]] std::size_t frames_sent() const;
  [[nodiscard]] std::vector<SentFrame> log() const;  ///< a copy

  /// Fault: no data for `duration`; sockets stay open, commands are answered, frames due meanwhile are skipped.
  void pause(Duration duration);
  /// Fault: closes every connection; new ones are accepted.
  void disconnect_clients();
  /// Fault: the marker is missing from the next frame on, until shown again. False: no such label.
  bool set_marker_hidden(std::string_view name, bool hidden);
  /// Fault: from the next frame on each of the two labels follows the other one's marker; again: as before. False: no
  /// such labels.
  bool swap_labels(std::string_view a, std::string_view b);
  /// Fault: from the next frame on the label follows a reflection that stands still in the room, 0.1 m from where the
  /// marker is in that frame, until switched off. False: no such label.
  bool set_ghost(std::string_view name, bool on);
  /// Fault: the label list changes without an event, as when somebody edits it in QTM. False: no such label.
  bool rename_label(std::string_view from, std::string_view to);

 private:
  class Loop;
  std::unique_ptr<Loop> loop_;
};

}  // namespace embody::sim
