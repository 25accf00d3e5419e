#pragma once
/// The frames that a scene asks for, recordings of them, and rigs.
#include "tactus/rig/sources/frame_source.h"

namespace tactus {

struct Scene;
class RecordingWriter;

/// The scene's source, with markers found where a tool wears some.
/// @param named before messages: the scene's file
/// @throws Error naming file, figure or value; when a scene wants markers, and they can't be found here. A
/// source without the photographs that the scene wants throws at its first frame.
std::unique_ptr<FrameSource> open_scene_source(const Scene& scene, const std::string& named = "scene");

/// The cameras and the workspace of a rig file (docs/rig.md). @throws Error naming file and line.
Rig read_rig(const std::string& path);

/// Whether a tool of the scene is found by markers.
bool has_markers(const Scene& scene);

/// Writes the frames of a source, with their times and cameras, into a recording, and passes them on.
class RecordingFilter final : public SourceFilter {
 public:
  /// @throws Error when the file is there already, or can't be written.
  RecordingFilter(std::unique_ptr<FrameSource> source, const std::string& path);
  ~RecordingFilter() override;
  NextFrame next(FrameSet& frame) override;
  /// The recording is whole. @throws Error when the disk is full.
  void finish();

 private:
  std::unique_ptr<RecordingWriter> writer_;
};

}  // namespace tactus
