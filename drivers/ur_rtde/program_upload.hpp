#pragma once
// Sees to it that the robot plays our control program: looks at the controller's modes, uploads the program when the
// robot runs and nothing plays, looks whether it runs, and explains in one sentence what is in the way. Never resumes,
// unlocks or powers anything, and never replaces a program of somebody else.
#include <string>

#include "drivers/ur_rtde/arm_status.hpp"
#include "drivers/ur_rtde/primary_link.hpp"

namespace embody::ur {

enum class ProgramNeed {
  kNone,    ///< our program plays
  kUpload,  ///< the robot runs, no stop, no program
  kWait,    ///< something else has to happen first: `sentence`, or a transition of a moment when that is empty
};

struct ProgramAdvice {
  ProgramNeed need{ProgramNeed::kWait};
  Error sentence;  ///< empty detail: nothing to say
};

/// What the controller's modes ask for. Pure.
[[nodiscard]] ProgramAdvice advise(const rtde::ControllerStatus& status, bool answers) noexcept;

struct ProgramUploadConfig {
  std::string host{"127.0.0.1"};
  std::uint16_t port{30001};
  std::string program;                                ///< URScript, ends with a line end
  Duration confirm_timeout{std::chrono::seconds(3)};  ///< from sending the program to seeing it play
  Duration retry_after{std::chrono::seconds(5)};      ///< after a refusal, or when nobody was at the port
};

class ProgramUpload {
 public:
  explicit ProgramUpload(ProgramUploadConfig config);

  /// One round of upkeep, about once a second: what a program that was sent has come to is seen in a later round. Waits
  /// for nothing but a new connection, 0.3 s at most and only every `retry_after` when there is nobody. An error is a
  /// sentence for the operator.
  Status service(const SharedArmStatus& status);

  /// Geometry that the controller reported, once its primary port has been heard.
  [[nodiscard]] const std::optional<UrKinematics>& kinematics() const noexcept { return link_.kinematics(); }
  [[nodiscard]] std::uint64_t uploads() const noexcept { return uploads_; }
  /// Of these: refused, or not seen to play in time.
  [[nodiscard]] std::uint64_t failures() const noexcept { return failures_; }

 private:
  Status open();
  Status listen();
  Status upload();
  Status wait_for_start();
  Status judge(const PrimaryEvent& event);
  void note(const PrimaryEvent& event);
  Error refuse(const Error& error);
  [[nodiscard]] bool awaited() const noexcept { return confirm_by_ != TimePoint{}; }
  [[nodiscard]] Error script_error(const PrimaryEvent& event) const;

  ProgramUploadConfig config_;
  PrimaryLink link_;
  std::uint64_t commands_seen_{0};
  std::uint64_t uploads_{0}, failures_{0};
  int script_errors_{0};
  TimePoint confirm_by_{};  ///< a program was sent and is to play by then; never: none was
  TimePoint reopen_at_{};
  Error unreachable_;  ///< why the last connection failed
  TimePoint retry_at_{};
  Error last_error_;            ///< why the last upload failed
  FixedString<160> last_stop_;  ///< "C204A1: sudden change of the target position"
};

}  // namespace embody::ur
