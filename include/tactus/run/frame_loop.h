#pragma once
/// The loop over frames: a source, a world, and sinks that see each frame.
#include <functional>
#include <optional>
#include <string>

#include "tactus/run/frame_sink.h"

namespace tactus {

/// How far a run has come in its source.
struct RunProgress {
  std::int64_t taken = 0;  ///< frames of the source, bad ones too
  double last_time_s = 0;  ///< of the last good one
  bool has_time = false;   ///< there was one
  bool has_images = false;
};

/// Takes frames from a source until it ends, lets the world and its perception make them frames, and shows
/// each frame to all sinks.
///
///   DeviceSet devices("auto");
///   const Scene scene = read_scene("scenes/demo.yaml");
///   const std::unique_ptr<FrameSource> source = open_scene_source(scene);
///   const BodyAssets assets = load_body_assets(scene);
///   const auto perception = make_perception(devices, scene, source->rig(), assets);
///   World world(devices, scene, assets, perception.get());
///   const std::unique_ptr<FrameSink> meshes = make_mesh_sink(scene, "out/demo");
///   FrameLoop loop(*source, world);
///   loop.add(*meshes);
///   loop.run();
class FrameLoop {
 public:
  struct Options {
    int most_frames = 0;                ///< 0: all of the source
    std::function<bool()> should_stop;  ///< asked before each frame; none: never
  };
  /// Keeps references to both.
  FrameLoop(FrameSource& source, World& world) : FrameLoop(source, world, Options()) {}
  FrameLoop(FrameSource& source, World& world, Options options);

  /// Keeps a reference. Sinks see a frame in the order in which they were added.
  void add(FrameSink& sink) { sinks_.push_back(&sink); }
  /// Continues a run whose source and simulation have come as far as `progress` (read_checkpoint).
  void go_on_from(const RunProgress& progress) { progress_ = progress; }
  /// @throws any exception of the source, the simulation or a sink.
  void run();

  const RunProgress& progress() const { return progress_; }
  RunNotices& notices() { return notices_; }
  const RunNotices& notices() const { return notices_; }
  int frames() const { return frames_; }          ///< that were simulated
  int bad_frames() const { return bad_frames_; }  ///< that no camera delivered
  /// Frames with a real surface that exceeded its capacity: it is not closed.
  int open_frames() const { return open_frames_; }

 private:
  bool is_done() const;
  void step(const FrameSet& frame, bool is_new);

  FrameSource& source_;
  World& world_;
  Options options_;
  std::vector<FrameSink*> sinks_;
  bool is_filmed_;
  RunProgress progress_;
  RunNotices notices_;
  int frames_ = 0, bad_frames_ = 0, open_frames_ = 0;
};

/// Takes the first `count` frames of a source once more. @returns the last that had images; none: none had
/// @throws Error beginning with `path` when the source has fewer.
std::optional<FrameSet> take_again(FrameSource& source, std::int64_t count, const std::string& path);
/// A run stops, and goes on with the same bits: this after the last frame. @throws Error when the file can't
/// be written.
void write_checkpoint(const std::string& path, const std::string& scene_path, const RunProgress& progress,
                      World& world);
/// Before the first: reads the frames of the source that were taken, and takes over the state after them.
/// @throws Error naming the difference: another scene, another program's file, a source that ends before.
RunProgress read_checkpoint(const std::string& path, const std::string& scene_path, FrameSource& source,
                            World& world);

}  // namespace tactus
