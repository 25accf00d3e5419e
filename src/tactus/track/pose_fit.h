#pragma once
/// The pose in which a known shape has the silhouettes that cameras saw, with its covariance.
#include <optional>
#include <span>

#include "tactus/geom/image.h"
#include "tactus/track/outline.h"
#include "tactus/track/small_matrix.h"

namespace tactus {

struct PoseFitSettings {
  double spacing_px = 1;  ///< of the points on outlines
  double reach_px = 4;    ///< how far from the outline masks are looked at, at last
  /// By how much calibrations are expected to be off at a point, 1 sigma.
  double calibration_px = 0.3;
};

/// Rigid motion by a twist about the model's centre: X' = c + R(turn) (X - c) + shift.
Rigidd moved(const Rigidd& T_world_model, Vec3d center_m, const Twist& by);
/// The twist that moves one pose to the other.
Twist twist_between(const Rigidd& from, const Rigidd& to, Vec3d center_m);

/// What is known of a pose beforehand.
struct PosePrior {
  Rigidd T_world_model;
  Matrix6 information;  ///< inverse covariance of its twist
};

struct PoseFit {
  Rigidd T_world_model;
  Matrix6 noise;        ///< covariance by what is new in every frame, without the prior
  Matrix6 calibration;  ///< covariance by what stays: cameras that are not where they are believed to be
  int points = 0;       ///< of outlines that count
  double missing = 1;   ///< share of the model's picture, near its outline, where masks are clear
  double wrong = 2;     ///< the same, and of what masks show beside it
  double rms_px = 0;    ///< of residuals
  int iterations = 0;
};

/// Keeps its memory, and how large residuals are from frame to frame.
class PoseFitter {
 public:
  PoseFitter(const OutlineMesh& mesh, std::span<const Camera> cameras, const PoseFitSettings& settings);
  /// @param masks one per camera; empty: it missed the tick. What else they show may cover the model
  /// @param search_px by how much the model's picture may be off at the start
  /// @param prior or nullptr
  PoseFit fit(std::span<const BitMask> masks, const Rigidd& T_start, double search_px,
              const PosePrior* prior = nullptr);
  /// Share of the pixels near the outline of a posed model that contradict it, as PoseFit::wrong.
  double wrong(std::span<const BitMask> masks, const Rigidd& T_world_model);
  const OutlineMesh& mesh() const { return *mesh_; }
  std::span<const Camera> cameras() const { return cameras_; }

 private:
  struct Residual {
    double j[6];  ///< of the model's outline along its normal, per motion [px]
    Vec2d normal;
    double off_px;  ///< by which the mask reaches farther than the model
    double weight = 1;
    Index cell;  ///< of the picture: what is in one is not independent
  };
  struct View {
    OutlineFinder outline;
    Image<float> window;  ///< of the mask: 0 or 1
    Index x_px = 0, y_px = 0;
    std::vector<Residual> residuals;
    double inner_px = 0, missing_px = 0, extra_px = 0;
  };
  void open_windows(std::span<const BitMask> masks, const Rigidd& T, double reach_px);
  void open_window(std::size_t camera, const BitMask& mask, const Rigidd& T, double reach_px);
  void look(const Rigidd& T, double reach_px);
  void look(std::size_t camera, const Rigidd& T, double reach_px);
  void weigh(double least_px);
  Twist step(const Rigidd& T, const PosePrior* prior);
  void sum_up(PoseFit& fit) const;
  void add_covariance(PoseFit& fit);

  const OutlineMesh* mesh_;
  std::vector<Camera> cameras_;
  PoseFitSettings settings_;
  std::vector<View> views_;
  std::vector<double> sizes_;
  Matrix6 normal_;                ///< of the equations, without the prior
  std::optional<Matrix6> noise_;  ///< of the solution, mean over frames, model's axes
  double blur_px_ = 0.5;
};

}  // namespace tactus
