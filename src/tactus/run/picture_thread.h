#pragma once
/// Pictures of a run, drawn beside the physics.
#include <functional>
#include <memory>

#include "tactus/base/worker.h"
#include "tactus/run/run_pictures.h"

namespace tactus {

/// Owns RunPictures on a thread of its own, which has the OpenGL context. A film needs every frame, so a run
/// that is three snapshots ahead of its pictures waits. Every call throws the exception of an earlier picture
/// that failed.
class PictureThread {
 public:
  /// Waits until the pictures are set up. @param make runs on the thread
  explicit PictureThread(const std::function<std::unique_ptr<RunPictures>()>& make) {
    painter_.add([this, make] { pictures_ = make(); });
    painter_.finish();
  }
  ~PictureThread() { close(); }
  PictureThread(const PictureThread&) = delete;
  PictureThread& operator=(const PictureThread&) = delete;

  void show_models(std::vector<std::vector<std::uint8_t>> element_triangles) {
    painter_.add([this, models = std::move(element_triangles)] { pictures_->show_models(models); });
  }
  void add(std::shared_ptr<const FrameSnapshot> snapshot, std::vector<ColorImage> photos, std::string overlay,
           std::string caption) {
    painter_.add([this, snapshot = std::move(snapshot), photos = std::move(photos),
                  overlay = std::move(overlay),
                  caption = std::move(caption)] { pictures_->add(*snapshot, photos, overlay, caption); });
  }
  /// Waits until the files are closed.
  void finish() {
    painter_.add([this] { pictures_->finish(); });
    painter_.finish();
  }

 private:
  /// OpenGL's objects go on the thread that made them.
  void close() noexcept {
    try {
      painter_.add([this] { pictures_.reset(); });
      painter_.finish();
    } catch (...) {  // the caller's own exception reports the failure
    }
    static_cast<void>(pictures_.release());  // after a failure: the context goes with the program
  }
  std::unique_ptr<RunPictures> pictures_;
  Worker painter_{3};
};

}  // namespace tactus
