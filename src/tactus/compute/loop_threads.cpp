#include "tactus/compute/loop_threads.h"

#if defined(__SSE2__)
#include <immintrin.h>
#endif
#include <tbb/info.h>

#include <algorithm>
#include <thread>
#include <utility>

#include "tactus/base/math.h"
#include "tactus/base/timing.h"

namespace tactus::detail {
namespace {

/// Called by a thread that spins: leaves the core's units to others for some cycles.
void pause_briefly() {
#if defined(__SSE2__)
  _mm_pause();
#endif
}

}  // namespace

LoopThreads& LoopThreads::of_process() {
  // As many as TBB would start, which heeds the cores that the process may use. They are never ended: loops
  // may run in destructors of other statics.
  static auto* const threads =
      new LoopThreads(std::clamp(tbb::info::default_concurrency(), 1, (1 << kPartBits) - 1));
  return *threads;
}

LoopThreads::LoopThreads(Index thread_count)
    : thread_count_(thread_count), parts_(static_cast<std::size_t>(thread_count)) {
  for (Index t = 1; t < thread_count; ++t) std::thread([this, t] { serve(t); }).detach();
}

bool LoopThreads::run(Index count, Index grain, Body body, void* data) {
  if (thread_count_ == 1 || is_busy_.exchange(true, std::memory_order_acquire)) return false;
  const Index parts = std::min(thread_count_, ceil_div(count, grain));
  // Several pieces a part: others can take over the pieces that a slow thread leaves.
  loop_ = {body, data, parts, std::min(grain, ceil_div(count, 4 * parts))};
  const auto begin_of = [&](Index part) {
    return static_cast<Index>(static_cast<std::int64_t>(count) * part / parts);
  };
  for (Index p = 0; p < parts; ++p) {
    Part& part = parts_[static_cast<std::size_t>(p)];
    part.end = begin_of(p + 1);
    part.next.store(begin_of(p), std::memory_order_relaxed);
  }
  const std::uint32_t last = number_.load(std::memory_order_relaxed) >> kPartBits,
                      number = (last + 1) << kPartBits | static_cast<std::uint32_t>(parts);
  open_.store(number);
  number_.store(number);
  if (sleeping_.load() > 0) number_.notify_all();
  work(0);
  // A thread counts itself in `joined_` before it looks at `open_`: either it is waited for here, or it comes
  // too late and doesn't touch the loop.
  open_.store(0);
  constexpr int kPatience = 20'000;
  for (int spins = 0; joined_.load() > 0; ++spins) {
    if (spins < kPatience)
      pause_briefly();
    else
      std::this_thread::yield();
  }
  const std::exception_ptr failure = failed_.exchange(false) ? std::exchange(failure_, nullptr) : nullptr;
  is_busy_.store(false, std::memory_order_release);
  if (failure) std::rethrow_exception(failure);
  return true;
}

void LoopThreads::work(Index own_part) noexcept {
  try {
    run_pieces(loop_, own_part);
  } catch (...) {
    if (!failed_.exchange(true)) failure_ = std::current_exception();
  }
}

void LoopThreads::run_pieces(Loop loop, Index own_part) {
  for (Index k = 0; k < loop.parts; ++k) {
    Part& part = parts_[static_cast<std::size_t>((own_part + k) % loop.parts)];
    while (part.next.load(std::memory_order_relaxed) < part.end) {
      const Index first = part.next.fetch_add(loop.piece, std::memory_order_relaxed);
      if (first < part.end) loop.body(loop.data, first, std::min(part.end, first + loop.piece));
    }
  }
}

void LoopThreads::serve(Index thread) {
  for (std::uint32_t seen = 0;;) {
    seen = wait_for_other_than(seen);
    if (thread >= parts_of(seen)) continue;
    joined_.fetch_add(1);
    if (open_.load() == seen) work(thread);
    joined_.fetch_sub(1);
  }
}

std::uint32_t LoopThreads::wait_for_other_than(std::uint32_t seen) {
  constexpr int kLooks = 64;  // between two looks at the clock
  const double begin_s = now_s();
  do {
    for (int i = 0; i < kLooks; ++i) {
      const std::uint32_t number = number_.load();
      if (number != seen) return number;
      pause_briefly();
    }
  } while (now_s() - begin_s < kSpin_s);
  sleeping_.fetch_add(1);
  number_.wait(seen);
  sleeping_.fetch_sub(1);
  return number_.load();
}

}  // namespace tactus::detail
