#include "tactus/rig/wire/recording_file.h"
#include "tactus/run/scene_source.h"

namespace tactus {

RecordingFilter::RecordingFilter(std::unique_ptr<FrameSource> source, const std::string& path)
    : SourceFilter(std::move(source)), writer_(std::make_unique<RecordingWriter>(path, rig(), fps())) {}

RecordingFilter::~RecordingFilter() = default;

NextFrame RecordingFilter::next(FrameSet& frame) {
  const NextFrame next = SourceFilter::next(frame);
  if (next != NextFrame::no_more_data) writer_->add(next, frame, status());
  return next;
}

void RecordingFilter::finish() { writer_->finish(); }

}  // namespace tactus
