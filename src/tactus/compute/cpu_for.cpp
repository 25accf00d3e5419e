#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "tactus/compute/exec_context.h"

namespace tactus::detail {

void cpu_for_ranges(Index count, Index grain, void (*body)(void* data, Index first, Index last), void* data) {
  if (count <= grain) {
    if (count > 0) body(data, 0, count);
    return;
  }
  tbb::parallel_for(tbb::blocked_range<Index>(0, count, static_cast<std::size_t>(grain)),
                    [&](const tbb::blocked_range<Index>& r) { body(data, r.begin(), r.end()); });
}

}  // namespace tactus::detail
