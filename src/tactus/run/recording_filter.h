#pragma once
/// Writes the frames of a source, with their times and cameras, into a recording.
#include "tactus/rig/wire/recording_file.h"
#include "tactus/run/source_filter.h"

namespace tactus {

class RecordingFilter final : public SourceFilter {
 public:
  /// @throws Error as RecordingWriter.
  RecordingFilter(std::unique_ptr<FrameSource> source, const std::string& path)
      : SourceFilter(std::move(source)), writer_(path, rig(), fps()) {}
  NextFrame next(FrameSet& frame) override {
    const NextFrame next = SourceFilter::next(frame);
    if (next != NextFrame::no_more_data) writer_.add(next, frame, status());
    return next;
  }
  /// The recording is whole. @throws Error.
  void finish() { writer_.finish(); }

 private:
  RecordingWriter writer_;
};

}  // namespace tactus
