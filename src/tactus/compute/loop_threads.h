#pragma once
/// The threads that share the CPU's loops.
#include <atomic>
#include <cstdint>
#include <exception>
#include <vector>

#include "tactus/compute/view.h"

namespace tactus::detail {

/// Threads that share one loop after another with the thread that calls.
///
/// A frame has a thousand loops of some ten microseconds, and data that another core wrote have to be fetched
/// from there. So thread t begins each loop with the t-th part of its indices, where it finds the data that
/// it wrote in the loop before, and takes over pieces of others' parts only when its own is done. A part that
/// no thread began is done by those that are there: nobody waits for a thread that the system has taken off
/// its core.
///
/// Threads spin between loops. After kSpin_s without one they sleep.
class LoopThreads {
 public:
  using Body = void (*)(void* data, Index first, Index last);

  static LoopThreads& of_process();

  /// body(data, first, last) over [0, count), in pieces of at most `grain`; both are at least 1. False, and
  /// nothing is done, when there are no other threads or they have another loop: one of another thread, or
  /// one around this one. @throws the first exception of a body, once no thread is at the loop any more; the
  /// rest of that thread's pieces may be left undone
  bool run(Index count, Index grain, Body body, void* data);

 private:
  static constexpr double kSpin_s = 2e-4;
  /// Of a loop's number; the rest counts loops. Threads without a part see it there, and stay out.
  static constexpr int kPartBits = 12;
  static constexpr Index parts_of(std::uint32_t number) {
    return static_cast<Index>(number & ((1U << kPartBits) - 1));
  }
  struct alignas(64) Part {
    std::atomic<Index> next = 0;
    Index end = 0;
  };
  struct Loop {
    Body body = nullptr;
    void* data = nullptr;
    Index parts = 0, piece = 1;
  };

  explicit LoopThreads(Index thread_count);
  void serve(Index thread);
  void work(Index own_part) noexcept;
  void run_pieces(Loop loop, Index own_part);
  std::uint32_t wait_for_other_than(std::uint32_t seen);

  const Index thread_count_;
  std::vector<Part> parts_;
  Loop loop_;
  std::atomic<bool> is_busy_ = false;
  alignas(64) std::atomic<std::uint32_t> number_ = 0;  ///< of the latest loop, and its parts
  std::atomic<std::uint32_t> open_ = 0;                ///< number of the loop that may be joined; 0: none
  std::atomic<int> sleeping_ = 0;
  alignas(64) std::atomic<int> joined_ = 0;  ///< threads, beside the caller, that may be reading loop_
  std::atomic<bool> failed_ = false;
  std::exception_ptr failure_;  ///< of the first body that threw; the thread that set `failed_` writes it
};

}  // namespace tactus::detail
