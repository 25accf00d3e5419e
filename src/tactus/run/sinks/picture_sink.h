#pragma once
/// Film and contact sheet of a run, drawn beside the physics.
#include "tactus/run/picture_thread.h"
#include "tactus/run/sinks/budget_sink.h"

namespace tactus {

/// `STEM.mp4` and `STEM.png`, as the scene's `output` and `view` say (run_pictures.h).
class PictureSink final : public FrameSink {
 public:
  /// @param fps of the film  @param moments frames on the contact sheet; none: twelve @throws Error when
  /// there is no OpenGL 4.5 or the folder can't be written.
  PictureSink(const Scene& scene, const Rig& rig, const BodyAssets& assets, World& world,
              const std::string& stem, double fps, const std::vector<int>& moments = {});
  /// While it saves photographs, pictures show clay. Keeps a reference.
  void follow(const BudgetSink& budget) { budget_ = &budget; }
  void frame(RunFrame& frame) override;
  /// Waits until the files are closed. Not at the loop's end: a run's other files come first.
  void finish() { pictures_.finish(); }

 private:
  bool wears_photographs_;
  const BudgetSink* budget_ = nullptr;
  PictureThread pictures_;
};

}  // namespace tactus
