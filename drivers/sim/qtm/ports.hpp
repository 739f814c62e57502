#pragma once
// The ports of the simulated QTM: three for TCP, one for discovery.
#include <array>
#include <string>

#include "drivers/sim/qtm/qtm_config.hpp"
#include "drivers/sim/qtm/wire.hpp"
#include "drivers/transport/unique_fd.hpp"

namespace embody::sim {

class Ports {
 public:
  enum Kind : std::size_t { kLittleEndian, kBigEndian, kLegacy, kDiscovery, kCount };

  /// Errors: kInvalidArgument (address), kIo (port taken). Ports once found free are kept for the next open().
  [[nodiscard]] Status open(const QtmServerConfig& config);
  /// No more connections, and no answer to discovery, until open() again.
  void close();
  [[nodiscard]] bool is_open() const noexcept { return static_cast<bool>(sockets_[kLittleEndian]); }
  [[nodiscard]] std::uint16_t number(Kind kind) const noexcept { return numbers_[kind]; }
  [[nodiscard]] int fd(Kind kind) const noexcept { return sockets_[kind].get(); }

  /// Takes one connection that waits at `kind`; empty when none does.
  [[nodiscard]] transport::UniqueFd accept(Kind kind);
  /// Answers what waits at the discovery port; requests from other computers only with `allow_remote`.
  void answer_discovery(bool allow_remote);

 private:
  [[nodiscard]] Status open_one(Kind kind, const std::string& address, std::uint16_t number);
  std::array<transport::UniqueFd, kCount> sockets_;
  std::array<std::uint16_t, kCount> numbers_{};
};

}  // namespace embody::sim
