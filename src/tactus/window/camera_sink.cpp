#include "tactus/window/camera_sink.h"

namespace tactus {

CameraSink::CameraSink(const FrameSource& source, const RunControl& control, Links links, int frames_before)
    : source_(source),
      control_(control),
      links_(links),
      frames_before_(frames_before),
      rig_(std::make_shared<const Rig>(source.rig())),
      seen_s_(rig_->cameras.size()) {}

void CameraSink::frame(RunFrame& frame) {
  const std::vector<BitMask>& silhouettes = frame.images.silhouettes;
  if (frame.is_new) {
    links_.checkup.add(*rig_, silhouettes);
    for (std::size_t c = 0; c < seen_s_.size() && c < silhouettes.size(); ++c)
      if (!silhouettes[c].words.empty()) seen_s_[c] = frame.images.time_s;
  }
  // As ViewSink: one that would replace another unseen isn't copied; when it is paused, the last one is seen.
  if (!links_.is_shown || (!links_.newest.is_empty() && !control_.is_paused())) return;
  auto look = std::make_shared<CameraLook>();
  look->number = frame.number + frames_before_;
  look->rig = rig_;
  if (frame.is_new) look->silhouettes = silhouettes;
  for (const std::optional<double>& seen_s : seen_s_)
    look->late_s.push_back(seen_s ? frame.images.time_s - *seen_s : -1);
  look->links_json = source_.links_json();
  links_.newest.put(std::move(look));
}

void CameraSink::end(RunNotices&) { links_.checkup.begin(); }

}  // namespace tactus
