#include "tactus/base/byte_io.h"
#include "tactus/run/frame_loop.h"

#include "tactus/base/error.h"
#include "tactus/base/read_file.h"
#include "tactus/base/safe_file.h"
#include "tactus/world/world_impl.h"

namespace tactus {
namespace {

struct RunState {
  std::uint64_t scene = 0;  ///< hash of its file
  std::int64_t taken = 0;
  double last_time_s = 0;
};

void archive(StateArchive& a, RunState& state) {
  a.set_owner("run");
  a.value("scene file", state.scene);
  a.value("frames of the source", state.taken);
  a.value("time of the last", state.last_time_s);
}

std::uint64_t hash_of_scene(const std::string& path) { return fnv1a(read_file(path, kMaxYamlBytes)); }

}  // namespace

std::optional<FrameSet> take_again(FrameSource& source, std::int64_t count, const std::string& path) {
  std::optional<FrameSet> last;
  for (std::int64_t taken = 0; taken < count; ++taken) {
    FrameSet frame;
    const NextFrame next = source.next(frame);
    if (next == NextFrame::no_more_data)
      throw Error(path + ": " + std::to_string(count) + " frames were taken from the source, which has " +
                  std::to_string(taken));
    if (next == NextFrame::success) last = std::move(frame);
  }
  return last;
}

void write_checkpoint(const std::string& path, const std::string& scene_path, const RunProgress& progress,
                      World& world) {
  StateArchive a;
  RunState state{hash_of_scene(scene_path), progress.taken, progress.last_time_s};
  archive(a, state);
  world.impl().archive(a, nullptr);
  write_file(path, a.bytes());
}

RunProgress read_checkpoint(const std::string& path, const std::string& scene_path, FrameSource& source,
                            World& world) {
  StateArchive a(read_file(path, kMaxMeshBytes), path);
  RunState state;
  archive(a, state);
  if (state.scene != hash_of_scene(scene_path))
    throw usage_error(path + ": the checkpoint is of another scene than " + scene_path +
                      ", or that was changed since");
  const std::optional<FrameSet> last = take_again(source, state.taken, path);
  RunProgress progress;
  progress.taken = state.taken;
  progress.last_time_s = state.last_time_s;
  progress.has_time = state.taken > 0;
  progress.has_images = last.has_value();
  world.impl().archive(a, last ? &*last : nullptr);
  return progress;
}

}  // namespace tactus
