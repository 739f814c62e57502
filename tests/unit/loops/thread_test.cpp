#include "daemon/app/thread.hpp"

#include <gtest/gtest.h>
#include <sched.h>

#include <array>
#include <atomic>
#include <optional>
#include <utility>

namespace embody {
namespace {

TEST(Thread, RunsItsBodyUnderItsNameAndIsJoinedByItsDestructor) {
  std::array<char, 16> name{};
  std::atomic<bool> ran{false};
  {
    Thread thread;
    ThreadOptions options;
    options.name = "a name that is too long";
    ASSERT_TRUE(thread
                    .start(options,
                           [&] {
                             pthread_getname_np(pthread_self(), name.data(), name.size());
                             ran = true;
                           })
                    .ok());
  }
  EXPECT_TRUE(ran);
  EXPECT_STREQ(name.data(), "a name that is ");
}

/// Policy and priority of a thread started with `priority`, or nothing when that is refused.
std::optional<std::pair<int, int>> scheduling(int priority) {
  std::pair<int, int> result{-1, -1};
  Thread thread;
  ThreadOptions options;
  options.name = "scheduled";
  options.fifo_priority = priority;
  const Status started = thread.start(options, [&] {
    sched_param parameter{};
    pthread_getschedparam(pthread_self(), &result.first, &parameter);
    result.second = parameter.sched_priority;
  });
  if (!started) {
    EXPECT_EQ(started.error().code, Errc::kPermission);
    return std::nullopt;
  }
  thread.join();
  return result;
}

TEST(Thread, HasItsOwnScheduling) {
  EXPECT_EQ(scheduling(0), std::make_pair(SCHED_OTHER, 0));
  const bool allowed = may_use_fifo(5);
  const auto fifo = scheduling(5);
  EXPECT_EQ(fifo.has_value(), allowed) << "may_use_fifo() and start() disagree";
  if (!allowed) GTEST_SKIP() << "no right to use SCHED_FIFO here";
  EXPECT_EQ(fifo, std::make_pair(SCHED_FIFO, 5));
}

TEST(Thread, DoesNotInheritTheSchedulingOfItsCreator) {
  if (!may_use_fifo(5)) GTEST_SKIP() << "no right to use SCHED_FIFO here";
  std::optional<std::pair<int, int>> inner;
  Thread outer;
  ThreadOptions options;
  options.name = "outer";
  options.fifo_priority = 5;
  ASSERT_TRUE(outer.start(options, [&] { inner = scheduling(0); }).ok());
  outer.join();
  EXPECT_EQ(inner, std::make_pair(SCHED_OTHER, 0));
}

TEST(Thread, KeepsToItsProcessors) {
  cpu_set_t allowed;
  CPU_ZERO(&allowed);
  ASSERT_EQ(::sched_getaffinity(0, sizeof allowed, &allowed), 0);
  int cpu = 0;
  while (!CPU_ISSET(static_cast<unsigned>(cpu), &allowed)) ++cpu;
  cpu_set_t used;
  CPU_ZERO(&used);
  Thread thread;
  ThreadOptions options;
  options.name = "pinned";
  options.cpus = {cpu};
  ASSERT_TRUE(thread.start(options, [&] { pthread_getaffinity_np(pthread_self(), sizeof used, &used); }).ok());
  thread.join();
  EXPECT_EQ(CPU_COUNT(&used), 1);
  EXPECT_TRUE(CPU_ISSET(static_cast<unsigned>(cpu), &used));
}

TEST(Thread, SaysWhatIsWrongAndRunsNothingWhenItCannotStart) {
  std::atomic<bool> ran{false};
  Thread thread;
  ThreadOptions options;
  options.name = "nowhere";
  options.cpus = {1023};  // no such processor here
  const Status started = thread.start(options, [&] { ran = true; });
  if (started.ok()) GTEST_SKIP() << "this machine has 1024 processors";
  EXPECT_NE(started.error().detail.view().find("nowhere"), std::string_view::npos);
  thread.join();
  EXPECT_FALSE(ran);
}

TEST(Thread, IsReadyForUseAgainAfterJoin) {
  Thread thread;
  ThreadOptions options;
  options.name = "twice";
  int runs = 0;
  for (int i = 0; i < 2; ++i) {
    ASSERT_TRUE(thread.start(options, [&] { ++runs; }).ok());
    thread.join();
  }
  thread.join();
  EXPECT_EQ(runs, 2);
}

}  // namespace
}  // namespace embody
