#include "drivers/sim/mia/mia_simulator.hpp"

#include <poll.h>
#include <sys/eventfd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <mutex>
#include <optional>
#include <span>
#include <thread>
#include <utility>

#include "drivers/sim/mia/device.hpp"
#include "drivers/sim/mia/pty.hpp"
#include "drivers/transport/clock.hpp"
#include "drivers/transport/tty.hpp"

namespace embody::sim {
namespace {

constexpr Duration kHostCheck = std::chrono::milliseconds(5);  ///< while nobody has the device open

}  // namespace

/// The thread and its line. `mutex_` guards the hand; `life_` orders start and stop.
class MiaSimulator::Device {
 public:
  explicit Device(const MiaSimulatorConfig& config) : link_path_(config.link), hand_(config, transport::now()) {}
  ~Device() { stop(); }
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;

  Status start() {
    const std::scoped_lock lock(life_);
    unplug();
    auto pty = open_pty();
    if (!pty) return pty.error();
    wake_.reset(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC));
    if (!wake_) return make_error(Errc::kIo, "cannot create an eventfd: %s", std::strerror(errno));
    if (!link_path_.empty()) {
      if (const Status linked = link_.create(link_path_, pty->device); !linked) return linked;
    }
    pty_ = std::move(*pty);
    leave_ = false;
    thread_ = std::thread([this] { run(); });
    return {};
  }

  void stop() noexcept {
    const std::scoped_lock lock(life_);
    unplug();
  }

  std::string path() {
    const std::scoped_lock lock(life_);
    return pty_.device;
  }

  /// The hand has something else to do now: whoever waits looks again.
  void wake() noexcept {
    const std::scoped_lock lock(life_);
    const std::uint64_t one = 1;
    if (wake_) static_cast<void>(!::write(wake_.get(), &one, sizeof one));
  }

  /// Calls `function` with the hand as it is now.
  template <class Function>
  auto with_hand(Function function) {
    const std::scoped_lock lock(mutex_);
    return function(hand_);
  }

 private:
  void unplug() noexcept {
    if (thread_.joinable()) {
      leave_ = true;
      const std::uint64_t one = 1;
      static_cast<void>(!::write(wake_.get(), &one, sizeof one));
      thread_.join();
    }
    link_.remove();
    pty_ = {};
    const std::scoped_lock lock(mutex_);
    hand_.forget_host();
  }

  void run() {
    bool host_present = true;
    while (!leave_) {
      const short events = wait(host_present);
      if ((events & POLLIN) != 0) take_bytes();
      host_present = (events & POLLHUP) == 0 || (events & POLLIN) != 0;
      if (!host_present) forget_host();
      speak(host_present);
    }
  }

  void forget_host() {
    make_raw(pty_.master.get());
    const std::scoped_lock lock(mutex_);
    hand_.forget_host();
  }

  /// Waits for bytes, for the next event of the hand, or to be woken. A line without a host reports a hang-up at once
  /// and for ever: then it is only looked at every few milliseconds.
  short wait(bool host_present) {
    pollfd woken{wake_.get(), POLLIN, 0};
    if (!host_present) {
      const timespec pause{0, kHostCheck.count()};
      ::ppoll(&woken, 1, &pause, nullptr);
    }
    std::optional<TimePoint> deadline = with_hand([](const MiaDevice& hand) { return hand.next_event(); });
    if (!host_present) deadline = transport::now();
    timespec left{};
    if (deadline) {
      const Duration span = std::max(*deadline - transport::now(), Duration::zero());
      left = {span.count() / 1'000'000'000, span.count() % 1'000'000'000};
    }
    std::array<pollfd, 2> entries{pollfd{pty_.master.get(), POLLIN, 0}, woken};
    if (::ppoll(entries.data(), entries.size(), deadline ? &left : nullptr, nullptr) <= 0) return 0;
    std::uint64_t count = 0;
    if (entries[1].revents != 0 && !leave_) static_cast<void>(!::read(wake_.get(), &count, sizeof count));
    return entries[0].revents;
  }

  void take_bytes() {
    std::array<char, 512> buffer;
    const auto [status, size] = transport::read_tty(pty_.master.get(), std::as_writable_bytes(std::span(buffer)));
    if (status != IoStatus::kDone) return;
    const std::scoped_lock lock(mutex_);
    hand_.receive({buffer.data(), size}, transport::now());
  }

  void speak(bool host_present) {
    const std::string text = with_hand([](MiaDevice& hand) { return hand.advance(transport::now()); });
    if (text.empty() || !host_present) return;
    // A host that does not read loses what does not fit.
    static_cast<void>(transport::write_tty(pty_.master.get(), std::as_bytes(std::span(text))));
  }

  std::mutex life_;
  std::string link_path_;
  DeviceLink link_;
  Pty pty_;
  transport::UniqueFd wake_;
  std::atomic<bool> leave_{false};
  std::thread thread_;
  std::mutex mutex_;
  MiaDevice hand_;
};

MiaSimulator::MiaSimulator(const MiaSimulatorConfig& config) : device_(std::make_unique<Device>(config)) {}

MiaSimulator::~MiaSimulator() = default;

Status MiaSimulator::start() {
  return device_->start();
}

void MiaSimulator::stop() noexcept {
  device_->stop();
}

void MiaSimulator::unplug() {
  device_->stop();
}

std::string MiaSimulator::device() const {
  return device_->path();
}

MiaSimulatorCounters MiaSimulator::counters() const {
  return device_->with_hand([](const MiaDevice& hand) { return hand.counters(); });
}

// The hand moves although nobody polls it: it is brought up to date before it is looked at.

std::array<double, mia::kMotors> MiaSimulator::motor_counts() const {
  return device_->with_hand([](MiaDevice& hand) {
    hand.move_to(transport::now());
    return hand.motor_counts();
  });
}

std::array<double, mia::kMotors> MiaSimulator::joint_angles_rad() const {
  return device_->with_hand([](MiaDevice& hand) {
    hand.move_to(transport::now());
    return hand.joint_angles_rad();
  });
}

std::vector<MiaSample> MiaSimulator::log() const {
  return device_->with_hand([](MiaDevice& hand) {
    hand.move_to(transport::now());
    return hand.log();
  });
}

void MiaSimulator::mute(bool on) {
  device_->with_hand([on](MiaDevice& hand) { hand.mute(on); });
}

void MiaSimulator::drop_next(unsigned n) {
  device_->with_hand([n](MiaDevice& hand) { hand.drop_next(n); });
}

void MiaSimulator::garble_next(unsigned n) {
  device_->with_hand([n](MiaDevice& hand) { hand.garble_next(n); });
}

Status MiaSimulator::fault(std::string_view text) {
  if (text == "unplug") return unplug(), Status{};
  if (text == "plug") return start();
  const Status done = device_->with_hand([text](MiaDevice& hand) { return hand.fault(text, transport::now()); });
  device_->wake();
  return done;
}

}  // namespace embody::sim
