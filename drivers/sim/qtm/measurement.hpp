#pragma once
// The measurement of a simulated QTM: what its control commands do, and which events they cause. A plausible reading of
// the protocol document; not compared with a real QTM.
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/time.hpp"
#include "drivers/sim/qtm/wire.hpp"

namespace embody::sim {

/// What happened: the reply, whether it is an error, and the events for all clients, in order.
struct Outcome {
  std::string reply;
  bool error{false};
  std::vector<QtmEvent> events;
};

class Measurement {
 public:
  enum class State : std::uint8_t {
    kClosed,
    kPreview,  ///< cameras connected
    kWaitingForTrigger,
    kCapturing,
    kCalibrating,
    kFile,     ///< a file is open
    kPlaying,  ///< the file plays as if it were live
  };

  /// Connected cameras, or a file that plays (and waits for begin()). `files` can be loaded.
  Measurement(bool playback, bool start_on_trigger, std::vector<std::string> files, Duration calibration_time);

  [[nodiscard]] State state() const noexcept { return state_; }
  /// Frames are produced.
  [[nodiscard]] bool running() const noexcept { return running_; }
  /// What GetState answers.
  [[nodiscard]] QtmEvent last_state() const noexcept { return last_state_; }

  /// Starts the capture or the playing of the file, whichever it is ready for, without a client's command.
  [[nodiscard]] Outcome begin();
  /// The motion has ended.
  [[nodiscard]] Outcome end();
  /// A command in lower case, `argument` as written (empty: none). Nothing when it is no control command.
  [[nodiscard]] std::optional<Outcome> command(std::string_view verb, const std::vector<std::string>& words,
                                               TimePoint now);
  /// When the calibration that runs ends.
  [[nodiscard]] std::optional<TimePoint> calibration_end() const noexcept;
  /// The calibration has ended.
  [[nodiscard]] Outcome end_calibration();

 private:
  [[nodiscard]] Outcome enter(State state, bool running, std::string reply, std::vector<QtmEvent> events);
  [[nodiscard]] Outcome create();
  [[nodiscard]] Outcome close();
  [[nodiscard]] Outcome start(bool from_file);
  [[nodiscard]] Outcome stop();
  [[nodiscard]] Outcome load(const std::string& file);
  [[nodiscard]] Outcome save(const std::string& file, bool overwrite);
  [[nodiscard]] Outcome trigger();
  [[nodiscard]] Outcome calibrate(TimePoint now);

  State state_;
  bool running_{false};
  bool unsaved_{false};
  bool start_on_trigger_;
  std::vector<std::string> files_;
  Duration calibration_time_;
  TimePoint t_calibrated_{};
  QtmEvent last_state_;
};

}  // namespace embody::sim
