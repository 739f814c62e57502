#include "daemon/ctl/collect_frames.hpp"

#include <poll.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

#include "drivers/transport/clock.hpp"

namespace embody::ctl {
namespace {

using std::chrono::seconds;
using transport::now;

constexpr Duration kPoll = std::chrono::milliseconds(50);

class Collection {
 public:
  Collection(HandTracker& tracker, const hand::GloveLayout& layout, const CollectOptions& options, StopSignals& signals,
             const TrackerInfo& info)
      : tracker_(tracker), layout_(layout), options_(options), signals_(signals), info_(info) {
    const double expected = info.rate_hz * to_seconds(options.duration);
    stride_ = 1 + static_cast<std::size_t>(std::max(0.0, expected) / static_cast<double>(kMostCollected));
  }

  Result<Collected> run() {
    t_frame_ = now();
    t_service_ = now() + seconds(1);
    std::printf("Connected to %.*s. Hold your hand so that all markers are seen.\n",
                static_cast<int>(info_.peer.view().size()), info_.peer.view().data());
    if (const Status s = phase("starting in", options_.countdown, false); !s) return s.error();
    if (!out_.interrupted) {
      std::printf(
          "Go: keep the back of the hand in view. Bend and stretch every finger as far as it goes, one by one and\n"
          "together; spread them; circle the thumb and touch each finger tip with it.\n");
      if (const Status s = phase("left", options_.duration, true); !s) return s.error();
    }
    return std::move(out_);
  }

 private:
  /// One stretch of time with a line per second.
  Status phase(const char* word, Duration duration, bool keep) {
    const TimePoint t_end = now() + duration;
    TimePoint t_line = now();
    while (now() < t_end && !out_.interrupted) {
      if (now() >= t_line) {
        const auto left_s = static_cast<int>(std::ceil(to_seconds(t_end - now()) - 1e-3));
        std::printf("  %s %d s, %zu of %zu markers seen\n", word, left_s, seen_, layout_.names.size());
        std::fflush(stdout);
        t_line += seconds(1);
      }
      if (const Status s = wait_and_read(keep); !s) return s;
    }
    return {};
  }

  Status wait_and_read(bool keep) {
    pollfd entries[2] = {{signals_.fd(), POLLIN, 0}, {info_.fd, POLLIN, 0}};
    ::poll(entries, 2, static_cast<int>(kPoll / std::chrono::milliseconds(1)));
    if (signals_.take() != 0) out_.interrupted = true;
    if (now() >= t_service_) {
      if (const Status s = tracker_.service(); !s) return s;
      t_service_ = now() + seconds(1);
    }
    MarkerFrame frame;
    for (int i = 0; i < 1000 && !out_.interrupted; ++i) {  // bounded: frames may come faster than they are read
      const IoStatus status = tracker_.read(frame);
      if (status == IoStatus::kDisconnected) {
        return make_error(Errc::kDisconnected, "the tracker ended the session: %.200s",
                          std::string(tracker_.reason()).c_str());
      }
      if (status != IoStatus::kDone) break;
      take(frame, keep);
    }
    if (now() - t_frame_ <= options_.silence) return {};
    return make_error(Errc::kTimeout, "no frame from the tracker for %.0f s: start the measurement or its preview",
                      to_seconds(options_.silence));
  }

  void take(const MarkerFrame& frame, bool keep) {
    t_frame_ = now();
    seen_ = static_cast<std::size_t>(std::count_if(frame.markers.begin(), frame.markers.begin() + frame.count,
                                                   [](const Marker& marker) { return marker.visible; }));
    if (keep && read_++ % stride_ == 0 && out_.frames.size() < kMostCollected) out_.frames.push_back(frame);
  }

  HandTracker& tracker_;
  const hand::GloveLayout& layout_;
  const CollectOptions& options_;
  StopSignals& signals_;
  const TrackerInfo info_;
  Collected out_;
  std::size_t stride_{1};
  std::size_t read_{0};
  std::size_t seen_{0};
  TimePoint t_frame_{};
  TimePoint t_service_{};
};

}  // namespace

Result<Collected> collect_frames(HandTracker& tracker, const hand::GloveLayout& layout, const CollectOptions& options,
                                 StopSignals& signals) {
  const Result<TrackerInfo> info = tracker.connect();
  if (!info) return info.error();
  return Collection(tracker, layout, options, signals, *info).run();
}

}  // namespace embody::ctl
