#include "tests/unit/hand/heap_counter.hpp"

#include <cstddef>

namespace {
thread_local std::uint64_t allocations = 0;
}

std::uint64_t embody::test::heap_allocations() noexcept {
  return allocations;
}

#ifndef EMBODY_SANITIZED
// glibc lets a program replace malloc; operator new and Eigen end here.
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* block, std::size_t size);

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
}
#endif
