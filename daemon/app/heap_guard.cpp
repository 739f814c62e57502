#include "daemon/app/heap_guard.hpp"

#include <atomic>
#include <bit>
#include <cerrno>
#include <cstddef>

namespace {

std::atomic<std::uint64_t> heap_uses{0};
thread_local bool watched = false;

}  // namespace

namespace embody::heap_guard {

void watch_this_thread() noexcept {
  watched = true;
}
std::uint64_t count() noexcept {
  return heap_uses.load(std::memory_order_relaxed);
}

#ifdef EMBODY_SANITIZED
bool active() noexcept {
  return false;
}
#else
bool active() noexcept {
  return true;
}
#endif

}  // namespace embody::heap_guard

#ifndef EMBODY_SANITIZED
// glibc allows a program to replace the malloc family (manual, "Replacing malloc"); its own versions stay reachable.
extern "C" {

void* __libc_malloc(std::size_t size);
void __libc_free(void* block);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* block, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);

static void note() noexcept {
  if (watched) heap_uses.fetch_add(1, std::memory_order_relaxed);
}

void* malloc(std::size_t size) {
  note();
  return __libc_malloc(size);
}
void free(void* block) {
  if (block != nullptr) note();
  __libc_free(block);
}
void* calloc(std::size_t count, std::size_t size) {
  note();
  return __libc_calloc(count, size);
}
void* realloc(void* block, std::size_t size) {
  note();
  return __libc_realloc(block, size);
}
void* memalign(std::size_t alignment, std::size_t size) {
  note();
  return __libc_memalign(alignment, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  note();
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** block, std::size_t alignment, std::size_t size) {
  note();
  if (alignment % sizeof(void*) != 0 || !std::has_single_bit(alignment)) return EINVAL;
  *block = __libc_memalign(alignment, size);
  return *block == nullptr ? ENOMEM : 0;
}
}
#endif
