// A hand behind DDS: the vendor's driver is played here, with joints that move at a bounded speed.
#include <algorithm>
#include <cmath>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "daemon/dds/joint_state_hand.hpp"
#include "drivers/transport/clock.hpp"
#include "tests/contract/hand_cell.hpp"
#include "tests/unit/dds/dds_test_support.hpp"
#include "tests/unit/dds/vendor.hpp"

namespace embody::test {
namespace {

using dds::test::Vendor;
using std::chrono::milliseconds;

const std::vector<std::string> kJoints{"finger_2_prox_joint", "finger_1_med_joint"};
constexpr double kSpeed_rad_s = 0.5;
constexpr Duration kPeriod = milliseconds(5);

/// The hand goes on to its last target whether its vendor's node talks to us or not.
class JointStateCell final : public HandCell {
 public:
  JointStateCell() {
    near_rad = near_units = {0.3, 0.2};
    far_rad = far_units = {1.4, 1.2};
    tolerance = 0.01;
    hang_up_bound = silence_bound = dds::JointStateHandConfig{}.state_timeout;
    writes_in_place = false;  // dds_write() serialises, locks and may allocate: documented, not for a real-time thread
    unclamped = "the limits are the vendor's: joint_state_hand.hpp";
    drops_newest = "commands that come faster than rate_hz are dropped, and write() says so: joint_state_hand.hpp";
    auto opened = DdsPublisher::create(dds::test::private_config());
    EXPECT_TRUE(opened.ok()) << opened.error().detail.view();
    if (opened) publisher_.emplace(std::move(*opened));
    restore();
    thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
  }
  ~JointStateCell() override { thread_ = {}; }

  std::unique_ptr<HandDriver> driver(Pace pace) override {
    dds::JointStateHandConfig config;
    config.domain = dds::test::private_domain();
    config.joints = kJoints;
    if (pace == Pace::kPatient) config.state_timeout = kPatience;
    return std::make_unique<dds::JointStateHand>(config);
  }
  /// The vendor's node ends.
  void cut() override {
    const std::scoped_lock lock(mutex_);
    vendor_.reset();
  }
  void restore() override {
    const std::scoped_lock lock(mutex_);
    if (!vendor_) vendor_.emplace(dds::test::private_domain());
    speaks_ = true;
  }
  void hush() override {
    const std::scoped_lock lock(mutex_);
    speaks_ = false;
  }
  /// States that cannot be: of no number, of too few, of joints that do not exist.
  void babble(std::mt19937& random) override {
    const std::scoped_lock lock(mutex_);
    if (!vendor_) return;
    std::vector<std::string> names = kJoints;
    std::vector<double> q_rad(random() % 40);
    for (double& q : q_rad) q = random() % 2 == 0 ? std::nan("") : 1e300;
    for (std::size_t i = random() % 20; i > 0; --i) names.push_back(std::to_string(random()));
    if (random() % 2 == 0) names.resize(random() % names.size());
    vendor_->publish(names, q_rad);
  }
  std::vector<double> motors() override {
    const std::scoped_lock lock(mutex_);
    return q_rad_;
  }
  std::uint64_t motions() override {
    const std::scoped_lock lock(mutex_);
    return motions_;
  }

 private:
  void run(const std::stop_token& stop) {
    TimePoint last = transport::now();
    while (!stop.stop_requested()) {
      std::this_thread::sleep_for(kPeriod);
      const TimePoint now = transport::now();
      const std::scoped_lock lock(mutex_);
      step(to_seconds(now - std::exchange(last, now)));
      if (vendor_ && speaks_) vendor_->publish(kJoints, q_rad_);
    }
  }
  void step(double dt_s) {
    if (vendor_) {
      for (const auto& command : vendor_->commands()) {
        ++motions_;
        if (command.q_rad.size() == target_rad_.size()) target_rad_ = command.q_rad;
      }
    }
    for (std::size_t i = 0; i < q_rad_.size(); ++i) {
      q_rad_[i] += std::clamp(target_rad_[i] - q_rad_[i], -kSpeed_rad_s * dt_s, kSpeed_rad_s * dt_s);
    }
  }

  std::optional<DdsPublisher> publisher_;
  std::mutex mutex_;
  std::optional<Vendor> vendor_;
  bool speaks_{true};
  std::vector<double> q_rad_{0.1, 0.1}, target_rad_{0.1, 0.1};
  std::uint64_t motions_{0};
  std::jthread thread_;
};

}  // namespace

std::unique_ptr<HandCell> joint_state() {
  return std::make_unique<JointStateCell>();
}

}  // namespace embody::test
