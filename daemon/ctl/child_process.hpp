#pragma once
// A child process with pipes to its standard input and output, in its own process group, that dies with its parent.
#include <sys/types.h>

#include <optional>
#include <string>
#include <vector>

#include "core/base/result.hpp"
#include "core/base/time.hpp"
#include "drivers/transport/unique_fd.hpp"

namespace embody::ctl {

class ChildProcess {
 public:
  /// Starts `program` with `arguments`; its standard error goes to the file `log`. Its own process group keeps the
  /// terminal's Ctrl-C away from it. Errors: kIo.
  static Result<ChildProcess> start(const std::string& program, const std::vector<std::string>& arguments,
                                    const std::string& log);
  ChildProcess(ChildProcess&& other) noexcept;
  ChildProcess& operator=(ChildProcess&&) = delete;
  ~ChildProcess();  ///< SIGKILL if it still runs

  /// Readable when the child has said something.
  [[nodiscard]] int output_fd() const noexcept { return output_.get(); }
  /// Next complete line of standard output, without waiting.
  [[nodiscard]] std::optional<std::string> next_line();
  void send_line(const std::string& line);

  void signal(int number) const noexcept;
  /// Exit code (128 + signal when killed) once it has ended.
  [[nodiscard]] std::optional<int> exit_code() noexcept;
  /// Waits for the end until `deadline`, then kills. Returns the exit code.
  int wait(TimePoint deadline) noexcept;

 private:
  ChildProcess() = default;
  bool read_output();

  pid_t pid_{-1};
  transport::UniqueFd input_;
  transport::UniqueFd output_;
  std::string text_;
  std::optional<int> exit_code_;
};

}  // namespace embody::ctl
