#include "tactus/base/error.h"
#include "tactus/rig/sources/data_sources.h"
#include "tactus/rig/sources/frame_window.h"
#include "tactus/rig/wire/recording_file.h"

namespace tactus {
namespace {

class RecordingSource final : public FrameSource {
 public:
  RecordingSource(const std::string& path, const DataOptions& options)
      : reader_(path), rig_(reader_.rig()), wanted_{options.alphas, options.colors, options.depth} {
    if (options.fps)
      throw usage_error("recording '" + path +
                        "': 'fps' is for sources without times; its frames have theirs");
    if (reader_.count() == 0) throw Error("recording '" + path + "' holds no frame: it was cut off before");
    if (!options.depth) rig_.depth_cameras.clear();
    if (options.workspace_m) rig_.workspace_m = *options.workspace_m;
    const std::string why = reader_.damage().empty() ? "" : " (" + reader_.damage() + ")";
    window_ =
        frame_window(path, options.first_frame, options.last_frame, FrameWindow{0, reader_.count() - 1}, why);
    at_ = window_.first;
  }
  const Rig& rig() const override { return rig_; }
  std::optional<int> frame_count() const override { return window_.last - window_.first + 1; }
  std::optional<double> fps() const override { return reader_.fps(); }
  NextFrame next(FrameSet& frame) override {
    if (at_ > window_.last) return NextFrame::no_more_data;
    return reader_.read(at_++, wanted_, frame, status_);
  }
  std::string status() const override { return status_; }
  std::string damage() const override {
    return reader_.damage().empty() ? "" : "the recording is not whole: " + reader_.damage();
  }

 private:
  RecordingReader reader_;
  Rig rig_;
  RecordingReader::Wanted wanted_;
  FrameWindow window_;
  int at_ = 0;
  std::string status_;
};

}  // namespace

std::unique_ptr<FrameSource> open_recording(const std::string& path, const DataOptions& options) {
  return std::make_unique<RecordingSource>(path, options);
}

}  // namespace tactus
