#include "daemon/app/thread.hpp"

#include <sched.h>
#include <sys/mman.h>

#include <cstring>

#include "daemon/app/heap_guard.hpp"

namespace embody {
namespace {

#ifdef EMBODY_SANITIZED
constexpr std::size_t kStackSize = std::size_t{8} * 1024 * 1024;  // sanitizers keep their own state there
#else
constexpr std::size_t kStackSize = std::size_t{512} * 1024;
#endif
constexpr std::size_t kPrefaulted = std::size_t{128} * 1024;

struct Attributes {
  pthread_attr_t value{};
  Attributes() { pthread_attr_init(&value); }
  ~Attributes() { pthread_attr_destroy(&value); }
  Attributes(const Attributes&) = delete;
  Attributes& operator=(const Attributes&) = delete;

  void set_fifo(int priority) noexcept {
    sched_param parameter{};
    parameter.sched_priority = priority;
    pthread_attr_setinheritsched(&value, PTHREAD_EXPLICIT_SCHED);
    pthread_attr_setschedpolicy(&value, priority > 0 ? SCHED_FIFO : SCHED_OTHER);
    pthread_attr_setschedparam(&value, &parameter);
  }
};

/// Touches the stack once, so that no page fault comes later.
void prefault_stack() noexcept {
  volatile char page_toucher[kPrefaulted];
  for (std::size_t i = 0; i < sizeof page_toucher; i += 4096) page_toucher[i] = 0;
}

}  // namespace

Status Thread::start(const ThreadOptions& options, std::function<void()> body) {
  options_ = options;
  body_ = std::move(body);
  Attributes attributes;
  pthread_attr_setstacksize(&attributes.value, kStackSize);
  attributes.set_fifo(options.fifo_priority);
  if (!options.cpus.empty()) {
    cpu_set_t set;
    CPU_ZERO(&set);
    for (const int cpu : options.cpus) CPU_SET(static_cast<unsigned>(cpu), &set);
    pthread_attr_setaffinity_np(&attributes.value, sizeof set, &set);
  }
  if (const int code = pthread_create(&thread_, &attributes.value, &Thread::enter, this); code != 0) {
    return make_error(code == EPERM ? Errc::kPermission : Errc::kIo, "cannot start thread '%s': %s",
                      options.name.c_str(), std::strerror(code));
  }
  running_ = true;
  return {};
}

void Thread::join() noexcept {
  if (!running_) return;
  pthread_join(thread_, nullptr);
  running_ = false;
}

void* Thread::enter(void* self) {
  auto& thread = *static_cast<Thread*>(self);
  pthread_setname_np(pthread_self(), thread.options_.name.substr(0, 15).c_str());
  prefault_stack();
  if (thread.options_.watch_heap) heap_guard::watch_this_thread();
  thread.body_();
  return nullptr;
}

bool may_use_fifo(int priority) noexcept {
  Attributes attributes;
  attributes.set_fifo(priority);
  pthread_t thread{};
  const auto nothing = [](void*) -> void* { return nullptr; };
  if (pthread_create(&thread, &attributes.value, nothing, nullptr) != 0) return false;
  pthread_join(thread, nullptr);
  return true;
}

Status lock_memory() noexcept {
  if (::mlockall(MCL_CURRENT | MCL_FUTURE) == 0) return {};
  return make_error(Errc::kPermission,
                    "cannot lock memory (%s): raise LimitMEMLOCK or 'ulimit -l', or set realtime.lock_memory = false",
                    std::strerror(errno));
}

}  // namespace embody
