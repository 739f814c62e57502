#include "drivers/sim/mia/can_simulator.hpp"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <mutex>
#include <thread>
#include <utility>

#include "drivers/sim/mia/can_ends.hpp"
#include "drivers/sim/mia/can_faults.hpp"
#include "drivers/transport/can_double.hpp"
#include "drivers/transport/clock.hpp"

namespace embody::sim {
namespace {

constexpr Duration kLongestWait = std::chrono::milliseconds(20);
constexpr Duration kBacklogWait = std::chrono::milliseconds(1);

}  // namespace

/// The thread, the bus and both kinds of hand, of which the profile chooses one. `mutex_` guards hands and bus.
class MiaCanSimulator::Gateway {
 public:
  explicit Gateway(const CanSimulatorConfig& config)
      : config_(config),
        path_(transport::double_path(config.interface)),
        serial_(config.serial_hand, transport::now()),
        compact_(config.compact_hand, transport::now()) {
    config_.tunnel.interface = config_.interface;
  }
  ~Gateway() { stop(); }
  Gateway(const Gateway&) = delete;
  Gateway& operator=(const Gateway&) = delete;

  Status start() {
    stop();
    if (const Status opened = set_up(); !opened) return opened;
    wake_.reset(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC));
    if (!wake_) return make_error(Errc::kIo, "cannot create an eventfd");
    leave_ = false;
    thread_ = std::thread([this] { run(); });
    return {};
  }

  void stop() noexcept {
    if (thread_.joinable()) {
      leave_ = true;
      wake();
      thread_.join();
    }
    take_down();
  }

  /// Opens the bus again after take_down().
  Status set_up() {
    const std::scoped_lock lock(mutex_);
    down_ = false;
    if (path_) {
      auto listener = transport::double_listen(*path_);
      if (!listener) return listener.error();
      listener_ = std::move(*listener);
    } else {
      auto end = open_interface();
      if (!end) return end.error();
      end_ = std::move(*end);
    }
    wake();
    return {};
  }

  void take_down() noexcept {
    const std::scoped_lock lock(mutex_);
    down_ = true;
    end_.reset();
    if (listener_ && path_) ::unlink(path_->c_str());
    listener_.reset();
    serial_.forget_host();
  }

  Status report(const transport::CanErrors& errors) {
    const std::scoped_lock lock(mutex_);
    if (!end_) return make_error(Errc::kRefused, "no host is on the simulated CAN bus");
    static_cast<void>(transport::send_can_errors(end_->fd(), errors));
    return {};
  }

  template <class Function>
  auto with_serial(Function function) {
    const std::scoped_lock lock(mutex_);
    return function(serial_);
  }
  template <class Function>
  auto with_compact(Function function) {
    const std::scoped_lock lock(mutex_);
    return function(compact_);
  }
  [[nodiscard]] bool compact() const noexcept { return config_.profile == CanProfile::kCompact; }
  [[nodiscard]] std::uint64_t hosts() const noexcept { return hosts_; }

 private:
  Result<std::unique_ptr<CanEnd>> open_interface() {
    if (compact()) {
      auto bus = transport::open_can({config_.interface, heard_ids(config_.compact_hand.ids)});
      if (!bus) return bus.error();
      return std::unique_ptr<CanEnd>(std::make_unique<CompactEnd>(std::move(*bus), compact_));
    }
    auto tunnel = mia::open_tunnel(mia::mirrored(config_.tunnel));
    if (!tunnel) return tunnel.error();
    return std::unique_ptr<CanEnd>(std::make_unique<TunnelEnd>(std::move(*tunnel), serial_));
  }

  std::unique_ptr<CanEnd> adopt(transport::UniqueFd fd) {
    if (!compact()) {
      return std::make_unique<TunnelEnd>(mia::adopt_tunnel(mia::mirrored(config_.tunnel), std::move(fd)), serial_);
    }
    return std::make_unique<CompactEnd>(
        transport::CanBus(std::move(fd), config_.interface, heard_ids(config_.compact_hand.ids)), compact_);
  }

  void wake() noexcept {
    const std::uint64_t one = 1;
    if (wake_) static_cast<void>(!::write(wake_.get(), &one, sizeof one));
  }

