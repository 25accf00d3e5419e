#pragma once
/// Which frames of a recording are delivered, and how the state of its cameras becomes one line.
#include <optional>
#include <string>
#include <vector>

#include "tactus/rig/sources/frame_source.h"

namespace tactus {

/// Frames `first` to `last`, both included.
struct FrameWindow {
  int first = 0, last = 0;
};
/// The frames asked for, which must all be within `held`; all of `held` where none are asked for. A range
/// that reaches beyond the recording is refused, not cut: a user who writes 0-999 counts on 1000 frames, and
/// 0- says "to the end".
/// @param path of the recording  @param why appended to the frames that are held: " (camera 'a' is the
/// shortest)", or ""
/// @throws usage Error naming path, the frames asked for and those there are.
FrameWindow frame_window(const std::string& path, std::optional<int> first, std::optional<int> last,
                         FrameWindow held, const std::string& why = "");

/// "all black" or "all white" for `set` of `all` pixels, else "".
std::string odd_coverage(std::int64_t set, std::int64_t all);

/// Failures and oddities of the cameras in one frame. A camera without a mask misses the tick: it does not
/// carve, the others do.
class CameraNotes {
 public:
  /// Forgets the last frame.
  void clear(std::size_t cameras);
  /// Each camera writes only its own, so cameras may run side by side.
  void fail(std::size_t camera, std::string why);
  void odd(std::size_t camera, std::string what);
  /// Takes the masks of the cameras that failed away. bad_frame only when all failed.
  NextFrame finish(const Rig& rig, FrameSet& frame, std::string& status) const;

 private:
  struct Note {
    std::string text;
    bool failed = false;
  };
  std::vector<Note> notes_;
};

}  // namespace tactus
