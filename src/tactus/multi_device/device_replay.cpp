#include "tactus/multi_device/device_replay.h"

namespace tactus {
namespace {

/// Every context but the first, with its number among those.
template <class F>
void each_other(DeviceSet& devices, F&& body) {
  for (int part = 1; part < devices.count(); ++part)
    body(devices.context(part), static_cast<std::size_t>(part - 1));
}

}  // namespace

bool is_profiling(DeviceSet& devices) {
  bool any = false;
  devices.for_each_part([&](ExecContext& ctx, int) { any |= ctx.is_profiling(); });
  return any;
}

void DeviceGraph::record(DeviceSet& devices, const std::function<void()>& work) {
  ExecContext& first = devices.context(0);
  join_.resize(static_cast<std::size_t>(devices.count() - 1));
  ready_.resize(join_.size());
  graph_ = first.capture([&] {
    first.record(fork_);
    each_other(devices, [&](ExecContext& ctx, std::size_t) { ctx.wait(fork_); });
    work();
    each_other(devices, [&](ExecContext& ctx, std::size_t i) {
      ctx.record(join_[i]);
      first.wait(join_[i]);
    });
  });
}

void DeviceGraph::launch(DeviceSet& devices) {
  ExecContext& first = devices.context(0);
  each_other(devices, [&](ExecContext& ctx, std::size_t i) {
    ctx.record(ready_[i]);
    first.wait(ready_[i]);
  });
  first.launch(*graph_);
  if (devices.count() == 1) return;
  first.record(done_);
  each_other(devices, [&](ExecContext& ctx, std::size_t) { ctx.wait(done_); });
}

void DeviceGraph::launch_on(ExecContext& ctx) { ctx.launch(*graph_); }

void DeviceReplay::run(DeviceSet& devices, const std::function<void()>& stage) {
  if (devices.context(0).is_recording()) return stage();
  if (!devices.is_cuda() || is_profiling(devices) || runs_++ == 0) return stage();
  if (!graph_.is_recorded()) graph_.record(devices, stage);
  graph_.launch(devices);
}

}  // namespace tactus
