#pragma once
/// Recordings on disk as frame sources.
#include <memory>
#include <optional>
#include <string>

#include "tactus/rig/images/silhouettes.h"
#include "tactus/rig/sources/frame_source.h"
#include "tactus/rig/sources/source_kinds.h"

namespace tactus {

struct DataOptions {
  ThresholdOptions threshold;                  ///< Middlebury's silhouettes
  std::optional<Box3f> workspace_m;            ///< instead of the one that the data names
  std::optional<int> first_frame, last_frame;  ///< inclusive, instead of the rig file's; must all be there
  std::optional<double> fps;  ///< instead of the rig file's `frames_per_s`; else the video's own; else 30
  bool colors = true;
  bool depth = true;    ///< of rig files: the depth cameras
  bool alphas = false;  ///< of videos: how much of each pixel the subject covers
};

/// A Middlebury multi-view folder (Seitz et al. 2006): one frame. @throws Error naming the file.
std::unique_ptr<FrameSource> open_middlebury(const std::string& folder, const DataOptions& options = {});
/// Synchronised videos of a rig file, silhouettes by background subtraction. They end with the shortest; the
/// first frame's status says so. A camera whose frame can't be read misses the tick.
/// @throws Error naming rig file, camera and video; usage Error for frames that the videos don't hold.
std::unique_ptr<FrameSource> open_videos(const std::string& rig_file, const DataOptions& options = {});
/// Masks (and, where every camera has a `photo`, colours; and the distances of its `depth_cameras`) of a rig
/// file: one image per camera (one frame), or a printf pattern with one %d: a sequence from the smallest to
/// the largest number with a file when it is opened. A camera whose file is missing or can't be read misses
/// the tick; a number without any file is a bad frame.
/// @throws Error naming rig file, camera and mask; usage Error for frames that the sequence doesn't hold.
std::unique_ptr<FrameSource> open_masks(const std::string& rig_file, const DataOptions& options = {});
/// A recording of `tactus run --record` (wire/recording_file.h): the same sets with the same times. Its
/// frames are numbered from 0. @throws Error naming the file; usage Error for frames that it doesn't hold.
std::unique_ptr<FrameSource> open_recording(const std::string& path, const DataOptions& options = {});
/// Any of these, or kinect (kinect.h). @throws usage Error for a synthetic one.
std::unique_ptr<FrameSource> open_source(SourceKind kind, const std::string& path,
                                         const DataOptions& options = {});

/// "camera 'x': the mask is all black; " for every silhouette without content or without background.
std::string odd_masks(const Rig& rig, const FrameSet& frame);

}  // namespace tactus
