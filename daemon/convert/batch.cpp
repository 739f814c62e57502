#include "daemon/convert/batch.hpp"

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <mutex>
#include <numeric>
#include <thread>
#include <vector>

namespace embody::convert {

void run_batch(std::size_t count, std::size_t threads, const std::function<void(std::size_t, const Progress&)>& work,
               const Progress& tick) {
  std::vector<std::atomic<double>> parts(count);
  for (auto& part : parts) part.store(0.0, std::memory_order_relaxed);
  std::atomic<std::size_t> next{0};
  std::size_t running = std::clamp<std::size_t>(threads, 1, std::max<std::size_t>(count, 1));
  std::mutex mutex;
  std::condition_variable ended;
  const auto run = [&] {
    for (std::size_t i = next.fetch_add(1); i < count; i = next.fetch_add(1)) {
      work(i, [&part = parts[i]](double done) { part.store(done, std::memory_order_relaxed); });
      parts[i].store(1.0, std::memory_order_relaxed);
    }
    const std::lock_guard lock(mutex);
    if (--running == 0) ended.notify_one();
  };
  std::vector<std::thread> pool;
  for (std::size_t n = running; n > 0; --n) pool.emplace_back(run);
  std::unique_lock lock(mutex);
  while (!ended.wait_for(lock, std::chrono::milliseconds(100), [&] { return running == 0; })) {
    const double done = std::accumulate(parts.begin(), parts.end(), 0.0,
                                        [](double sum, const auto& part) { return sum + part.load(); });
    if (tick) tick(done / static_cast<double>(count));
  }
  lock.unlock();
  for (std::thread& thread : pool) thread.join();
}

}  // namespace embody::convert
