#pragma once
/// All text and numbers of the window's panels, as plain data: tests read it without a window.
#include <string>
#include <vector>

#include "tactus/window/live_run.h"

namespace tactus {

struct PanelModel {
  struct Stage {
    std::string name, text;  ///< "3.1 / 4.0"; "over: 41 / 60" where half of all frames exceed the budget
    float p50 = 0, p99 = 0;  ///< of the whole width, 0..1
    float p50_ms = 0;
    bool is_age = false;  ///< of live images: no part of the frame, so it has no budget
  };
  struct Curve {
    std::string name, now, range;  ///< "0.84 N"; "0 to 2.1"
    std::vector<float> heights;    ///< 0..1, the newest last
  };
  struct Slider {
    std::string name;   ///< of the parameter
    std::string label;  ///< shorter
    std::string unit, meaning;
    double value = 0, low = 0, high = 1;
    bool is_logarithmic = false;
  };
  std::string title;  ///< of the window
  std::string state;  ///< "running at 0.8 of real time"
  std::string clock;  ///< "4.27 s, frame 128"
  std::string tool;   ///< "ball: 0.84 N"; "": none
  std::string pull;   ///< "pull: 0.84 N"; "": nothing is grabbed
  std::string kept;   ///< "b goes back to frame 128"; "": nothing is kept
  /// Frames that were seen, as a slider.
  struct Past {
    int first = 0, last = 0, shown = 0;
    std::string text;             ///< "seen: frames 1 to 128"; "": nothing to choose from
    bool can_go_on_from = false;  ///< simulating again is possible
  };
  Past past;
  std::string arrows;  ///< the force of the longest arrow; "": without bodies
  std::vector<Stage> stages;
  std::string budget;    ///< "budget of a frame: 33.3 ms"; "": there is none
  float budget_at = -1;  ///< of the bars' whole width, 0..1; < 0: there is none
  std::vector<Curve> curves;
  std::vector<Slider> sliders;
  std::vector<std::string> notices;
};

/// Key and action, as `h` shows them.
struct HelpLine {
  const char* key;
  const char* action;
};
/// Things of a scene that the mouse may hold.
struct MouseHolds {
  std::size_t tools = 0;
  bool tissue = false;
};
std::vector<HelpLine> help_lines(const MouseHolds& holds);

/// "0.84", "12.3", "1230": three digits that count.
std::string short_number(double value);

/// A slider's range about the value that the scene has: a tenth to ten times, within the parameter's limits,
/// or these where they are near.
/// @param scene_value of the scene file
PanelModel::Slider slider_of(const SceneParameter& parameter, double scene_value);

/// Frames so far: the newest, and curves.
class RunHistory {
 public:
  /// About 20 s at 30 frames a second.
  static constexpr std::size_t kMostSamples = 600;
  /// A new run begins.
  void clear();
  void add(std::shared_ptr<const ViewedFrame> frame);
  const ViewedFrame* newest() const { return newest_.get(); }
  /// Seconds of the source per second, over the last second; 0: unknown.
  double pace() const;
  /// Parameters as the first frame had them: the scene's values.
  const std::vector<SceneParameter>& scene_parameters() const { return scene_parameters_; }

  struct Curve {
    std::string name, unit;
    std::vector<float> values;
  };
  const std::vector<Curve>& curves() const { return curves_; }

 private:
  std::shared_ptr<const ViewedFrame> newest_;
  std::vector<Curve> curves_;
  std::vector<SceneParameter> scene_parameters_;
  std::vector<std::pair<double, double>> times_;  ///< of the source, and when it was shown
};

/// A run's past, as a window shows it.
struct ShownPast {
  SeenFrames::Range range;
  std::shared_ptr<const ViewedFrame> frame;  ///< that is shown; nullptr: the newest
  int again_from = 0;                        ///< frame from which it can be simulated again; 0: none
  std::string why_not_again;                 ///< LiveRun::why_not_again
};

/// @param name of the scene @param pending parameters that were set since the newest frame
/// @param kept_frame number of the frame that is kept; 0: none @param tool in the hand; "": none
PanelModel panel_model(const std::string& name, const RunHistory& history, LiveRun::State state,
                       bool is_paused, const std::map<std::string, double>& pending = {}, int kept_frame = 0,
                       const std::string& tool = "", const ShownPast& past = {});

}  // namespace tactus
