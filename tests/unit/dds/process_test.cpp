// The publisher and the example subscriber in two processes, so that samples really cross the loopback.
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <optional>

#include "tests/unit/dds/dds_test_support.hpp"

namespace embody {
namespace {

using dds::test::private_config;
using Clock = std::chrono::steady_clock;

/// The example subscriber as a child process; killed and reaped at the latest by the destructor.
class Subscriber {
 public:
  explicit Subscriber(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), EMBODY_DDS_SUBSCRIBER);
    std::vector<char*> argv;
    for (std::string& a : arguments) argv.push_back(a.data());
    argv.push_back(nullptr);
    int ends[2];
    if (::pipe2(ends, O_CLOEXEC) != 0) return;
    posix_spawn_file_actions_t actions;
    ::posix_spawn_file_actions_init(&actions);
    ::posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
    if (::posix_spawn(&pid_, argv[0], &actions, nullptr, argv.data(), environ) != 0) pid_ = -1;
    ::posix_spawn_file_actions_destroy(&actions);
    ::close(ends[1]);
    output_ = ends[0];
  }
  Subscriber(const Subscriber&) = delete;
  Subscriber& operator=(const Subscriber&) = delete;
  ~Subscriber() {
    if (pid_ > 0) send(SIGKILL), exit_code();
    ::close(output_);
  }

  void send(int signal_number) const { ::kill(pid_, signal_number); }
  [[nodiscard]] const std::string& text() const { return text_; }

  /// Waits up to 20 ms for output; false at its end.
  bool read_more() {
    pollfd wait{output_, POLLIN, 0};
    if (::poll(&wait, 1, 20) != 1) return true;
    char bytes[4096];
    const ssize_t size = ::read(output_, bytes, sizeof bytes);
    if (size > 0) text_.append(bytes, static_cast<std::size_t>(size));
    return size > 0;
  }
  int exit_code() {
    int status = 0;
    if (pid_ <= 0 || ::waitpid(pid_, &status, 0) != pid_) return -1;
    pid_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

 private:
  pid_t pid_{-1};
  int output_{-1};
  std::string text_;
};

std::string domain() {
  return std::to_string(dds::test::private_domain());
}

TEST(DdsAcrossProcesses, TheExampleSubscriberPrintsWhatWasPublished) {
  auto publisher = DdsPublisher::create(private_config());
  ASSERT_TRUE(publisher) << publisher.error().detail.c_str();
  Subscriber subscriber({"--domain", domain(), "--count", "40", "--timeout", "30"});
  const std::vector<std::string> names{"elbow_joint", "j_index_fle"};
  const std::vector<double> q{-1.25, 0.5};
  Pose X_WM = Pose::Identity();
  X_WM.translation() = Eigen::Vector3d(0.1, 0.2, 0.3);
  StatusSample status;
  status.mode = "engaged";
  status.cause = "operator";
  while (subscriber.read_more()) {
    EXPECT_TRUE(publisher->publish_joint_states(names, q, {}, WallTime(std::chrono::seconds(12))));
    EXPECT_TRUE(publisher->publish_hand_pose(X_WM, "mocap", WallTime(std::chrono::seconds(12))));
    EXPECT_TRUE(publisher->publish_hand_state({}));
    EXPECT_TRUE(publisher->publish_status(status));
  }
  EXPECT_EQ(subscriber.exit_code(), 0);
  for (const char* line : {"[12.000000000] joint states: elbow_joint -1.2500 j_index_fle 0.5000",
                           "hand pose in mocap: p = 0.1000 0.2000 0.3000 m, q(xyzw) = 0.0000 0.0000 0.0000 1.0000",
                           "hand state 0 (invalid)", "status: engaged (operator)"})
    EXPECT_NE(subscriber.text().find(line), std::string::npos) << line << "\nis not in\n" << subscriber.text();
}

TEST(DdsAcrossProcesses, APublisherNeitherWritesNorClosesSlowlyWhenASubscriberHangs) {
  auto created = DdsPublisher::create(private_config());
  ASSERT_TRUE(created) << created.error().detail.c_str();
  std::optional<DdsPublisher> publisher(std::move(*created));
  Subscriber subscriber({"--domain", domain(), "--timeout", "60"});
  const auto deadline = Clock::now() + std::chrono::seconds(20);
  while (subscriber.text().empty() && Clock::now() < deadline) {
    ASSERT_TRUE(publisher->publish_hand_state({}));
    ASSERT_TRUE(subscriber.read_more());
  }
  ASSERT_FALSE(subscriber.text().empty()) << "no sample reached the subscriber";
  subscriber.send(SIGSTOP);
  StatusSample large;
  large.counters.assign(1000, {"a counter with a rather long name, so that queues fill", 1});
  const auto start = Clock::now();
  for (int i = 0; i < 500; ++i) {
    EXPECT_TRUE(publisher->publish_hand_state({}));
    EXPECT_TRUE(publisher->publish_status(large));
  }
  EXPECT_LT(Clock::now() - start, std::chrono::seconds(5));
  EXPECT_EQ(publisher->counters().failed, 0U);
  const auto closing = Clock::now();
  publisher.reset();
  EXPECT_LT(Clock::now() - closing, std::chrono::milliseconds(700));
}

TEST(DdsAcrossProcesses, TheExampleSubscriberSaysWhenNothingCame) {
  EXPECT_EQ(Subscriber({"--domain", domain(), "--timeout", "0.1"}).exit_code(), 1);
  EXPECT_EQ(Subscriber({"--no-such-option"}).exit_code(), 2);
  EXPECT_EQ(Subscriber({"--count", "many"}).exit_code(), 2);
}

}  // namespace
}  // namespace embody
