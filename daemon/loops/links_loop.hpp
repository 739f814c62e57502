#pragma once
// Everything that may block: connecting, handshakes and slow upkeep of the devices. Normal scheduling.
#include <functional>
#include <mutex>
#include <string>
#include <vector>

#include "daemon/loops/edges.hpp"

namespace embody {

/// A device as the links thread sees it. Functions are called on that thread only.
struct Link {
  std::string name;                              ///< "tracker", "arm", "hand"
  std::function<bool()> with_links;              ///< no session: ours to connect
  std::function<Result<std::string>()> connect;  ///< connects and passes the driver to its loop; returns the peer
  std::function<Status()> service;               ///< about once a second while connected; may be empty
  bool service_ends_session{true};               ///< when it fails; otherwise that is only said
  std::function<void()> revoke;                  ///< asks the loop to give the driver back
  std::function<std::string()> reason;           ///< why the last session ended
};

/// State of a device for people.
struct DeviceReport {
  std::string name;
  bool connected{false};
  std::string peer;
  std::string detail;  ///< last problem, empty when there is none
  std::uint64_t sessions{0};
};

struct LinksConfig {
  Duration retry_first{std::chrono::milliseconds(250)};
  Duration retry_longest{std::chrono::seconds(2)};
};

class LinksLoop {
 public:
  LinksLoop(std::vector<Link> links, const LinksConfig& config, const Edges& edges);
  /// Until edges.stop.
  void run();

  // Any thread.
  [[nodiscard]] std::vector<DeviceReport> reports() const;
  /// All devices were connected at once at some time.
  [[nodiscard]] bool ever_connected() const;

 private:
  struct Entry {
    Link link;
    DeviceReport report;
    Duration backoff;
    TimePoint t_next{};
    bool was_connected{false};
  };
  void step(Entry& entry);
  void connect(Entry& entry);
  void note_loss(Entry& entry);

  std::vector<Entry> entries_;
  LinksConfig config_;
  const Edges& edges_;
  mutable std::mutex mutex_;  // of the reports
  bool ever_connected_{false};
};

}  // namespace embody
