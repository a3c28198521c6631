// Runs fn(0) … fn(count - 1) on up to `threads` threads; what fn throws is thrown to the caller.
#pragma once

#include <functional>

namespace skein::sim {

void ParallelFor(int count, int threads, const std::function<void(int)>& fn);

}  // namespace skein::sim
