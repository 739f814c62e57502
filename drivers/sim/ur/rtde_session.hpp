#pragma once
// One RTDE client of the simulated controller: its protocol version, recipes and stream.
#include <set>

#include "drivers/sim/ur/link_faults.hpp"
#include "drivers/sim/ur/rtde_counters.hpp"
#include "drivers/sim/ur/rtde_variables.hpp"
#include "drivers/transport/unique_fd.hpp"
#include "drivers/ur_rtde/frame_buffer.hpp"

namespace embody::sim {

/// Owner of variables that no session of ours holds: a fieldbus, or another client.
inline constexpr std::uint64_t kForeignOwner = ~std::uint64_t{0};

/// What all sessions of a controller share.
struct RtdeShared {
  RtdeVariables variables;
  std::vector<std::uint64_t> owners = std::vector<std::uint64_t>(variables.count(), 0);  ///< session, 0 = nobody
  RtdeCounters counters;
  rtde::ControllerVersion version{5, 12, 4, 1'101'661};
  double frequency_hz{500.0};
  std::set<std::string, std::less<>> missing;  ///< variables that this firmware does not have
  TimePoint now{};                             ///< of the present control cycle
  LinkFaults link;
  TimePoint in_use_until{};        ///< input recipes are answered with IN_USE until then
  bool texts_in_handshake{false};  ///< a text message goes before each reply
};

class RtdeSession {
 public:
  /// `id` > 0 is unique among the sessions of `shared`. A session that is one too many is closed at `expires`.
  RtdeSession(RtdeShared& shared, transport::UniqueFd fd, std::uint64_t id, TimePoint expires = TimePoint::max());
  ~RtdeSession();
  RtdeSession(const RtdeSession&) = delete;
  RtdeSession& operator=(const RtdeSession&) = delete;

  /// Reads and answers what has arrived, a bounded amount per call. False: the session is over.
  [[nodiscard]] bool receive();
  /// Sends the present values when a package is due between the cycles `previous` (exclusive) and `cycle` (inclusive).
  /// False: the client reads too slowly or is gone.
  [[nodiscard]] bool publish(std::uint64_t previous, std::uint64_t cycle);
  /// Streams, and has written inputs at least once.
  [[nodiscard]] bool commanding() const noexcept { return streaming_ && inputs_written_ > 0; }
  /// The peer gets a reset instead of an orderly end.
  void reset_on_close() noexcept;

 private:
  struct Recipe {
    std::uint8_t id{0};
    std::vector<RtdeVariables::Index> variables;
    std::size_t size{0};  // bytes of the fields
  };
  struct Resolved {
    Recipe recipe;
    std::string types;
    bool valid{true};
  };

  bool handle(const rtde::Frame& frame);
  bool handle_protocol(rtde::Bytes payload);
  bool handle_outputs(rtde::Bytes payload);
  bool handle_inputs(rtde::Bytes payload);
  bool handle_start();
  bool handle_data(rtde::Bytes payload);
  [[nodiscard]] Resolved resolve(std::string_view names, bool inputs) const;
  [[nodiscard]] std::string_view check_variable(std::string_view name, std::optional<RtdeVariables::Index> index,
                                                bool inputs) const;
  bool reply_outputs(std::uint8_t id, std::string_view types);
  void count_sequence(std::uint32_t sequence) noexcept;
  bool complain(std::string_view message);
  bool reply(rtde::Bytes package);
  bool send(rtde::Bytes package);

  RtdeShared& shared_;
  transport::UniqueFd fd_;
  std::uint64_t id_;
  TimePoint expires_;
  Outbox outbox_;
  rtde::FrameBuffer buffer_;
  std::uint16_t version_{1};
  bool streaming_{false};
  std::uint64_t divider_{1};
  Recipe outputs_;              // id 0: none
  std::vector<Recipe> inputs_;  // inputs_[i].id == i + 1
  std::vector<std::byte> package_;
  std::uint64_t inputs_written_{0};
  std::uint64_t sequences_{0};
  std::uint32_t last_sequence_{0};
};

}  // namespace embody::sim
