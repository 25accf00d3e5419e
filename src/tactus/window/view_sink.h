#pragma once
/// Hands frames of a FrameLoop to a window.
#include <memory>

#include "tactus/run/frame_sink.h"
#include "tactus/run/run_control.h"
#include "tactus/run/scene_view.h"
#include "tactus/window/newest_one.h"
#include "tactus/window/viewed_frame.h"

namespace tactus {

/// On the physics' thread: copies a frame for the window when it has taken the last one, and carries out
/// the requests of the control. may_go_on() is the loop's `should_stop`, negated.
class ViewSink final : public FrameSink {
 public:
  struct Options {
    std::vector<std::string> tools;  ///< names of held obstacles and blades
    bool wears_photographs = false;
    double budget_ms = 0;   ///< ViewedFrame's
    int frames_before = 0;  ///< where it goes on from a kept state
    std::function<void(const std::shared_ptr<const ViewedFrame>&)> seen =
        {};  ///< after each that was handed over
  };
  /// @param on_news called after each frame that was handed over, on the physics' thread. Keeps references.
  ViewSink(const Scene& scene, World& world, RunControl& control,
           NewestOne<std::shared_ptr<const ViewedFrame>>& newest, std::function<void()> on_news,
           Options options);

  /// Waits for the turn of the next frame; false: the loop ends.
  bool may_go_on();
  /// Why it did.
  RunControl::Turn turn() const { return turn_; }
  void frame(RunFrame& frame) override;
  /// The last frame's.
  int number() const { return number_; }
  /// The last frame of a source is seen.
  void end(RunNotices& notices) override;

 private:
  /// All of a frame but the state of the world.
  struct Seen {
    int number = 0;
    double time_s = 0, taken_at_s = 0, captured_s = 0;  ///< captured: 0 where no images came
    StepReport report;
    std::vector<ColorImage> photos;
  };
  Seen seen(const RunFrame& frame) const;
  void apply_control();
  void hand_over(Seen seen, const RunNotices& notices);
  void add_values(const StepReport& report, ViewedFrame& shown);
  void add_contacts(double dt_s, ViewedFrame& shown);

  const Scene& scene_;
  World& world_;
  RunControl& control_;
  NewestOne<std::shared_ptr<const ViewedFrame>>& newest_;
  std::function<void()> on_news_;
  Options options_;
  RunControl::Turn turn_ = RunControl::Turn::go;
  bool is_unseen_ = false;
  int number_ = 0;
  Seen unseen_;  ///< the last frame, where it wasn't handed over
  std::shared_ptr<const std::vector<SceneParameter>> parameters_;
  std::string refusal_;
  std::vector<StageTime> stages_;
  double staged_s_ = 0;  ///< when they were looked at
};

}  // namespace tactus
