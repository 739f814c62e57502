#pragma once
// The simulated controller's dashboard port (29999): lines in, one reply line each. Never waits.
#include <list>

#include "drivers/sim/ur/dashboard_commands.hpp"
#include "drivers/transport/unique_fd.hpp"

namespace embody::sim {

class DashboardPort {
 public:
  /// `port` 0 takes a free one.
  [[nodiscard]] Status listen(const std::string& address, std::uint16_t port);
  /// 0 while nobody listens.
  [[nodiscard]] std::uint16_t port() const noexcept;
  void serve(UrRobot& robot, const DashboardInfo& info);

 private:
  struct Client {
    transport::UniqueFd fd;
    std::string pending;
  };
  static bool serve(Client& client, UrRobot& robot, const DashboardInfo& info);

  transport::UniqueFd listener_;
  std::list<Client> clients_;
};

}  // namespace embody::sim
