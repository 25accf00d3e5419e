#pragma once
/// The built-in synthetic rig: figures with known shape, seen by ideal cameras.
#include "tactus/geom/figures/figures.h"
#include "tactus/rig/sources/frame_source.h"
#include "tactus/rig/synthetic/figure_tracer.h"

namespace tactus {

/// Cameras in a ring around the 1 m cube (x, z in [-0.5, 0.5], y in [0, 1]), at two heights in turn, all
/// looking at its centre, and time-of-flight cameras: the first in front (+z), others in a ring with it.
struct SyntheticRigOptions {
  int camera_count = 8;  ///< 1..64
  Index width_px = 640, height_px = 480;
  double focal_px = 600;
  double ring_radius_m = 1.6;
  double low_m = 0.4, high_m = 1.2;  ///< heights of the cameras
  int depth_cameras = 1;             ///< 0..32
  Index depth_width_px = 200, depth_height_px = 200;
  double depth_focal_px = 200;
  double depth_distance_m = 1.6, depth_height_m = 0.75;
};
/// @throws usage_error naming the option, its value and range.
Rig make_synthetic_rig(const SyntheticRigOptions& options = {});

struct SyntheticOptions {
  /// One of figure_names(), or such a name with "-still" or "-moving", which then decides `moving`.
  std::string figure = "hand";
  FigureOptions shape{};        ///< moving, scale, offset
  double fps = 30;              ///< frame i shows the figure at i / fps; in (0, 10000]
  int first_frame = 0;          ///< >= 0
  std::optional<int> frames{};  ///< how many; none: without end
  bool colors = false;          ///< shaded pictures: for viewing, about 7 times the cost of the silhouettes
  bool depth = true;            ///< false: no depth cameras
  bool truth = true;  ///< volume of the figure: once when still, every frame when moving (6 ms for the hand)
  SyntheticRigOptions rig{};
};

/// Deterministic: the same options give the same bits. Silhouettes and depth are exact (no noise, no lens
/// distortion); a frame allocates nothing once its memory has grown.
class SyntheticSource : public FrameSource {
 public:
  /// @throws usage_error for an unknown figure, values out of range, and a figure that reaches a camera.
  explicit SyntheticSource(const SyntheticOptions& options = {});

  const Rig& rig() const override { return rig_; }
  std::optional<int> frame_count() const override { return options_.frames; }
  std::optional<double> fps() const override { return options_.fps; }
  NextFrame next(FrameSet& frame) override;
  /// Names the first camera that sees nothing of the figure.
  std::string status() const override { return status_; }

  const Figure& figure() const { return figure_; }
  const Figure* truth() const override { return &figure_; }
  /// Starts over with frame `tick` (>= 0).
  void seek(std::int64_t tick) { tick_ = tick; }

 private:
  void trace(FrameSet& frame);
  void shade(FrameSet& frame);

  SyntheticOptions options_;
  Rig rig_;
  Figure figure_;
  std::vector<FigureTracer> tracers_;  ///< of the cameras, then those of the depth cameras
  FigureShape shape_;
  std::vector<DepthImage> distances_m_;  ///< per camera, for colours
  std::optional<double> still_volume_m3_;
  std::int64_t tick_ = 0;
  std::string status_;
};

}  // namespace tactus
