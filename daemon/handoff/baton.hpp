#pragma once
// A device driver belongs to the links thread (which connects) or to its loop (which reads and writes), never to both.
#include <atomic>

#include "core/base/result.hpp"

namespace embody {

/// Passes `Driver` between the two owners. `Info` is what connect() returned; it is written by links before the pass.
template <class Driver, class Info>
class Baton {
 public:
  explicit Baton(Driver& driver) noexcept : driver_(driver) {}

  // Links side.
  [[nodiscard]] bool with_links() const noexcept { return owner_.load(std::memory_order_acquire) == Owner::kLinks; }
  /// @pre with_links()
  [[nodiscard]] Driver& driver() noexcept { return driver_; }
  void pass_to_loop(const Info& info) noexcept {
    info_ = info;
    fd_.store(info.fd, std::memory_order_relaxed);
    owner_.store(Owner::kLoop, std::memory_order_release);
  }

  // Loop side.
  [[nodiscard]] bool with_loop() const noexcept { return owner_.load(std::memory_order_acquire) == Owner::kLoop; }
  /// @pre with_loop()
  [[nodiscard]] const Info& info() const noexcept { return info_; }
  /// The session is broken: links will connect again.
  void give_back() noexcept {
    fd_.store(-1, std::memory_order_relaxed);
    owner_.store(Owner::kLinks, std::memory_order_release);
  }

  // Any thread.
  /// Asks the loop to give the driver back at its next tick.
  void revoke() noexcept { revoked_.store(true, std::memory_order_release); }
  [[nodiscard]] bool take_revoked() noexcept { return revoked_.exchange(false, std::memory_order_acq_rel); }
  /// Descriptor of the present session, -1 without one.
  [[nodiscard]] int fd() const noexcept { return fd_.load(std::memory_order_relaxed); }

 private:
  enum class Owner { kLinks, kLoop };
  Driver& driver_;
  Info info_{};
  std::atomic<Owner> owner_{Owner::kLinks};
  std::atomic<bool> revoked_{false};
  std::atomic<int> fd_{-1};
};

}  // namespace embody
