#pragma once
/// A source of frames that stands before another.
#include "tactus/rig/sources/frame_source.h"

namespace tactus {

/// Passes everything on; derived filters override the calls that they change.
class SourceFilter : public FrameSource {
 public:
  explicit SourceFilter(std::unique_ptr<FrameSource> source) : source_(std::move(source)) {}
  const Rig& rig() const override { return source_->rig(); }
  std::optional<int> frame_count() const override { return source_->frame_count(); }
  std::optional<double> fps() const override { return source_->fps(); }
  NextFrame next(FrameSet& frame) override { return source_->next(frame); }
  std::string status() const override { return source_->status(); }
  std::string damage() const override { return source_->damage(); }
  const Figure* truth() const override { return source_->truth(); }
  std::string links_json() const override { return source_->links_json(); }

 private:
  std::unique_ptr<FrameSource> source_;
};

}  // namespace tactus
