#pragma once
// A simulated Qualisys Track Manager: plays a motion over real sockets with the bytes of the real-time protocol 1.8 to
// 1.28 (both byte orders, TCP and UDP), and fails on request. Unlike QTM it serves no protocol before 1.8: a client
// that asks for data without having sent `Version` is refused instead of getting 64-bit coordinates. Nothing here was
// compared with a real QTM.
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.hpp"
#include "core/base/time.hpp"
#include "drivers/sim/qtm/motion.hpp"
#include "drivers/sim/qtm/qtm_config.hpp"

namespace embody::sim {

/// One frame that went to at least one client.
struct SentFrame {
  std::size_t index{0};  ///< in the motion
  TimePoint t_sent{};    ///< just before the first send()
};

/// Own thread, one poll loop, absolute deadlines. All functions may be called from any thread after start().
class QtmServer {
 public:
  QtmServer(QtmServerConfig config, recording::Recording recording);
  QtmServer(QtmServerConfig config, Motion motion);
  QtmServer(const QtmServer&) = delete;
  QtmServer& operator=(const QtmServer&) = delete;
  ~QtmServer();  ///< closes all connections and joins the thread

  /// Listens and starts the thread. Errors: kInvalidArgument (address, empty motion, body), kIo (port taken).
  [[nodiscard]] Status start();
  [[nodiscard]] std::uint16_t port() const noexcept;  ///< little endian
  [[nodiscard]] std::uint16_t big_endian_port() const noexcept;
  [[nodiscard]] std::uint16_t legacy_port() const noexcept;
  [[nodiscard]] std::uint16_t discovery_port() const noexcept;

  /// Plays the motion once from now on (for ever with `loop`): frame k goes to every streaming client at t0 + k / rate.
  /// Before and after it clients get NoMoreData. Further calls change nothing. A master client can stop and start it.
  void play();

  [[nodiscard]] bool has_streaming_client() const;
  [[nodiscard]] bool finished() const;  ///< the motion has come to its end
  [[nodiscard]] std::size_t frames_sent() const;
  [[nodiscard]] std::vector<SentFrame> log() const;  ///< a copy; of the first million frames

  /// Makes something go wrong, from the next frame on: see fault_help() in fault_words.hpp for the words.
  /// Errors: kInvalidArgument (words), kNotFound (no such marker or label).
  Status fault(std::string_view words);
  /// Faults at given times of every measurement from the next frame on; replaces the present script, faults that have
  /// already happened stay. Errors name the line; nothing changes then.
  [[nodiscard]] Status set_fault_script(std::string_view text);

  // The faults that programs use most, without words.

  /// No data for `duration`; sockets stay open, commands are answered, frames due meanwhile are lost.
  void pause(Duration duration);
  /// Closes every connection; new ones are accepted.
  void disconnect_clients();
  /// The marker is missing from the next frame on, until shown again. False: no such marker.
  bool set_marker_hidden(std::string_view name, bool hidden);
  /// Each of the two labels follows the other one's marker; again: as before. False: no such labels.
  bool swap_labels(std::string_view a, std::string_view b);
  /// The marker is a reflection that stands still in the room, 0.1 m from where the marker is in the next frame. False:
  /// no such marker.
  bool set_ghost(std::string_view name, bool on);
  /// The label list changes without an event, as when somebody edits it in QTM. False: no such label.
  bool rename_label(std::string_view from, std::string_view to);

 private:
  class Loop;
  std::unique_ptr<Loop> loop_;
};

}  // namespace embody::sim
