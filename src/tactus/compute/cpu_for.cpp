#include "tactus/compute/cpu_for.h"

#include "tactus/compute/loop_threads.h"

namespace tactus::detail {

void cpu_for_ranges(Index count, Index grain, void (*body)(void* data, Index first, Index last), void* data) {
  if (count <= 0) return;
  if (count > grain && LoopThreads::of_process().run(count, grain, body, data)) return;
  body(data, 0, count);
}

}  // namespace tactus::detail
