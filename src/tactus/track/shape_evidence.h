#pragma once
/// Whether masks show the shape that a model has. Errors of contours differ from camera to camera and from
/// frame to frame; residuals of a wrong shape stay at their place of the model.
#include <optional>
#include <span>
#include <vector>

#include "tactus/track/outline.h"
#include "tactus/track/pose_seeds.h"

namespace tactus {

/// A point of a posed model's outline, compared with a mask.
struct OutlineResidual {
  enum class Kind : std::uint8_t {
    seen,     ///< `off_px` says where the mask ends
    covered,  ///< the mask goes on as far as it is looked at
    gone,     ///< the mask lacks the part behind the point all through
  };
  Vec3d at_m;    ///< world
  Vec2d normal;  ///< in the picture, pointing out
  double off_px = 0;
  Kind kind = Kind::seen;
};

/// Residuals over cameras and frames by where they are on the model: slices along its longest axis, and
/// which way the outline faces there. Older frames fade.
class ShapeEvidence {
 public:
  ShapeEvidence(const OutlineMesh& mesh, std::span<const Vec3f> edge_m);
  void begin_frame();
  /// Adds a camera's residuals of a pose. @param number of the camera
  void add(std::size_t number, const Camera& camera, const Rigidd& T_world_model,
           std::span<const OutlineResidual> points);
  /// Root mean square over the outline of the mean residual at each place, less the part that errors which
  /// differ from camera to camera leave in such means: those of calibration last over frames.
  double misfit_px() const;
  /// Share of the outline beside which masks go on: the larger of those along the edge and at its tip.
  double edge_covered() const;
  int frames() const { return frames_; }

 private:
  static constexpr int kSlices = 8, kSides = 6;
  struct Place {
    struct View {
      double weight = 0, sum_px = 0;  ///< of medians, one a frame
    };
    std::vector<View> views;                              ///< by camera
    double covered = 0, gone = 0, gone_px = 0, seen = 0;  ///< points
    bool is_edge = false, is_tip = false;
  };
  /// A place's mean residual squared, without the variance that cameras leave in it; none where fewer than
  /// kLeastViews see it.
  static std::optional<double> common_px2(const Place& place, double& weight);
  std::size_t place_of(const Vec3d& at_m, const Vec3d& out) const;

  LongAxis axis_;
  Vec3d center_m_;
  std::vector<Place> places_;
  std::vector<std::vector<double>> offs_px_;  ///< of a view, by place
  int frames_ = 0;
};

}  // namespace tactus
