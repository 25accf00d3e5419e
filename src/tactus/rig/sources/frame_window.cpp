#include "tactus/rig/sources/frame_window.h"

#include "tactus/base/error.h"

namespace tactus {

FrameWindow frame_window(const std::string& path, std::optional<int> first, std::optional<int> last,
                         FrameWindow held, const std::string& why) {
  const FrameWindow window{first.value_or(held.first), last.value_or(held.last)};
  if (held.first <= window.first && window.first <= window.last && window.last <= held.last) return window;
  const std::string from = std::to_string(window.first);
  const std::string asked = !last ? from + "-" : from + "-" + std::to_string(window.last);
  std::string holds = held.first == held.last
                          ? "holds one frame, number " + std::to_string(held.first)
                          : "holds frames " + std::to_string(held.first) + "-" + std::to_string(held.last);
  const bool only_end = held.first <= window.first && window.first <= held.last && window.last > held.last;
  throw usage_error(path + ": frames " + asked + " are asked for, but the recording " + holds + why +
                    (only_end ? "; " + from + "- is all from there" : ""));
}

std::string odd_coverage(std::int64_t set, std::int64_t all) {
  if (all == 0 || (set != 0 && set != all)) return "";
  return set == 0 ? "the mask is all black" : "the mask is all white";
}

void CameraNotes::clear(std::size_t cameras) { notes_.assign(cameras, {}); }
void CameraNotes::fail(std::size_t camera, std::string why) { notes_[camera] = {std::move(why), true}; }
void CameraNotes::odd(std::size_t camera, std::string what) { notes_[camera] = {std::move(what), false}; }

NextFrame CameraNotes::finish(const Rig& rig, FrameSet& frame, std::string& status) const {
  status.clear();
  std::size_t failed = 0;
  for (std::size_t i = 0; i < notes_.size(); ++i) {
    const Note& note = notes_[i];
    if (note.failed) {
      ++failed;
      frame.silhouettes[i] = {};
      if (i < frame.alphas.size()) frame.alphas[i] = {};
      if (!frame.colors.empty()) frame.colors[i] = {};
    }
    if (note.text.empty()) continue;
    status += (status.empty() ? "camera '" : "; camera '") + rig.cameras[i].name + "': " + note.text;
  }
  if (failed < notes_.size()) return NextFrame::success;
  status = "frame " + std::to_string(frame.tick) + " is missed by all cameras: " + status;
  return NextFrame::bad_frame;
}

}  // namespace tactus
