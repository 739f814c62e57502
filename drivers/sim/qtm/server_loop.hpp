#pragma once
// The thread of the simulated QTM: one poll loop over ports, clients and the time of the next frame.
#include <poll.h>

#include <array>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "drivers/sim/qtm/client.hpp"
#include "drivers/sim/qtm/command_desk.hpp"
#include "drivers/sim/qtm/fault_words.hpp"
#include "drivers/sim/qtm/ports.hpp"
#include "drivers/sim/qtm/qtm_server.hpp"
#include "drivers/sim/qtm/studio.hpp"

namespace embody::sim {

/// The public functions are those of QtmServer.
class QtmServer::Loop {
 public:
  Loop(QtmServerConfig config, Motion motion) : config_(std::move(config)), motion_(std::move(motion)) {}
  Loop(const Loop&) = delete;
  Loop& operator=(const Loop&) = delete;
  ~Loop();

  [[nodiscard]] Status start();
  [[nodiscard]] std::uint16_t port(Ports::Kind kind) const noexcept { return numbers_[kind]; }
  void play();
  [[nodiscard]] bool has_streaming_client() const;
  [[nodiscard]] bool finished() const;
  [[nodiscard]] std::size_t frames_sent() const;
  [[nodiscard]] std::vector<SentFrame> log() const;
  [[nodiscard]] Status fault(const Fault& fault);
  [[nodiscard]] Status set_script(std::string_view text);

 private:
  /// What exists from a successful start() on.
  struct Running {
    Running(const QtmServerConfig& config, Studio built)
        : studio(std::move(built)),
          desk({config.control_enabled, config.password}, studio.measurement(), studio.setup()) {}
    Studio studio;
    CommandDesk desk;
  };

  void wake() noexcept;
  void run();
  [[nodiscard]] std::vector<pollfd> watched() const;
  [[nodiscard]] std::optional<TimePoint> next_deadline() const;
  void advance(TimePoint now);
  void send_due_frames(TimePoint now);
  void apply_script();
  void deliver_frame();
  void finish();
  void end_streams();
  void end_calibration();
  void tell(const Outcome& outcome);
  void accept_clients();
  void refuse_legacy_clients();
  void serve(Client& client);
  void answer(Client& client, const Request& request);
  void follow_up(Client& client, const Answer& answer, bool was_running);
  void storm(Client& client);
  [[nodiscard]] Status act_on_connections(const Fault& fault);

  const QtmServerConfig config_;
  Motion motion_;  // until start()
  std::array<std::uint16_t, Ports::kCount> numbers_{};
  transport::UniqueFd wake_;
  std::thread thread_;

  mutable std::mutex mutex_;  // guards all below
  std::unique_ptr<Running> running_;
  Ports ports_;
  LinkFaults link_faults_;
  bool event_storm_{false};
  std::vector<std::unique_ptr<Client>> clients_;  // changed in size by the loop thread only
  std::uint64_t next_client_id_{1};
  bool stop_{false};
  bool played_{false};
  bool finished_{false};
  std::size_t frames_sent_{0};
  std::vector<SentFrame> log_;
  std::vector<ScheduledFault> script_;
  std::size_t script_next_{0};
};

}  // namespace embody::sim
