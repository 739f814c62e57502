#pragma once
// One of the simulated controller's ports 30001 to 30003: takes programs as text, sends messages. Never waits.
#include <functional>
#include <list>
#include <string>

#include "core/base/result.hpp"
#include "drivers/sim/ur/primary_messages.hpp"
#include "drivers/transport/unique_fd.hpp"

namespace embody::sim {

/// Takes the next whole program off the front of `pending`: "def ..." or "sec ..." up to its "end" in the first column,
/// or any other line that is not empty. nullopt while none is complete. Pure.
[[nodiscard]] std::optional<std::string> take_program(std::string& pending);

class ScriptPort {
 public:
  /// `port` 0 takes a free one.
  [[nodiscard]] Status listen(const std::string& address, std::uint16_t port);
  [[nodiscard]] std::uint16_t port() const noexcept;

  /// Accepts clients, each greeted with the messages of `greeting()`, and returns the programs that have arrived whole.
  [[nodiscard]] std::vector<std::string> receive(const std::function<std::vector<Message>()>& greeting);
  /// A client that reads too slowly gets nothing any more, but may go on sending.
  void send(const Message& message);
  void disconnect_all() noexcept { clients_.clear(); }
  [[nodiscard]] std::size_t clients() const noexcept { return clients_.size(); }

 private:
  struct Client {
    transport::UniqueFd fd;
    std::string pending;
    bool discontinued{false};
  };
  static bool read(Client& client, std::vector<std::string>& programs);
  static void write(Client& client, const Message& message);

  transport::UniqueFd listener_;
  std::list<Client> clients_;
};

}  // namespace embody::sim
