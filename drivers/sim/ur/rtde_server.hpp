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

  /// Takes new clients and handles what they sent. More than `max_clients` may shake hands, but are closed after 1 s.
  void receive(std::size_t max_clients, TimePoint now);
  /// Sends the present values to those clients whose package is due (RtdeSession::publish).
  void publish(std::uint64_t previous, std::uint64_t cycle);
  void disconnect_all(bool by_reset = false) noexcept;
  /// Somebody else owns the input registers 24 to 47, as far as no client of ours does.
  void occupy_registers(bool occupied);
  [[nodiscard]] bool has_commanding_client() const noexcept;

  [[nodiscard]] RtdeShared& shared() noexcept { return shared_; }

 private:
  RtdeShared shared_;
  transport::UniqueFd listener_;
  std::list<RtdeSession> sessions_;  // after shared_: sessions give up their variables when they end
};

}  // namespace embody::sim
