#include "drivers/sim/robotiq/robotiq_simulator.hpp"

#include <poll.h>
#include <sys/eventfd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <mutex>
#include <thread>
#include <utility>

#include "drivers/sim/mia/pty.hpp"
#include "drivers/transport/clock.hpp"
#include "drivers/transport/tty.hpp"

namespace embody::sim {
namespace {

constexpr Duration kHostCheck = std::chrono::milliseconds(5);  ///< while nobody has the device open

timespec to_timespec(Duration span) noexcept {
  span = std::max(span, Duration::zero());
  return {span.count() / 1'000'000'000, span.count() % 1'000'000'000};
}

}  // namespace

/// The thread and its pseudo-terminal. `mutex_` guards the gripper; `life_` orders start and stop.
class RobotiqSimulator::Line {
 public:
  explicit Line(const RobotiqSimulatorConfig& config)
      : link_path_(config.link), gripper_(config.gripper, transport::now()) {}
  ~Line() { stop(); }
  Line(const Line&) = delete;
  Line& operator=(const Line&) = delete;

  Status start() {
    const std::scoped_lock lock(life_);
    close();
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
    close();
  }

  std::string path() {
    const std::scoped_lock lock(life_);
    return pty_.device;
  }

  /// Calls `function` with the gripper as it is now.
  template <class Function>
  auto with_gripper(Function function) {
    const std::scoped_lock lock(mutex_);
    gripper_.receive({}, transport::now());  // moves it on
    return function(gripper_);
  }

 private:
  void close() noexcept {
    if (thread_.joinable()) {
      leave_ = true;
      const std::uint64_t one = 1;
      static_cast<void>(!::write(wake_.get(), &one, sizeof one));
      thread_.join();
    }
    link_.remove();
    pty_ = {};
    const std::scoped_lock lock(mutex_);
    gripper_.forget_host();
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
    gripper_.forget_host();
  }

  /// Waits for bytes, for the next answer, or to be woken. A line without a host reports a hang-up at once and for
  /// ever: then it is only looked at every few milliseconds.
  short wait(bool host_present) {
    pollfd woken{wake_.get(), POLLIN, 0};
    std::optional<TimePoint> deadline;
    if (host_present) {
      const std::scoped_lock lock(mutex_);
      deadline = gripper_.next_event();
    } else {
      const timespec pause = to_timespec(kHostCheck);
      ::ppoll(&woken, 1, &pause, nullptr);
      deadline = transport::now();
    }
    const timespec left = deadline ? to_timespec(*deadline - transport::now()) : timespec{};
    std::array<pollfd, 2> entries{pollfd{pty_.master.get(), POLLIN, 0}, woken};
    return ::ppoll(entries.data(), entries.size(), deadline ? &left : nullptr, nullptr) > 0 ? entries[0].revents
                                                                                            : short{0};
  }

  void take_bytes() {
    std::array<std::byte, 512> buffer;
    const auto [status, size] = transport::read_tty(pty_.master.get(), buffer);
    if (status != IoStatus::kDone) return;
    const std::scoped_lock lock(mutex_);
    gripper_.receive({buffer.data(), size}, transport::now());
  }

  void speak(bool host_present) {
    std::vector<std::byte> bytes;
    {
      const std::scoped_lock lock(mutex_);
      bytes = gripper_.advance(transport::now());
    }
    if (bytes.empty() || !host_present) return;
    // A host that does not read loses what does not fit.
    static_cast<void>(transport::write_tty(pty_.master.get(), bytes));
  }

  std::mutex life_;
  std::string link_path_;
  DeviceLink link_;
  Pty pty_;
  transport::UniqueFd wake_;
  std::atomic<bool> leave_{false};
  std::thread thread_;
  std::mutex mutex_;
  RobotiqGripper gripper_;
};

RobotiqSimulator::RobotiqSimulator(const RobotiqSimulatorConfig& config) : line_(std::make_unique<Line>(config)) {}

RobotiqSimulator::~RobotiqSimulator() = default;

Status RobotiqSimulator::start() {
  return line_->start();
}

void RobotiqSimulator::stop() noexcept {
  line_->stop();
}

std::string RobotiqSimulator::device() const {
  return line_->path();
}

Status RobotiqSimulator::apply(const RobotiqFault& fault) {
  if (fault.kind == RobotiqFault::Kind::kPlug) return line_->start();
  if (fault.kind == RobotiqFault::Kind::kUnplug) {
    line_->stop();
  } else {
    line_->with_gripper([&fault](RobotiqGripper& gripper) { gripper.apply(fault); });
  }
  return {};
}

Status RobotiqSimulator::fault(std::string_view words) {
  const auto parsed = parse_robotiq_fault(words);
  if (!parsed) return parsed.error();
  return apply(*parsed);
}

double RobotiqSimulator::counts() const {
  return line_->with_gripper([](const RobotiqGripper& gripper) { return gripper.counts(); });
}

double RobotiqSimulator::travelled_counts() const {
  return line_->with_gripper([](const RobotiqGripper& gripper) { return gripper.travelled_counts(); });
}

robotiq::GripperStatus RobotiqSimulator::status() const {
  return line_->with_gripper([](const RobotiqGripper& gripper) { return gripper.status(); });
}

RobotiqGripperCounters RobotiqSimulator::counters() const {
  return line_->with_gripper([](const RobotiqGripper& gripper) { return gripper.counters(); });
}

}  // namespace embody::sim
