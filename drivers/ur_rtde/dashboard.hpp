#pragma once
// Client of the dashboard server (TCP 29999): power, brakes, protective stops, popups, questions about the controller.
// For the operator's explicit requests only: slow, not real-time, and never the source of a safety decision. Every
// call waits, with deadlines; call it from one thread that may. PolyScope X has no dashboard server.
#include <functional>

#include "core/base/time.hpp"
#include "drivers/transport/unique_fd.hpp"
#include "drivers/ur_rtde/dashboard_reply.hpp"

namespace embody::ur {

struct DashboardConfig {
  std::string host{"127.0.0.1"};
  std::uint16_t port{29999};
  int controller_major{0};  ///< as RTDE reports it, 0 = unknown; 10 and above is PolyScope X
  Duration reply_timeout{std::chrono::seconds(2)};
};

struct BringUpConfig {
  Duration power_timeout{std::chrono::seconds(30)};
  Duration brake_timeout{std::chrono::seconds(15)};
  Duration poll_period{std::chrono::milliseconds(100)};
};

/// Connects when a call needs it and again after a failure. Errors of all calls: kUnsupported (PolyScope X, or an
/// unknown command), kDisconnected, kTimeout, kRefused (local control, and what else the robot says), kMalformed.
class Dashboard {
 public:
  explicit Dashboard(DashboardConfig config);

  /// RTDE codes (status_text.hpp).
  [[nodiscard]] Result<int> robot_mode();
  [[nodiscard]] Result<int> safety_status();
  [[nodiscard]] Result<bool> in_remote_control();
  [[nodiscard]] Result<std::string> polyscope_version();
  [[nodiscard]] Result<std::string> serial_number();
  /// "UR10" for a UR10e as well.
  [[nodiscard]] Result<std::string> robot_model();

  // The reply acknowledges a request only; robot_mode() and RTDE tell what came of it.
  [[nodiscard]] Status power_on();
  [[nodiscard]] Status power_off();
  [[nodiscard]] Status release_brakes();
  /// Only for a person who has looked for the cause; the robot refuses during the first 5 s.
  [[nodiscard]] Status unlock_protective_stop();
  [[nodiscard]] Status close_safety_popup();
  [[nodiscard]] Status close_popup();
  /// Line ends in `text` become blanks; cut at 200 characters.
  [[nodiscard]] Status popup(std::string_view text);
  [[nodiscard]] Status stop_program();

  /// Power on, wait for IDLE, release the brakes, wait for RUNNING. Does nothing to a robot that runs already, and
  /// releases no stop: refused unless safety is normal or reduced. `cancelled` is asked at each poll.
  [[nodiscard]] Status bring_up(const BringUpConfig& config, const std::function<bool()>& cancelled);

  /// Sends any command and returns the first line of the reply.
  [[nodiscard]] Result<std::string> ask(std::string_view command);

 private:
  Status connect(TimePoint deadline);
  Result<std::string> receive_line(TimePoint deadline);
  Status request(std::string_view command, std::string_view expected);
  Status wait_for_mode(int wanted, TimePoint deadline, const BringUpConfig& config,
                       const std::function<bool()>& cancelled);

  DashboardConfig config_;
  transport::UniqueFd fd_;
  std::string pending_;
};

}  // namespace embody::ur
