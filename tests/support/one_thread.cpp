// Linked into a program, it leaves its loops one thread, as on a machine of one core.
#include <sched.h>
#include <tbb/info.h>

namespace {

/// TBB and LoopThreads have as many threads as the process may use cores when TBB first asks, which is here.
/// A process that stayed bound to a core might share it with another one while the next is idle.
[[maybe_unused]] const int threads = [] {
  cpu_set_t all, one;
  if (sched_getaffinity(0, sizeof all, &all) != 0) return 0;
  CPU_ZERO(&one);
  CPU_SET(static_cast<unsigned>(sched_getcpu()), &one);
  if (sched_setaffinity(0, sizeof one, &one) != 0) return 0;
  const int found = tbb::info::default_concurrency();
  sched_setaffinity(0, sizeof all, &all);
  return found;
}();

}  // namespace