  void run() {
    while (!leave_) {
      wait();
      const std::scoped_lock lock(mutex_);
      const TimePoint now = transport::now();
      if (auto fd = listener_ ? transport::double_accept(listener_.get()) : transport::UniqueFd()) {
        serial_.forget_host();
        end_ = adopt(std::move(fd));
        ++hosts_;
      }
      if (end_ && !end_->exchange(now)) {
        end_.reset();
        serial_.forget_host();
      }
      if (!end_) {
        static_cast<void>(serial_.advance(now));
        static_cast<void>(compact_.advance(now));
        reopen();
      }
    }
  }

  /// A kernel interface that went down is looked for again at each turn.
  void reopen() {
    if (path_ || down_) return;
    if (auto end = open_interface()) end_ = std::move(*end);
  }

  void wait() {
    std::array<pollfd, 3> entries{pollfd{wake_.get(), POLLIN, 0}, pollfd{-1, POLLIN, 0}, pollfd{-1, POLLIN, 0}};
    Duration left = kLongestWait;
    {
      const std::scoped_lock lock(mutex_);
      if (listener_) entries[1].fd = listener_.get();
      if (end_) entries[2].fd = end_->fd();
      const auto next = compact() ? compact_.next_event() : serial_.next_event();
      if (next) left = std::clamp(*next - transport::now(), Duration::zero(), kLongestWait);
      const auto* tunnel = dynamic_cast<const TunnelEnd*>(end_.get());
      if (tunnel != nullptr && tunnel->backlog()) left = std::min(left, kBacklogWait);
    }
    const timespec pause{0, left.count()};
    ::ppoll(entries.data(), entries.size(), &pause, nullptr);
    std::uint64_t count = 0;
    if ((entries[0].revents & POLLIN) != 0) static_cast<void>(!::read(wake_.get(), &count, sizeof count));
  }

  CanSimulatorConfig config_;
  std::optional<std::string> path_;
  transport::UniqueFd wake_;
  std::atomic<bool> leave_{false};
  std::atomic<std::uint64_t> hosts_{0};
  std::thread thread_;
  std::mutex mutex_;
  MiaDevice serial_;
  CompactHand compact_;
  bool down_{true};
  transport::UniqueFd listener_;
  std::unique_ptr<CanEnd> end_;
};

MiaCanSimulator::MiaCanSimulator(const CanSimulatorConfig& config) : gateway_(std::make_unique<Gateway>(config)) {}

MiaCanSimulator::~MiaCanSimulator() = default;

Status MiaCanSimulator::start() {
  return gateway_->start();
}

void MiaCanSimulator::stop() noexcept {
  gateway_->stop();
}

CanSimulatorCounters MiaCanSimulator::counters() const {
  CanSimulatorCounters counters;
  counters.hosts = gateway_->hosts();
  const auto copy = [&counters](const auto& from) {
    counters.commands = from.commands;
    counters.motions = from.motions;
    counters.stops = from.stops;
  };
  if (gateway_->compact()) {
    copy(compact_counters());
  } else {
    copy(gateway_->with_serial([](const MiaDevice& hand) { return hand.counters(); }));
  }
  return counters;
}

CompactHandCounters MiaCanSimulator::compact_counters() const {
  return gateway_->with_compact([](const CompactHand& hand) { return hand.counters(); });
}

std::array<double, mia::kMotors> MiaCanSimulator::motor_counts() const {
  if (gateway_->compact()) {
    return gateway_->with_compact([](CompactHand& hand) {
      hand.move_to(transport::now());
      return hand.motor_counts();
    });
  }
  return gateway_->with_serial([](MiaDevice& hand) {
    hand.move_to(transport::now());
    return hand.motor_counts();
  });
}

Status MiaCanSimulator::fault(std::string_view text) {
  if (text == "down") {
    gateway_->take_down();
    return {};
  }
  if (text == "up") return gateway_->set_up();
  if (const auto errors = bus_fault(text)) return gateway_->report(*errors);
  if (!gateway_->compact()) {
    return gateway_->with_serial([text](MiaDevice& hand) { return hand.fault(text, transport::now()); });
  }
  return gateway_->with_compact([text](CompactHand& hand) { return compact_fault(hand, text); });
}

}  // namespace embody::sim
