#include "tactus/compute/time_stamp.h"

#include "tactus/compute/cuda/cuda_backend.h"

namespace tactus {

struct TimeStamp::Impl {
  std::shared_ptr<double> host_s = std::make_shared<double>(-1);
  void* cuda_event = nullptr;
  ~Impl() {
    if (cuda_event != nullptr) cuda::destroy_event(cuda_event);
  }
};
TimeStamp::TimeStamp() : impl_(std::make_unique<Impl>()) {}
TimeStamp::~TimeStamp() = default;
TimeStamp::TimeStamp(TimeStamp&&) noexcept = default;
TimeStamp& TimeStamp::operator=(TimeStamp&&) noexcept = default;

void TimeStamp::take(ExecContext& ctx) {
  Impl& m = *impl_;
  if (!ctx.device().is_cuda()) return ctx.on_host("time", [at = m.host_s] { *at = now_s(); });
  if (m.cuda_event == nullptr) m.cuda_event = cuda::create_timing_event(ctx.device().ordinal());
  cuda::record_timing_event(ctx.device().ordinal(), m.cuda_event, ctx.cuda_stream());
}

double TimeStamp::seconds_since(const TimeStamp& earlier) const {
  const Impl &a = *earlier.impl_, &b = *impl_;
  if (a.cuda_event != nullptr && b.cuda_event != nullptr)
    return 1e-3 * cuda::elapsed_ms(a.cuda_event, b.cuda_event);
  return *a.host_s >= 0 && *b.host_s >= 0 ? *b.host_s - *a.host_s : 0;
}

}  // namespace tactus
