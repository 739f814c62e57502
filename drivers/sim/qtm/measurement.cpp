#include "drivers/sim/qtm/measurement.hpp"

#include <algorithm>

#include "drivers/sim/qtm/command_words.hpp"

namespace embody::sim {
namespace {

Outcome refused(std::string text) {
  return {std::move(text), true, {}};
}
Outcome done(std::string text) {
  return {std::move(text), false, {}};
}

}  // namespace

Measurement::Measurement(bool playback, bool start_on_trigger, std::vector<std::string> files,
                         Duration calibration_time)
    : state_(playback ? State::kPlaying : State::kPreview),
      start_on_trigger_(start_on_trigger),
      files_(std::move(files)),
      calibration_time_(calibration_time),
      last_state_(playback ? QtmEvent::kPlaybackStarted : QtmEvent::kConnected) {}

Outcome Measurement::enter(State state, bool running, std::string reply, std::vector<QtmEvent> events) {
  state_ = state;
  running_ = running;
  for (const QtmEvent event : events) {
    if (tells_state(event)) last_state_ = event;
  }
  return {std::move(reply), false, std::move(events)};
}

Outcome Measurement::begin() {
  if (running_) return {};
  if (state_ == State::kPlaying || state_ == State::kFile) {
    return enter(State::kPlaying, true, {}, {QtmEvent::kPlaybackStarted});
  }
  return enter(State::kCapturing, true, {}, {QtmEvent::kCaptureStarted});
}

Outcome Measurement::end() {
  const bool capture = state_ == State::kCapturing;
  if (capture) unsaved_ = true;
  return enter(State::kFile, false, {}, {capture ? QtmEvent::kCaptureStopped : QtmEvent::kPlaybackStopped});
}

std::optional<Outcome> Measurement::command(std::string_view verb, const std::vector<std::string>& words,
                                            TimePoint now) {
  const std::string argument = words.size() > 1 ? words[1] : "";
  const std::string option = words.size() > 2 ? lower_case(words[2]) : "";
  if (words.size() > 3 || (words.size() > 2 && !(verb == "save" && option == "overwrite"))) return {};
  const bool named = !argument.empty();
  if (verb == "new" && !named) return create();
  if (verb == "close" && !named) return close();
  if (verb == "start" && (!named || lower_case(argument) == "rtfromfile")) return start(named);
  if (verb == "stop" && !named) return stop();
  if ((verb == "load" || verb == "loadproject") && named) {
    if (verb == "load") return load(argument);
    return running_ ? refused("Failed to load project") : done("Project loaded");
  }
  if (verb == "save" && named) return save(argument, !option.empty());
  if (verb == "trig" && !named) return trigger();
  if (verb == "setqtmevent" && named) {
    return state_ == State::kCapturing ? done("Event set") : refused("QTM is not capturing");
  }
  if (verb == "calibrate" && (!named || lower_case(argument) == "refine")) return calibrate(now);
  return {};
}

Outcome Measurement::create() {
  if (unsaved_) return refused("The previous measurement has not been saved or closed");
  if (state_ != State::kClosed && state_ != State::kFile) return done("Already connected");
  return enter(State::kPreview, false, "Creating new connection", {QtmEvent::kConnected});
}

Outcome Measurement::close() {
  if (state_ == State::kClosed) return refused("No connection to close");
  const bool file = state_ == State::kFile || state_ == State::kPlaying;
  std::vector<QtmEvent> events;
  if (running_) events.push_back(file ? QtmEvent::kPlaybackStopped : QtmEvent::kCaptureStopped);
  events.push_back(QtmEvent::kConnectionClosed);
  unsaved_ = false;
  return enter(State::kClosed, false, file ? "Closing file" : "Closing connection", std::move(events));
}

Outcome Measurement::start(bool from_file) {
  if (from_file) {
    if (state_ == State::kPlaying) return refused("RT from file already running");
    if (state_ != State::kFile) return refused("No file open");
    return enter(State::kPlaying, true, "Starting RT from file", {QtmEvent::kPlaybackStarted});
  }
  if (running_ || state_ == State::kWaitingForTrigger) return refused("Measurement is already running");
  if (state_ != State::kPreview) return refused("Not connected. Create connection with new");
  if (start_on_trigger_) {
    return enter(State::kWaitingForTrigger, false, "Starting measurement", {QtmEvent::kWaitingForTrigger});
  }
  return enter(State::kCapturing, true, "Starting measurement", {QtmEvent::kCaptureStarted});
}

Outcome Measurement::stop() {
  if (state_ == State::kWaitingForTrigger) {
    return enter(State::kPreview, false, "Stopping measurement", {QtmEvent::kConnected});
  }
  if (!running_) return refused("No measurement is running");
  Outcome outcome = end();
  outcome.reply = "Stopping measurement";
  return outcome;
}

Outcome Measurement::load(const std::string& file) {
  if (state_ != State::kClosed && state_ != State::kFile) return refused("Active camera connection exists");
  if (unsaved_) return refused("Current measurement not saved");
  if (std::find(files_.begin(), files_.end(), file) == files_.end()) return refused("Failed to load measurement");
  state_ = State::kFile;
  return done("Measurement loaded");
}

Outcome Measurement::save(const std::string& file, bool overwrite) {
  if (running_) return refused("Failed to save measurement");
  if (state_ != State::kFile) return refused("No measurement to save");
  constexpr std::size_t kMostFiles = 100;
  std::string name = file;
  for (int copy = 1; !overwrite && std::find(files_.begin(), files_.end(), name) != files_.end(); ++copy) {
    name = file + "_" + std::to_string(copy);
  }
  unsaved_ = false;
  if (files_.size() < kMostFiles && std::find(files_.begin(), files_.end(), name) == files_.end()) {
    files_.push_back(name);
  }
  return {name == file ? "Measurement saved" : "Measurement saved as '" + name + "'", false, {QtmEvent::kCaptureSaved}};
}

Outcome Measurement::trigger() {
  if (state_ != State::kWaitingForTrigger) return refused("QTM not waiting for trig");
  return enter(State::kCapturing, true, "Trig ok", {QtmEvent::kTrigger, QtmEvent::kCaptureStarted});
}

Outcome Measurement::calibrate(TimePoint now) {
  if (state_ != State::kPreview) return refused("Not connected. Create connection with new");
  t_calibrated_ = now + calibration_time_;
  return enter(State::kCalibrating, false, "Starting calibration", {QtmEvent::kCalibrationStarted});
}

std::optional<TimePoint> Measurement::calibration_end() const noexcept {
  if (state_ != State::kCalibrating) return {};
  return t_calibrated_;
}

Outcome Measurement::end_calibration() {
  return enter(State::kPreview, false, {}, {QtmEvent::kCalibrationStopped});
}

}  // namespace embody::sim
