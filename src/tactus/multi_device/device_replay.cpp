#include "tactus/multi_device/device_replay.h"

namespace tactus {

void DeviceReplay::run(DeviceSet& devices, const std::function<void()>& stage) {
  ExecContext& first = devices.context(0);
  bool is_profiling = false;
  devices.for_each_part([&](ExecContext& ctx, int) { is_profiling |= ctx.is_profiling(); });
  if (!devices.is_cuda() || is_profiling || runs_++ == 0) return stage();
  join_.resize(static_cast<std::size_t>(devices.count() - 1));
  ready_.resize(join_.size());
  const auto each_other = [&](auto&& body) {
    for (int part = 1; part < devices.count(); ++part)
      body(devices.context(part), static_cast<std::size_t>(part - 1));
  };
  if (!graph_) {
    graph_ = first.capture([&] {
      first.record(fork_);
      each_other([&](ExecContext& ctx, std::size_t) { ctx.wait(fork_); });
      stage();
      each_other([&](ExecContext& ctx, std::size_t i) {
        ctx.record(join_[i]);
        first.wait(join_[i]);
      });
    });
  }
  each_other([&](ExecContext& ctx, std::size_t i) {
    ctx.record(ready_[i]);
    first.wait(ready_[i]);
  });
  first.launch(*graph_);
  first.record(done_);
  each_other([&](ExecContext& ctx, std::size_t) { ctx.wait(done_); });
}

}  // namespace tactus
