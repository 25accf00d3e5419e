#pragma once
/// Work beside a context's own: small kernels that don't need one another fill a GPU together.
#include "tactus/compute/exec_context.h"

namespace tactus {

/// A second stream of a context's device. Its work waits for all work submitted to the context before
/// `follow`. Work submitted to the context after `join` waits for all of the side stream's. Every `follow`
/// needs its `join` before a recording ends.
class SideStream {
 public:
  explicit SideStream(Device& device) : side_stream_(device) {}

  /// See ExecContext.
  void reserve_scratch(Index n) { side_stream_.reserve_scratch(n); }
  /// Where to submit. While kernels are timed one by one, the context itself.
  ExecContext& follow(ExecContext& ctx) {
    if (ctx.is_profiling()) return ctx;
    ctx.record(ready_);
    side_stream_.wait(ready_);
    return side_stream_;
  }
  void join(ExecContext& ctx) {
    if (ctx.is_profiling()) return;
    side_stream_.record(done_);
    ctx.wait(done_);
  }

 private:
  ExecContext side_stream_;
  Event ready_, done_;
};

}  // namespace tactus
