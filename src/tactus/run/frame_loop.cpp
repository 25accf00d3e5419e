#include "tactus/run/frame_loop.h"

namespace tactus {

FrameLoop::FrameLoop(FrameSource& source, World& world, Options options)
    : source_(source),
      world_(world),
      options_(std::move(options)),
      is_filmed_(!source.rig().cameras.empty()) {}

bool FrameLoop::is_done() const {
  return (options_.most_frames > 0 && frames_ >= options_.most_frames) ||
         (options_.should_stop && options_.should_stop());
}

void FrameLoop::run() {
  notices_.note(source_.damage());
  const std::optional<int> total =
      options_.most_frames > 0 ? std::optional<int>(options_.most_frames) : source_.frame_count();
  for (FrameSink* sink : sinks_) sink->begin(world_, total);
  FrameSet frame;
  while (!is_done()) {
    const NextFrame next = source_.next(frame);
    if (next == NextFrame::no_more_data) break;
    ++progress_.taken;
    // A live rig gives nothing new until its first images come.
    if (is_filmed_ && next == NextFrame::nothing_new && !progress_.has_images) continue;
    notices_.note(source_.status());
    if (next == NextFrame::bad_frame)
      ++bad_frames_;
    else
      step(frame, next == NextFrame::success);
  }
  if (Perception* seen = world_.perception())
    for (const Notice& notice : seen->last_notices()) notices_.note(notice);
  for (FrameSink* sink : sinks_) sink->end(notices_);
}

void FrameLoop::step(const FrameSet& frame, bool is_new) {
  const double taken_at_s = now_s();
  const double dt_s = progress_.has_time ? frame.time_s - progress_.last_time_s : 0;
  if (Perception* seen = world_.perception())
    world_.set_surface(seen->observe(is_new ? &frame : nullptr, dt_s));
  const StepReport report = world_.step(dt_s);
  progress_.last_time_s = frame.time_s;
  progress_.has_time = true;
  progress_.has_images = is_filmed_;
  ++frames_;
  if (report.hull.overflow) ++open_frames_;
  for (const Notice& notice : report.notices) notices_.note(notice);
  RunFrame shown(world_, frame, report, notices_);
  shown.is_new = is_new;
  shown.number = frames_;
  shown.taken_at_s = taken_at_s;
  for (FrameSink* sink : sinks_) sink->frame(shown);
}

}  // namespace tactus
