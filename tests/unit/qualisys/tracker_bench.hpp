#pragma once
// A tracker that is connected to a FakeQtm, and frames whose content tells which frame it is.
#include <gtest/gtest.h>

#include <cstdio>
#include <optional>

#include "drivers/qualisys/qualisys_tracker.hpp"
#include "drivers/transport/clock.hpp"
#include "drivers/transport/tcp.hpp"
#include "tests/unit/qualisys/fake_qtm.hpp"
#include "tests/unit/qualisys/support.hpp"

namespace embody::test {

inline bool has(std::string_view text, std::string_view part) {
  return text.find(part) != std::string_view::npos;
}

/// One line of the list of faults: what was done, how long until it was noticed, what happened, how it goes on.
inline void tell_fault(const char* fault, Duration detected, std::string_view reaction, const char* recovery) {
  std::printf("FAULT | tracker (QTM) | %s | %.1f ms | %.*s | %s\n", fault, 1e3 * to_seconds(detected),
              static_cast<int>(reaction.size()), reaction.data(), recovery);
}

struct TrackerBench {
  explicit TrackerBench(std::size_t markers = 3, FakeQtmSettings settings = {},
                        const qualisys::QualisysConfig& tracker_config = {})
      : config(tracker_config) {
    for (std::size_t i = 0; i < markers; ++i) settings.labels.push_back("m" + std::to_string(i));
    names = settings.labels;
    has_body = !config.rigid_body.empty();
    config.byte_order = settings.order;
    qtm.emplace(std::move(settings));
    config.port = qtm->port();
    tracker.emplace(config, names);
  }
  /// Connects and waits until QTM knows that we want frames.
  Result<TrackerInfo> connect() {
    auto info = tracker->connect();
    EXPECT_TRUE(info.ok()) << info.error().detail.c_str();
    EXPECT_TRUE(eventually([&] { return qtm->streaming(); }));
    fd = info.ok() ? info->fd : -1;
    return info;
  }
  /// Frame k: time stamp k periods, marker i at (i, k, 1) mm, the body at (k, 0, 0) mm.
  [[nodiscard]] WireFrame frame(std::uint64_t k, std::uint64_t period_us = 10'000) const {
    WireFrame wire{k * period_us, static_cast<std::uint32_t>(k), 0, 0, {{9, {}, {}}}};
    for (std::size_t i = 0; i < names.size(); ++i) {
      wire.parts[0].items.push_back({static_cast<float>(i), static_cast<float>(k), 1.0F, 0.5F});
    }
    Pose X_W = Pose::Identity();
    X_W.translation().x() = 1e-3 * static_cast<double>(k);
    if (has_body) wire.parts.push_back({11, {wire_body(X_W, 0.5F)}, {}});
    return wire;
  }
  IoStatus next(MarkerFrame& into) { return next_frame(*tracker, fd, into); }
  /// Reads and expects frame k.
  void expect(std::uint64_t k) {
    MarkerFrame got;
    ASSERT_EQ(next(got), IoStatus::kDone) << "frame " << k << ": " << tracker->reason();
    ASSERT_EQ(got.count, names.size());
    for (std::size_t i = 0; i < names.size(); ++i) {
      ASSERT_TRUE(got.markers[i].visible);
      ASSERT_NEAR(1e3 * got.markers[i].p_W.x(), static_cast<double>(i), 1e-3);
      ASSERT_NEAR(1e3 * got.markers[i].p_W.y(), static_cast<double>(k), 1e-3) << "frame " << k;
    }
    ASSERT_EQ(got.body.visible, has_body);
    ASSERT_NEAR(1e3 * got.body.X_W.translation().x(), has_body ? static_cast<double>(k) : 0.0, 1e-3);
    last = got;
  }
  /// Calls service() until it fails, as the daemon does every second, only more often.
  Status service_until_it_fails(Duration patience = std::chrono::seconds(10)) {
    const auto deadline = transport::now() + patience;
    while (transport::now() < deadline) {
      if (auto status = tracker->service(); !status) return status;
    }
    return {};
  }

  qualisys::QualisysConfig config;
  std::vector<std::string> names;
  bool has_body{false};
  std::optional<FakeQtm> qtm;
  std::optional<qualisys::QualisysTracker> tracker;
  int fd{-1};
  MarkerFrame last;
};

}  // namespace embody::test
