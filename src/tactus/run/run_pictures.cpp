#include "tactus/run/run_pictures.h"

#include <algorithm>
#include <utility>

#include "tactus/base/log.h"
#include "tactus/base/safe_file.h"
#include "tactus/sim/scene.h"

namespace tactus {
namespace {

constexpr Index kMomentsInARow = 3, kMomentPx = 480;

}  // namespace

RunPictures::RunPictures(const Scene& scene, const Rig& rig, const BodyAssets& assets, const World& world,
                         const std::string& stem, double fps, std::vector<int> moments)
    : renderer_({.width_px = scene.view.size_px.x, .height_px = scene.view.size_px.y}),
      view_(scene, rig, assets, world),
      has_overlay_(scene.view.overlay),
      sheet_path_(stem + ".png"),
      moments_(std::move(moments)) {
  if (scene.output.video)
    video_ = std::make_unique<VideoWriter>(stem + ".mp4", scene.view.size_px.x, scene.view.size_px.y, fps);
  if (scene.output.contact_sheet) {
    output_is_writable(sheet_path_);
    const auto count = static_cast<Index>(moments_.size());
    sheet_ = count == 0 ? std::make_unique<ContactSheet>(scene.name)
                        : std::make_unique<ContactSheet>(scene.name, count, std::min(count, kMomentsInARow),
                                                         kMomentPx);
  }
}

void RunPictures::add(FrameSnapshot snapshot, const std::vector<ColorImage>& photos,
                      const std::string& overlay, const std::string& caption) {
  view_.show(std::move(snapshot), photos);
  renderer_.render(view_.scene(), view_.camera(), picture_);
  const bool is_moment = moments_.empty() || std::binary_search(moments_.begin(), moments_.end(), frames_);
  if (sheet_ && is_moment) sheet_->add(picture_, caption);
  if (moments_.size() == 1 && is_moment) lone_ = picture_;
  if (has_overlay_) draw_line_of_text(picture_, overlay, 16, 18);
  if (video_) video_->add(picture_);
  ++frames_;
}

void RunPictures::finish() {
  if (video_) video_->finish();
  if (sheet_ && !moments_.empty() && moments_.back() >= frames_)
    log_warning("--moments: " + std::to_string(moments_.back()) + " never came: the run had " +
                std::to_string(frames_) + " frames");
  if (sheet_ && frames_ > (moments_.empty() ? 0 : moments_.front()))
    write_png(sheet_path_, lone_.empty() ? sheet_->image() : lone_);
}

}  // namespace tactus
