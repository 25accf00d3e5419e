#include "tactus/run/run_pictures.h"

#include "tactus/base/safe_file.h"
#include "tactus/sim/scene.h"

namespace tactus {

RunPictures::RunPictures(const Scene& scene, const Rig& rig, const BodyAssets& assets, const World& world,
                         const std::string& stem, double fps)
    : renderer_({.width_px = scene.view.size_px.x, .height_px = scene.view.size_px.y}),
      view_(scene, rig, assets, world),
      has_overlay_(scene.view.overlay),
      sheet_path_(stem + ".png") {
  if (scene.output.video)
    video_ = std::make_unique<VideoWriter>(stem + ".mp4", scene.view.size_px.x, scene.view.size_px.y, fps);
  if (scene.output.contact_sheet) {
    output_is_writable(sheet_path_);
    sheet_ = std::make_unique<ContactSheet>(scene.name);
  }
}

void RunPictures::add(FrameSnapshot snapshot, const std::vector<ColorImage>& photos,
                      const std::string& overlay, const std::string& caption) {
  view_.show(std::move(snapshot), photos);
  renderer_.render(view_.scene(), view_.camera(), picture_);
  if (sheet_) sheet_->add(picture_, caption);
  if (has_overlay_) draw_line_of_text(picture_, overlay, 16, 18);
  if (video_) video_->add(picture_);
  ++frames_;
}

void RunPictures::finish() {
  if (video_) video_->finish();
  if (sheet_ && frames_ > 0) write_png(sheet_path_, sheet_->image());
}

}  // namespace tactus
