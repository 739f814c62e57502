#pragma once
// Independent pieces of work on several threads.
#include <cstddef>
#include <functional>

namespace embody::convert {

/// Tells the part of its piece that is done, 0..1.
using Progress = std::function<void(double)>;

/// Calls work(i, progress) once for each i < count, on up to `threads` threads, in the order of i, and returns when all
/// are done. Meanwhile `tick` is called with the part that is done of everything, ten times per second, on the calling
/// thread. `work` must not throw.
void run_batch(std::size_t count, std::size_t threads, const std::function<void(std::size_t, const Progress&)>& work,
               const Progress& tick);

}  // namespace embody::convert
