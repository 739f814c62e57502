#include "tests/support/heap_counter.hpp"

#include <cerrno>
#include <cstddef>

namespace {
thread_local std::uint64_t allocations = 0;
}

std::uint64_t embody::test::heap_allocations() noexcept {
  return allocations;
}

#ifdef EMBODY_SANITIZED
bool embody::test::counts_heap() noexcept {
  return false;
}
#else
bool embody::test::counts_heap() noexcept {
  return true;
}

// glibc lets a program replace malloc (manual, "Replacing malloc"); its own versions stay reachable under reserved
// names.
extern "C" {
void* __libc_malloc(std::size_t size);                           // NOLINT(bugprone-reserved-identifier)
void* __libc_calloc(std::size_t count, std::size_t size);        // NOLINT(bugprone-reserved-identifier)
void* __libc_realloc(void* block, std::size_t size);             // NOLINT(bugprone-reserved-identifier)
void* __libc_memalign(std::size_t alignment, std::size_t size);  // NOLINT(bugprone-reserved-identifier)

void* malloc(std::size_t size) {
  ++allocations;
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
  ++allocations;
  return __libc_calloc(count, size);
}
void* realloc(void* block, std::size_t size) {
  ++allocations;
  return __libc_realloc(block, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  ++allocations;
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** block, std::size_t alignment, std::size_t size) {
  ++allocations;
  void* const fresh = __libc_memalign(alignment, size);
  if (fresh == nullptr) return ENOMEM;
  *block = fresh;
  return 0;
}
}
#endif
