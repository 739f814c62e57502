#include "daemon/ctl/child_process.hpp"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <thread>

#include "drivers/transport/clock.hpp"

namespace embody::ctl {
namespace {

/// In the child, between fork and exec: only async-signal-safe calls.
[[noreturn]] void become(const char* program, char* const* arguments, int input, int output, int log) {
  ::setpgid(0, 0);
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  ::dup2(input, STDIN_FILENO);
  ::dup2(output, STDOUT_FILENO);
  ::dup2(log, STDERR_FILENO);
  sigset_t none;
  sigemptyset(&none);
  ::sigprocmask(SIG_SETMASK, &none, nullptr);
  ::execv(program, arguments);
  ::_exit(127);
}

}  // namespace

Result<ChildProcess> ChildProcess::start(const std::string& program, const std::vector<std::string>& arguments,
                                         const std::string& log) {
  if (::access(program.c_str(), X_OK) != 0) {
    return make_error(Errc::kNotFound, "%s: %s", program.c_str(), std::strerror(errno));
  }
  int to_child[2];
  int from_child[2];
  if (::pipe2(to_child, O_CLOEXEC) != 0) return make_error(Errc::kIo, "pipe: %s", std::strerror(errno));
  ChildProcess child;
  const transport::UniqueFd child_input(to_child[0]);
  child.input_.reset(to_child[1]);
  if (::pipe2(from_child, O_CLOEXEC) != 0) return make_error(Errc::kIo, "pipe: %s", std::strerror(errno));
  const transport::UniqueFd child_output(from_child[1]);
  child.output_.reset(from_child[0]);
  ::fcntl(child.output_.get(), F_SETFL, O_NONBLOCK);
  const transport::UniqueFd log_file(::open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600));
  if (!log_file) return make_error(Errc::kIo, "cannot write %s: %s", log.c_str(), std::strerror(errno));

  std::vector<std::string> words{program};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> pointers;
  pointers.reserve(words.size() + 1);
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  child.pid_ = ::fork();
  if (child.pid_ < 0) return make_error(Errc::kIo, "fork: %s", std::strerror(errno));
  if (child.pid_ == 0) become(program.c_str(), pointers.data(), child_input.get(), child_output.get(), log_file.get());
  return child;
}

ChildProcess::ChildProcess(ChildProcess&& other) noexcept
    : pid_(std::exchange(other.pid_, -1)),
      input_(std::move(other.input_)),
      output_(std::move(other.output_)),
      text_(std::move(other.text_)),
      exit_code_(other.exit_code_) {}

ChildProcess::~ChildProcess() {
  if (pid_ > 0 && !exit_code()) wait(transport::now());
}

bool ChildProcess::read_output() {
  char chunk[4096];
  const ssize_t size = ::read(output_.get(), chunk, sizeof chunk);
  if (size <= 0) return false;
  text_.append(chunk, static_cast<std::size_t>(size));
  return true;
}

std::optional<std::string> ChildProcess::next_line() {
  while (read_output()) {
  }
  const std::size_t end = text_.find('\n');
  if (end == std::string::npos) return std::nullopt;
  std::string line = text_.substr(0, end);
  text_.erase(0, end + 1);
  return line;
}

void ChildProcess::send_line(const std::string& line) {
  const std::string message = line + "\n";
  [[maybe_unused]] const auto written = ::write(input_.get(), message.data(), message.size());
}

void ChildProcess::signal(int number) const noexcept {
  if (pid_ > 0 && !exit_code_) ::kill(pid_, number);
}

std::optional<int> ChildProcess::exit_code() noexcept {
  if (exit_code_) return exit_code_;
  int status = 0;
  const pid_t ended = ::waitpid(pid_, &status, WNOHANG);
  if (ended == 0 || (ended < 0 && errno == EINTR)) return std::nullopt;
  if (ended < 0) return exit_code_ = 127;  // somebody else has taken its exit code
  exit_code_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  return exit_code_;
}

int ChildProcess::wait(TimePoint deadline) noexcept {
  bool killed = false;
  while (!exit_code()) {
    if (!killed && transport::now() >= deadline) {
      ::kill(pid_, SIGKILL);
      killed = true;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return *exit_code_;
}

}  // namespace embody::ctl
