#pragma once
// Sees to it that the robot plays our control program: looks at the controller's modes, uploads the program when the
// robot runs and nothing plays, confirms that it runs, and explains in one sentence what is in the way. Never resumes,
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
  std::string program;  ///< URScript, ends with a line end
  Duration confirm_timeout{std::chrono::milliseconds(800)};
  Duration retry_after{std::chrono::seconds(5)};  ///< after a refusal
};

class ProgramUpload {
 public:
  explicit ProgramUpload(ProgramUploadConfig config);

  /// One round of upkeep; waits at most for about `confirm_timeout`. An error is a sentence for the operator.
  Status service(const SharedArmStatus& status);

  /// Geometry that the controller reported, once its primary port has been heard.
  [[nodiscard]] const std::optional<UrKinematics>& kinematics() const noexcept { return link_.kinematics(); }
  [[nodiscard]] std::uint64_t uploads() const noexcept { return uploads_; }

 private:
  Status listen();
  Status upload(const SharedArmStatus& status);
  Status confirm(const SharedArmStatus& status);
  void note(const PrimaryEvent& event);
  Error refuse(const Error& error);
  [[nodiscard]] Error script_error(const PrimaryEvent& event) const;

  ProgramUploadConfig config_;
  PrimaryLink link_;
  std::uint64_t commands_seen_{0};
  std::uint64_t uploads_{0};
  int script_errors_{0};
  TimePoint retry_at_{};
  Error last_error_;            ///< why the last upload failed
  FixedString<160> last_stop_;  ///< "C204A1: sudden change of the target position"
};

}  // namespace embody::ur
