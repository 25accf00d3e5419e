#include "tactus/run/scene_source.h"

#include <optional>

#include "tactus/base/error.h"
#include "tactus/rig/markers.h"
#include "tactus/rig/rig_file.h"
#include "tactus/rig/sources/frame_source.h"
#include "tactus/run/frame_sources.h"

namespace tactus {
namespace {

/// Dictionary of the markers on the scene's tools; nullptr where no tool wears markers.
const std::string* marker_dictionary_of(const Scene& scene) {
  for (const BladeDescription& blade : scene.blades)
    if (blade.tracked && !blade.tracked->markers.empty()) return &blade.tracked->dictionary;
  return nullptr;
}

class SceneSource final : public SourceFilter {
 public:
  SceneSource(std::unique_ptr<FrameSource> source, const Scene& scene, std::string named)
      : SourceFilter(std::move(source)),
        named_(std::move(named)),
        kind_(scene.source.kind),
        path_(scene.source.path),
        photographs_(scene.view.photographs) {
    if (const std::string* dictionary = marker_dictionary_of(scene)) dictionary_ = *dictionary;
  }

  NextFrame next(FrameSet& frame) override {
    const NextFrame next = SourceFilter::next(frame);
    if (next != NextFrame::success) return next;
    if (is_first_ && photographs_ > 0 && frame.colors.empty()) refuse_clay();
    is_first_ = false;
    if (!dictionary_) return next;
    if (frame.colors.empty())
      throw usage_error(named_ + ": a blade has 'markers', but its source has no photographs to see them in");
    frame.markers = find_markers(frame.colors, *dictionary_);
    return next;
  }

 private:
  /// It would look like a mistake in the texture.
  [[noreturn]] void refuse_clay() const {
    throw usage_error(named_ + ": 'view.photographs' is " + std::to_string(photographs_) +
                      ", but its source has no photographs" +
                      (kind_ == SourceKind::masks
                           ? " for every camera: '" + path_ + "' needs a 'photo' beside each 'mask'"
                           : "") +
                      "; expected 0 for a surface of clay");
  }

  std::string named_;
  SourceKind kind_;
  std::string path_;
  int photographs_;
  bool is_first_ = true;
  std::optional<std::string> dictionary_;
};

}  // namespace

Rig read_rig(const std::string& path) { return read_rig_file(path).rig; }

bool has_markers(const Scene& scene) { return marker_dictionary_of(scene) != nullptr; }

std::unique_ptr<FrameSource> open_scene_source(const Scene& scene, const std::string& named) {
  if (has_markers(scene) && !markers_missing().empty())
    throw Error(named + ": a blade has 'markers', but " + markers_missing());
  return std::make_unique<SceneSource>(
      open_frame_source(scene.source, {.colors = scene.view.photographs > 0 || has_markers(scene),
                                       .depth = scene.reconstruction.depth}),
      scene, named);
}

}  // namespace tactus
