#pragma once
/// The pose in which a known shape has the silhouettes that cameras saw, with its covariance.
#include <optional>
#include <span>

#include "tactus/geom/image/image.h"
#include "tactus/track/contour_equations.h"
#include "tactus/track/depth_rays.h"
#include "tactus/track/mask_window.h"
#include "tactus/track/outline.h"
#include "tactus/track/shape_evidence.h"
#include "tactus/track/small_matrix.h"

namespace tactus {

/// A point of the model that a camera sees and knows by name: a corner of a marker.
struct SeenPoint {
  std::size_t camera = 0;
  Vec3d model_m;
  Vec2d px;
  double sigma_px = 0.5;  ///< of the place in the picture, 1 sigma along each axis
};

/// The picture of a time-of-flight camera.
struct SeenDepth {
  const Camera* camera = nullptr;
  const DepthImage* image = nullptr;  ///< empty: it missed the tick
};

/// Observations of the model beside its silhouettes.
struct PoseEvidence {
  std::span<const SeenPoint> points = {};
  std::span<const SeenDepth> depths = {};
};

/// The pose in which points are where at least two cameras see them; none: fewer than three such points, or
/// they are in a line. Rays are intersected by least squares; the first three points give the axes.
std::optional<Rigidd> pose_of_points(std::span<const Camera> cameras, std::span<const SeenPoint> points);

struct PoseFitSettings {
  double spacing_px = 1;  ///< of the points on outlines
  double reach_px = 4;    ///< how far from the outline masks are looked at, at last
  /// By how much calibrations are expected to be off at a point, 1 sigma.
  double calibration_px = 0.3;
  /// Within which errors of contours are alike.
  double correlation_px = 8;
  /// Errors of measured distances, 1 sigma: each pixel's, and the one that all pixels of a camera share.
  double depth_m = 0.005, depth_bias_m = 0.003;
};

/// Rigid motion by a twist about the model's centre: X' = c + R(turn) (X - c) + shift.
Rigidd moved(const Rigidd& T_world_model, Vec3d center_m, const Twist& by);
/// The twist that moves one pose to the other.
Twist twist_between(const Rigidd& from, const Rigidd& to, Vec3d center_m);

/// A pose as known beforehand. Its unknowns are a twist, and of each camera the shift of its picture.
struct PosePrior {
  Rigidd T_world_model;
  std::vector<double> shifts_px;  ///< x, y of each camera
  DenseMatrix information;        ///< inverse covariance of the unknowns
};

struct PoseFit {
  Rigidd T_world_model;
  std::vector<double> shifts_px;  ///< x, y of each camera: wrong calibration
  DenseMatrix information;        ///< of masks alone, about the same unknowns as of a prior
  Matrix6 covariance;             ///< of the twist, by masks and calibration, without the prior
  int points = 0;                 ///< of outlines that count
  double missing = 1;             ///< share of the model's picture, near its outline, where masks are clear
  double wrong = 2;               ///< the same, with the masks' excess beside the model added
  double gone = 1;                ///< share of the outline whose part of the model is missing all through
  double rms_px = 0;              ///< of residuals
  double surprise = 0;            ///< -2 log likelihood of an averaged residual, but for a constant
  int iterations = 0;
};

/// Keeps its memory, and how large residuals are from frame to frame.
class PoseFitter {
 public:
  PoseFitter(const OutlineMesh& mesh, std::span<const Camera> cameras, const PoseFitSettings& settings);
  /// @param masks one per camera; empty: it missed the tick. Other things in them may cover the model
  /// @param search_px by how much the model's picture may be off at the start
  /// @param prior or nullptr
  /// @param more points that are off by 6 px at last don't count, nor do distances that are 4 sigma off
  PoseFit fit(std::span<const BitMask> masks, const Rigidd& T_start, double search_px,
              const PosePrior* prior = nullptr, int most_iterations = 12, const PoseEvidence& more = {});
  /// Share of the pixels near the outline of a posed model that contradict it, as PoseFit::wrong.
  double wrong(std::span<const BitMask> masks, const Rigidd& T_world_model);
  /// Adds each camera's residuals at the last pose looked at.
  void add_to(ShapeEvidence& shape) const;
  const OutlineMesh& mesh() const { return *mesh_; }
  std::span<const Camera> cameras() const { return cameras_; }

 private:
  struct View {
    OutlineFinder outline;
    MaskWindow window;
    std::vector<ContourPoint> points;
    std::vector<OutlineResidual> residuals;  ///< of the whole outline, where it is looked at from near
    ContourEquations equations;
    int gone = 0;  ///< points whose part of the model is missing all through
    double inner_px = 0, missing_px = 0, extra_px = 0;
  };
  void open_windows(std::span<const BitMask> masks, const Rigidd& T, double reach_px);
  void open_window(std::size_t camera, const BitMask& mask, const Rigidd& T, double reach_px);
  void look(const Rigidd& T, double reach_px);
  void look(std::size_t camera, const Rigidd& T, double reach_px);
  void weigh(double least_px);
  void assemble(const PoseFit& fit, double least_white_px2);
  /// Adds the equations of points to those of a fit.
  void add_points(PoseFit& fit, std::span<const SeenPoint> points, bool is_near);
  /// Solves for a step. @returns the square of its size, in standard deviations
  double step(PoseFit& fit, const PosePrior* prior, const PoseEvidence& more, bool is_near);
  void add_depth(PoseFit& fit, const SeenDepth& depth);
  void measure_noise();
  double surprise_of(std::span<const SeenPoint> points, const PoseFit& fit) const;
  void sum_up(PoseFit& fit) const;
  void state_covariance(PoseFit& fit);
  double shift_information() const;

  const OutlineMesh* mesh_;
  std::vector<Camera> cameras_;
  PoseFitSettings settings_;
  std::vector<View> views_;
  std::vector<double> sizes_;
  Rigidd looked_at_;  ///< the pose whose outlines `views_` has
  DepthRays rays_;
  DenseMatrix normal_, step_;  ///< of the equations, with the prior
  ContourNoise noise_;         ///< its mean over frames
  bool has_noise_ = false;
  int noise_frames_ = 0;  ///< in that mean
  double blur_px_ = 0.5;
};

}  // namespace tactus
