#include "daemon/loops/links_loop.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <thread>

#include "drivers/transport/clock.hpp"

namespace embody {

using transport::now;

LinksLoop::LinksLoop(std::vector<Link> links, const LinksConfig& config, const Edges& edges)
    : config_(config), edges_(edges) {
  for (Link& link : links) {
    DeviceReport report;
    report.name = link.name;
    entries_.push_back({std::move(link), std::move(report), config.retry_first, {}, false});
  }
}

void LinksLoop::run() {
  while (!edges_.stop.load(std::memory_order_relaxed)) {
    for (Entry& entry : entries_) {
      if (edges_.stop.load(std::memory_order_relaxed)) return;
      step(entry);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
}

void LinksLoop::step(Entry& entry) {
  const bool ours = entry.link.with_links();
  if (ours && entry.was_connected) note_loss(entry);
  if (now() < entry.t_next) return;
  if (ours) return connect(entry);
  entry.t_next = now() + std::chrono::seconds(1);
  if (!entry.link.service) return;
  const Status status = entry.link.service();
  const std::string detail(status ? std::string_view{} : status.error().detail.view());
  const bool news = detail != entry.report.detail;  // only this thread writes it
  if (news && !status) spdlog::warn("{}: {}", entry.link.name, detail);
  if (news && status) spdlog::info("{}: in order again", entry.link.name);
  if (news) {
    const std::lock_guard lock(mutex_);
    entry.report.detail = detail;
  }
  if (!status && entry.link.service_ends_session) entry.link.revoke();
}

void LinksLoop::connect(Entry& entry) {
  Result<std::string> peer = entry.link.connect();
  const std::lock_guard lock(mutex_);
  if (!peer) {
    const std::string detail(peer.error().detail.view());
    if (detail != entry.report.detail) spdlog::warn("{}: {}", entry.link.name, detail);
    entry.report.detail = detail;
    entry.t_next = now() + entry.backoff;
    entry.backoff = std::min(2 * entry.backoff, config_.retry_longest);
    return;
  }
  spdlog::info("{}: connected to {}", entry.link.name, *peer);
  entry.report.connected = true;
  entry.report.peer = *peer;
  entry.report.detail.clear();
  ++entry.report.sessions;
  entry.was_connected = true;
  entry.backoff = config_.retry_first;
  entry.t_next = now() + std::chrono::seconds(1);
  ever_connected_ = ever_connected_ || std::all_of(entries_.begin(), entries_.end(),
                                                   [](const Entry& each) { return each.report.connected; });
}

void LinksLoop::note_loss(Entry& entry) {
  std::string reason = entry.link.reason();
  if (reason.empty()) reason = "the connection ended";
  spdlog::warn("{}: session over: {}", entry.link.name, reason);
  const std::lock_guard lock(mutex_);
  entry.was_connected = false;
  entry.report.connected = false;
  entry.report.detail = std::move(reason);
  entry.t_next = now() + entry.backoff;
}

std::vector<DeviceReport> LinksLoop::reports() const {
  const std::lock_guard lock(mutex_);
  std::vector<DeviceReport> reports;
  for (const Entry& entry : entries_) reports.push_back(entry.report);
  return reports;
}

bool LinksLoop::ever_connected() const {
  const std::lock_guard lock(mutex_);
  return ever_connected_;
}

}  // namespace embody
