#include "tactus/run/sinks/picture_sink.h"

#include <cstdio>

#include "tactus/run/progress_text.h"
#include "tactus/sim/scene.h"

namespace tactus {

PictureSink::PictureSink(const Scene& scene, const Rig& rig, const BodyAssets& assets, World& world,
                         const std::string& stem, double fps, const std::vector<int>& moments)
    : wears_photographs_(scene.view.photographs > 0), pictures_([&] {
        return std::make_unique<RunPictures>(scene, rig, assets, world, stem, fps, moments);
      }) {
  if (scene.view.show_models) pictures_.show_models(element_triangles(world));
}

void PictureSink::frame(RunFrame& frame) {
  char time_text[32];
  std::snprintf(time_text, sizeof time_text, "%.2f s", frame.images.time_s);
  const bool with_photographs =
      wears_photographs_ && (budget_ == nullptr || !budget_->leaves_out_photographs());
  pictures_.add(frame.snapshot(), with_photographs ? frame.images.colors : std::vector<ColorImage>{},
                caption_text(frame), time_text);
}

}  // namespace tactus
