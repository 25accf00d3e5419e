#include "tactus/rig/sources/data_sources.h"

#include "tactus/base/error.h"
#include "tactus/rig/sources/frame_window.h"
#include "tactus/rig/sources/kinect.h"

namespace tactus {

std::unique_ptr<FrameSource> open_source(SourceKind kind, const std::string& path,
                                         const DataOptions& options) {
  switch (kind) {
    case SourceKind::videos:
      return open_videos(path, options);
    case SourceKind::masks:
      return open_masks(path, options);
    case SourceKind::middlebury:
      return open_middlebury(path, options);
    case SourceKind::kinect:
      return open_kinect(path, options);
    case SourceKind::recording:
      return open_recording(path, options);
    case SourceKind::live:
    case SourceKind::synthetic:
    case SourceKind::none:
      break;
  }
  throw usage_error("'" + path + "': a source of kind '" + std::string(word_of(kind)) + "' has no recording");
}

std::string odd_masks(const Rig& rig, const FrameSet& frame) {
  std::string text;
  for (std::size_t i = 0; i < frame.silhouettes.size(); ++i) {
    const BitMask& m = frame.silhouettes[i];
    const std::string odd = odd_coverage(m.area_px(), std::int64_t{m.width_px} * m.height_px);
    if (!odd.empty()) text += (text.empty() ? "camera '" : "; camera '") + rig.cameras[i].name + "': " + odd;
  }
  return text;
}

}  // namespace tactus
