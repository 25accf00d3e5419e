#pragma once
/// Loops over the CPU's cores.
#include <concepts>

#include "tactus/compute/view.h"

namespace tactus {

namespace detail {
/// Runs body(first, last) over [0, count) on the CPU's cores, in pieces of at most `grain`. Inline when one
/// piece is enough, and within another such loop. @throws the exception of a body
void cpu_for_ranges(Index count, Index grain, void (*body)(void* data, Index first, Index last), void* data);
}  // namespace detail

/// f(i) for every i in [0, count), in any order, on the CPU's cores: for the host's own work in a frame.
/// Kernels are launched by ExecContext::parallel_for. @param grain so many are worth a core's while
/// @throws the exception of f
template <std::integral N, class F>
void cpu_for(N count, Index grain, const F& f) {
  detail::cpu_for_ranges(
      static_cast<Index>(count), grain,
      [](void* data, Index first, Index last) {
        const F& each = *static_cast<const F*>(data);
        for (Index i = first; i < last; ++i) each(static_cast<N>(i));
      },
      const_cast<F*>(&f));
}

}  // namespace tactus
