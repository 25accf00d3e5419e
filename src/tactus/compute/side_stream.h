#pragma once
/// Work beside a context's own: small kernels that don't need one another fill a GPU together.
#include "tactus/compute/exec_context.h"

namespace tactus {

/// A second stream of a context's device. What it is given waits for all that the context was given before
/// `follow`; what the context is given after `join` waits for all of it. Every `follow` needs its `join`
/// before a recording ends.
class SideStream {
 public:
  explicit SideStream(Device& device) : beside_(device) {}

  /// Where to submit. While kernels are timed one by one, the context itself.
  ExecContext& follow(ExecContext& ctx) {
    if (ctx.is_profiling()) return ctx;
    ctx.record(ready_);
    beside_.wait(ready_);
    return beside_;
  }
  void join(ExecContext& ctx) {
    if (ctx.is_profiling()) return;
    beside_.record(done_);
    ctx.wait(done_);
  }

 private:
  ExecContext beside_;
  Event ready_, done_;
};

}  // namespace tactus
