#pragma once
// The composition root: this file and daemon.cpp are the thread diagram (docs/architecture.md).
#include <memory>
#include <string>
#include <vector>

#include "daemon/app/config.hpp"
#include "daemon/app/models.hpp"
#include "daemon/app/thread.hpp"
#include "daemon/loops/arm_loop.hpp"
#include "daemon/loops/edges.hpp"
#include "daemon/loops/finger_loop.hpp"
#include "daemon/loops/hand_loop.hpp"
#include "daemon/loops/links_loop.hpp"
#include "daemon/loops/telemetry_loop.hpp"
#include "daemon/loops/tracker_loop.hpp"
#include "daemon/loops/watchdog_loop.hpp"

namespace embody {

/// What the operating system granted.
struct RealtimeReport {
  bool scheduled{false};  ///< SCHED_FIFO on the real-time threads
  bool locked{false};     ///< memory is resident
  std::string warning;    ///< what is missing and how to get it; empty: nothing
};

/// Answer to an operator's request.
struct Decision {
  bool decided{false};  ///< in time; an engage or reset that was not is refused for good
  bool accepted{false};
  safety::ModeState mode;
};

class Daemon {
 public:
  /// Builds models, drivers and loops; nothing runs yet. Errors: configuration (kNotFound, kInvalidArgument, ...).
  static Result<std::unique_ptr<Daemon>> create(const config::EmbodyConfig& config);
  ~Daemon();

  /// Locks memory and starts all threads. Errors: kPermission in mode "enforce" without real-time rights.
  Status start();
  /// Brakes, disarms, ends all threads in reverse order of the data path, the arm last. Takes at most about 8 s.
  /// False when the arm could not be brought to rest in time (the robot then stops by itself).
  bool stop();

  /// Passes a request to the mode machine and waits for its decision (normally one robot cycle, at most 200 ms).
  Decision request(safety::RequestKind kind);
  /// Newest mode. Call from one thread only, the one that calls request().
  safety::ModeState mode();
  /// False when the watchdog found a hung loop, or has not come round itself since the last call. Call it at intervals
  /// of several watchdog periods (50 ms), from one thread.
  [[nodiscard]] bool healthy();
  /// A thread for upkeep ended by an exception.
  [[nodiscard]] bool failed() const noexcept { return edges_.failed.load(std::memory_order_relaxed); }
  [[nodiscard]] bool ever_connected() const { return links_->ever_connected(); }
  [[nodiscard]] std::vector<DeviceReport> devices() const { return links_->reports(); }
  /// Everything that `embodyctl status` shows, as one JSON object.
  [[nodiscard]] std::string status_json();
  /// Everything that `embodyctl markers` shows, as one JSON object.
  [[nodiscard]] std::string markers_json() const;

 private:
  Daemon(const config::EmbodyConfig& config, const Models& models, std::unique_ptr<HandTracker> tracker,
         std::unique_ptr<ArmDriver> arm, std::unique_ptr<HandDriver> hand, DdsPublisher publisher);
  [[nodiscard]] std::vector<Link> make_links();
  /// `body` whose exceptions are logged and end the daemon in order.
  [[nodiscard]] std::function<void()> guarded(const char* name, std::function<void()> body);
  [[nodiscard]] ThreadOptions options(const char* name, int priority, const std::vector<int>& cpus) const;
  [[nodiscard]] ThreadOptions finger_options() const;
  [[nodiscard]] ThreadOptions hand_options() const;

  config::EmbodyConfig config_;
  Edges edges_;
  // Declared in the order of construction; drivers outlive the loops that use them.
  std::unique_ptr<HandTracker> tracker_;
  std::unique_ptr<ArmDriver> arm_;
  std::unique_ptr<HandDriver> hand_;
  TrackerBaton tracker_baton_;
  ArmBaton arm_baton_;
  HandBaton hand_baton_;
  TrackerLoop tracker_loop_;
  FingerLoop finger_loop_;
  ArmLoop arm_loop_;
  HandLoop hand_loop_;
  WatchdogLoop watchdog_loop_;
  std::unique_ptr<TelemetryLoop> telemetry_;
  std::unique_ptr<LinksLoop> links_;

  RealtimeReport realtime_;
  TimePoint t_start_{};
  std::uint32_t request_id_{0};
  std::uint64_t last_watchdog_{0};
  bool running_{false};
  Thread links_thread_, telemetry_thread_, arm_thread_, hand_thread_, finger_thread_, tracker_thread_, watchdog_thread_;
};

}  // namespace embody
