#pragma once
// What the simulated controller's RTDE port has seen.
#include <cstdint>

namespace embody::sim {

/// Sequences (input_int_register_24) are compared within one session, from its third command package on: the first one
/// is the greeting of a client that may go on anywhere.
struct RtdeCounters {
  std::uint64_t clients_accepted{0};
  std::uint64_t packages_sent{0};        ///< output packages, all clients
  std::uint64_t command_packages{0};     ///< input packages that were applied
  std::uint64_t sequence_gaps{0};        ///< sequence is neither the last nor the last plus 1
  std::uint64_t sequence_duplicates{0};  ///< sequence is the last
  std::uint64_t max_missing{0};          ///< most sequences missing in one gap
  std::uint64_t bad_packages{0};         ///< packages answered with an error text
  std::uint64_t slow_clients_closed{0};  ///< connections that did not take a package in full
};

}  // namespace embody::sim
