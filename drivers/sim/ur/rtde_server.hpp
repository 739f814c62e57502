#pragma once
// The RTDE port of the simulated controller: accepts clients, serves them without ever waiting. One thread.
#include <list>

#include "core/base/result.hpp"
#include "drivers/sim/ur/rtde_session.hpp"

namespace embody::sim {

class RtdeServer {
 public:
  /// `port` 0 takes a free one.
  [[nodiscard]] Status listen(const std::string& address, std::uint16_t port);
  [[nodiscard]] std::uint16_t port() const noexcept;

  /// Takes new clients (at most `max_clients` at a time, others are closed) and handles what they sent.
  void receive(std::size_t max_clients);
  /// Sends the present values to those clients whose package is due (RtdeSession::publish).
  void publish(std::uint64_t previous, std::uint64_t cycle);
  void disconnect_all() noexcept { sessions_.clear(); }
  [[nodiscard]] bool has_commanding_client() const noexcept;

  [[nodiscard]] RtdeShared& shared() noexcept { return shared_; }

 private:
  RtdeShared shared_;
  transport::UniqueFd listener_;
  std::list<RtdeSession> sessions_;  // after shared_: sessions give up their variables when they end
};

}  // namespace embody::sim
