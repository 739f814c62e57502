#pragma once
// How the simulated QTM answers its clients: packets in, packets out, no sockets (Qualisys, "QTM RT Server Protocol
// Documentation", commands).
#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "core/base/time.hpp"
#include "drivers/sim/qtm/command_words.hpp"
#include "drivers/sim/qtm/measurement.hpp"
#include "drivers/sim/qtm/parameters_xml.hpp"
#include "drivers/sim/qtm/wire.hpp"

namespace embody::sim {

/// What a client has said so far. One per connection.
struct Conversation {
  std::uint64_t id{0};  ///< unique among the clients of one server
  std::string peer;     ///< "127.0.0.1 (1832)"
  ByteOrder order{ByteOrder::kLittle};
  int minor_version{1};  ///< what QTM assumes before it is told
  std::optional<StreamRequest> stream;
  std::optional<std::vector<Component>> current_frame;  ///< wants the next one new to it
};

struct Reply {
  Packet type{Packet::kError};
  std::string text;
};

/// What follows from one packet of a client.
struct Answer {
  std::optional<std::variant<Reply, QtmEvent>> reply;  ///< to the client
  std::vector<QtmEvent> events;                        ///< to all clients, after the reply
  bool stream_changed{false};                          ///< conversation.stream is new
  bool frame_wanted{false};                            ///< conversation.current_frame is new
  bool parameters_asked{false};
  bool calibration_asked{false};  ///< the client gets its result when it has ended
};

struct DeskConfig {
  bool control_enabled{true};
  std::string password;  ///< empty: none
};

class CommandDesk {
 public:
  CommandDesk(DeskConfig config, Measurement& measurement, const QtmSetup& setup)
      : config_(std::move(config)), measurement_(measurement), setup_(setup) {}

  /// StreamFrames is never acknowledged: its answer is empty unless it is refused.
  [[nodiscard]] Answer answer(Conversation& client, const Request& request, TimePoint now);
  /// The client is gone; it is master no longer.
  void forget(const Conversation& client);
  [[nodiscard]] bool is_master(const Conversation& client) const noexcept { return master_ && *master_ == client.id; }

 private:
  using Words = std::vector<std::string>;
  [[nodiscard]] static Answer version(Conversation& client, const Words& words);
  [[nodiscard]] static Answer current_frame(Conversation& client, const Words& words);
  [[nodiscard]] Answer command(Conversation& client, const Words& words, TimePoint now);
  [[nodiscard]] Answer stream(Conversation& client, const Words& words) const;
  [[nodiscard]] Answer parameters(const Conversation& client, const Words& words) const;
  [[nodiscard]] Answer take_control(const Conversation& client, const Words& words);
  [[nodiscard]] Answer release_control(const Conversation& client);
  [[nodiscard]] Answer control(const Conversation& client, const Words& words, TimePoint now);
  [[nodiscard]] Answer settings(const Conversation& client, std::string_view xml) const;

  DeskConfig config_;
  Measurement& measurement_;
  const QtmSetup& setup_;
  std::optional<std::uint64_t> master_;
  std::string master_peer_;
};

}  // namespace embody::sim
