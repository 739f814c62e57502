#include "daemon/app/heap_guard.hpp"

#include <gtest/gtest.h>

#include <cerrno>
#include <cstdlib>
#include <functional>
#include <memory>
#include <new>
#include <string>
#include <vector>

#include "daemon/app/thread.hpp"

namespace embody {
namespace {

/// Keeps the compiler from leaving out allocations that nobody uses.
void* escape(void* block) {
  asm volatile("" : "+r"(block) : : "memory");
  return block;
}

struct alignas(64) Wide {
  char bytes[64];
};

struct Use {
  const char* what;
  std::uint64_t uses;
  std::function<void()> body;
};

/// What `body` counts on a thread that is watched, or not.
std::uint64_t uses_on_a_thread(bool watched, const std::function<void()>& body) {
  std::uint64_t uses = 0;
  Thread thread;
  ThreadOptions options;
  options.name = "heap";
  options.watch_heap = watched;
  const Status started = thread.start(options, [&] {
    const std::uint64_t before = heap_guard::count();
    body();
    uses = heap_guard::count() - before;
  });
  EXPECT_TRUE(started.ok());
  thread.join();
  return uses;
}

std::vector<Use> all_uses() {
  static void* kept = nullptr;
  return {
      {"malloc", 1, [] { kept = escape(std::malloc(100)); }},
      {"free", 1, [] { std::free(escape(kept)); }},
      {"free of nothing", 0, [] { std::free(escape(nullptr)); }},
      {"calloc", 1, [] { kept = escape(std::calloc(10, 10)); }},
      {"realloc", 1, [] { kept = escape(std::realloc(kept, 100'000)); }},
      {"free after realloc", 1, [] { std::free(escape(kept)); }},
      {"new and delete", 2, [] { delete static_cast<int*>(escape(new int(3))); }},
      {"new of an over-aligned type", 2, [] { delete static_cast<Wide*>(escape(new Wide)); }},
      {"new without exceptions", 2, [] { ::operator delete(escape(::operator new(10, std::nothrow))); }},
      {"posix_memalign", 1,
       [] {
         void* block = nullptr;
         if (::posix_memalign(&block, 64, 1000) == 0) kept = escape(block);
       }},
      {"free after posix_memalign", 1, [] { std::free(escape(kept)); }},
      {"aligned_alloc", 1, [] { kept = escape(::aligned_alloc(64, 640)); }},
      {"free after aligned_alloc", 1, [] { std::free(escape(kept)); }},
      {"a long std::string", 2, [] { escape(std::string(100, 'x').data()); }},
      {"arithmetic", 0,
       [] {
         int sum = 3;
         escape(&sum);
       }},
  };
}

TEST(HeapGuard, CountsEveryKindOfHeapUseOnAWatchedThread) {
  if (!heap_guard::active()) GTEST_SKIP() << "sanitizers own malloc";
  for (const Use& use : all_uses()) EXPECT_EQ(uses_on_a_thread(true, use.body), use.uses) << use.what;
}

TEST(HeapGuard, CountsNothingOnOtherThreads) {
  if (!heap_guard::active()) GTEST_SKIP() << "sanitizers own malloc";
  for (const Use& use : all_uses()) EXPECT_EQ(uses_on_a_thread(false, use.body), 0U) << use.what;
  const std::uint64_t before = heap_guard::count();
  const auto value = std::make_unique<int>(3);
  escape(value.get());
  EXPECT_EQ(heap_guard::count(), before) << "the main thread is not watched";
}

TEST(HeapGuard, ReplacesTheMallocFamilyFaithfully) {
  for (const std::size_t alignment : {8U, 16U, 64U, 4096U}) {
    void* block = nullptr;
    ASSERT_EQ(::posix_memalign(&block, alignment, 100), 0);
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(block) % alignment, 0U);
    std::free(block);
  }
  auto* const zeros = static_cast<unsigned char*>(std::calloc(1000, 1));
  ASSERT_NE(zeros, nullptr);
  for (int i = 0; i < 1000; ++i) ASSERT_EQ(zeros[i], 0);
  auto* const grown = static_cast<unsigned char*>(std::realloc(zeros, 100'000));
  ASSERT_NE(grown, nullptr);
  for (int i = 0; i < 1000; ++i) ASSERT_EQ(grown[i], 0);
  std::free(grown);
}

TEST(HeapGuard, RefusesAnAlignmentThatIsNone) {
  void* block = nullptr;
  for (const std::size_t alignment : {std::size_t{0}, std::size_t{3}, std::size_t{24}}) {
    EXPECT_EQ(::posix_memalign(&block, alignment, 100), EINVAL) << alignment;
  }
}

}  // namespace
}  // namespace embody
