// A program that sends hand landmarks by UDP. It hears nothing and there is no connection: much of what can happen to
// others cannot happen here.
#include <atomic>
#include <thread>

#include "drivers/landmarks/landmark_tracker.hpp"
#include "drivers/transport/tcp.hpp"
#include "drivers/transport/udp.hpp"
#include "tests/contract/tracker_cell.hpp"

namespace embody::test {
namespace {

class LandmarkCell final : public TrackerCell {
 public:
  LandmarkCell() {
    marker_count = landmarks::kLandmarkCount;
    rate_hz = 100.0;
    no_line = "datagrams need no line: the session lasts as long as the socket";
    const auto free_one = transport::udp_bind("127.0.0.1", 0, 1 << 16);
    port_ = transport::local_port(free_one->get());
    auto out = transport::udp_connect("127.0.0.1", port_);
    EXPECT_TRUE(out.ok());
    if (out) out_ = std::move(*out);
    thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
  }
  ~LandmarkCell() override { thread_ = {}; }

  std::unique_ptr<HandTracker> driver() override {
    return std::make_unique<landmarks::LandmarkTracker>(
        landmarks::LandmarkConfig{"127.0.0.1", port_, rate_hz, Side::kRight});
  }
  void cut() override { speaks_ = false; }
  void restore() override { speaks_ = true; }
  void hush() override { speaks_ = false; }
  void hide(bool on) override { hidden_ = on; }
  void babble(std::mt19937& random) override {
    for (int i = 0; i < 10; ++i) {
      static_cast<void>(transport::send_message(out_.get(), rubbish(random, 1400)));
      auto almost = landmarks::encode(frame(random()));
      almost[random() % almost.size()] ^= std::byte{0xFF};
      if (almost[7] == std::byte{0}) almost[7] = std::byte{1};  // never a frame that could be true
      static_cast<void>(transport::send_message(out_.get(), almost));
    }
  }

 private:
  void run(const std::stop_token& stop) {
    for (std::uint64_t number = 1; !stop.stop_requested(); ++number) {
      if (speaks_) static_cast<void>(transport::send_message(out_.get(), landmarks::encode(frame(number))));
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
  }
  [[nodiscard]] landmarks::LandmarkFrame frame(std::uint64_t number) const {
    landmarks::LandmarkFrame frame;
    frame.frame_number = number;
    frame.t_capture_ns = std::chrono::nanoseconds(std::chrono::system_clock::now().time_since_epoch()).count();
    for (std::size_t i = 0; i < landmarks::kLandmarkCount; ++i) {
      if (hidden_ && i == kHiddenSlot) continue;
      frame.landmarks[i] = {{0.3F, 0.01F * static_cast<float>(i + 1), 0.2F}, 0.9F};
    }
    return frame;
  }

  std::uint16_t port_{0};
  transport::UniqueFd out_;
  std::atomic<bool> speaks_{true}, hidden_{false};
  std::jthread thread_;
};

}  // namespace

std::unique_ptr<TrackerCell> landmarks_udp() {
  return std::make_unique<LandmarkCell>();
}

}  // namespace embody::test
