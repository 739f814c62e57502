#include "daemon/ctl/captured_driver.hpp"

#include "daemon/app/devices.hpp"
#include "drivers/transport/clock.hpp"

namespace embody::ctl {
namespace {

constexpr int kReadsPerTurn = 1000;  // what comes faster than it is read must not keep us from the clock
constexpr Duration kUpkeepPeriod = std::chrono::seconds(1);

Error session_over(const Device& device) {
  return make_error(Errc::kDisconnected, "the session is over: %.200s", std::string(device.reason()).c_str());
}

/// Reads until there is nothing; the number of readings.
template <class Driver, class Reading>
Result<std::uint64_t> read_all(Driver& driver, Reading& reading) {
  std::uint64_t count = 0;
  for (int i = 0; i < kReadsPerTurn; ++i) {
    const IoStatus status = driver.read(reading);
    if (status == IoStatus::kDisconnected) return session_over(driver);
    if (status != IoStatus::kDone) break;
    ++count;
  }
  return count;
}

template <class Info>
Result<int> fd_of(const Result<Info>& info) {
  if (!info) return info.error();
  return info->fd;
}

class CapturedTracker final : public CapturedDriver {
 public:
  explicit CapturedTracker(std::unique_ptr<HandTracker> tracker) : tracker_(std::move(tracker)) {}
  Result<int> connect() override { return fd_of(tracker_->connect()); }
  Status serve(TimePoint now) override {
    const auto count = read_all(*tracker_, frame_);
    if (!count) return count.error();
    readings_ += *count;
    if (t_upkeep_ == TimePoint{}) t_upkeep_ = now + kUpkeepPeriod;
    if (now < t_upkeep_) return {};
    t_upkeep_ = now + kUpkeepPeriod;
    return tracker_->service();
  }

 private:
  std::unique_ptr<HandTracker> tracker_;
  MarkerFrame frame_;
  TimePoint t_upkeep_{};
};

class CapturedArm final : public CapturedDriver {
 public:
  explicit CapturedArm(std::unique_ptr<ArmDriver> arm) : arm_(std::move(arm)) {}
  Result<int> connect() override { return fd_of(arm_->connect()); }
  Status serve(TimePoint) override {
    const auto count = read_all(*arm_, state_);
    if (!count) return count.error();
    readings_ += *count;
    return {};
  }

 private:
  std::unique_ptr<ArmDriver> arm_;
  ArmState state_;
};

class CapturedHand final : public CapturedDriver {
 public:
  CapturedHand(std::unique_ptr<HandDriver> hand, double rate_hz)
      : hand_(std::move(hand)), period_(from_seconds(1.0 / rate_hz)) {}
  Result<int> connect() override { return fd_of(hand_->connect()); }
  Status serve(TimePoint now) override {
    const auto count = read_all(*hand_, state_);
    if (!count) return count.error();
    readings_ += *count;
    if (now < t_poll_) return {};
    t_poll_ = now + period_;
    HandCommand hold;
    hold.sequence = ++sequence_;
    hold.action = HandAction::kHold;
    hold.t_expires = now + period_;
    return hand_->write(hold, now) == IoStatus::kDisconnected ? Status(session_over(*hand_)) : Status();
  }

 private:
  std::unique_ptr<HandDriver> hand_;
  Duration period_;
  HandDeviceState state_;
  TimePoint t_poll_{};
  std::uint32_t sequence_{0};
};

}  // namespace

std::unique_ptr<CapturedDriver> make_captured_driver(CapturedDevice device, config::EmbodyConfig config) {
  config.arm.program.upload = false;
  switch (device) {
    case CapturedDevice::kArm:
      return std::make_unique<CapturedArm>(make_arm(config.arm));
    case CapturedDevice::kHand:
      return std::make_unique<CapturedHand>(make_hand(config), config.hand.rate_hz);
    case CapturedDevice::kTracker:
      break;
  }
  return std::make_unique<CapturedTracker>(make_tracker(config));
}

}  // namespace embody::ctl
