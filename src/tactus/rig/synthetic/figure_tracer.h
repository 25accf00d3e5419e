#pragma once
/// A figure as a pinhole camera sees it: exact silhouettes and distances by sphere tracing (Hart 1996), with
/// cones over tiles first, so that the cost follows the contour.
#include <array>

#include "tactus/geom/camera/camera.h"
#include "tactus/geom/figures/figures.h"
#include "tactus/geom/image/image.h"

namespace tactus {

/// Traces one camera. A pixel is set iff `first_hit` finds something on the ray through its centre; tiles
/// that a cone proves empty or full are not traced, which changes no pixel.
class FigureTracer {
 public:
  /// A ray hits where it comes this close to the figure [m]: far below a hundredth of a pixel, well above the
  /// rounding of float at 3 m.
  static constexpr float kHit_m = 2e-6F;

  /// @throws Error when the camera can't be used (check_camera).
  explicit FigureTracer(const Camera& camera);

  /// Distance along the ray through pixel (x, y) to the figure [m], or 0: one ray, the whole figure, no
  /// tiles.
  float first_hit_m(const FigureShape& shape, float x_px, float y_px) const;

  /// Rows of 32-pixel tiles in the image.
  Index strip_count() const { return (height_px_ + 31) / 32; }
  /// Traces tile row `strip`. `mask` (all clear in these rows) gets the pixels that are hit, `distance_m` the
  /// radial distances, 0 where nothing is; either may be null. Strips touch no common memory.
  void trace_strip(const FigureShape& shape, Index strip, BitMask* mask, DepthImage* distance_m) const;

  /// Unit direction of the ray through a pixel; T is float or Float8.
  template <class T>
  Vec3<T> direction(const T& x_px, const T& y_px) const {
    const Vec3<T> d{T(M_.row[0].x) * x_px + T(M_.row[0].y) * y_px + T(M_.row[0].z),
                    T(M_.row[1].x) * x_px + T(M_.row[1].y) * y_px + T(M_.row[1].z),
                    T(M_.row[2].x) * x_px + T(M_.row[2].y) * y_px + T(M_.row[2].z)};
    const T s = T(1.F) / sqrt(dot(d, d));
    return {d.x * s, d.y * s, d.z * s};
  }
  Vec3f eye_m() const { return eye_m_; }

 private:
  /// Eight tiles and the state of their cones: lanes of a packet.
  struct Cones {
    Vec3<Float8> axis;
    Float8 tangent;                           ///< of half the opening
    Float8 begin_m, end_m;                    ///< the cone is empty before and after
    unsigned live = 0;                        ///< tiles that contain pixels
    unsigned full = 0, mixed = 0;             ///< result; the others are empty
    unsigned limbs = FigureShape::kAllLimbs;  ///< the others are nowhere near
  };
  struct Size {
    Index width_px, height_px;
  };
  /// Eight tiles beside each other from (x_px, y_px) on, `columns` in a row.
  Cones make_cones(Index x_px, Index y_px, Size size, Index columns) const;
  void trace_cones(const FigureShape& shape, Cones& cones) const;
  /// Traces the cone `lane` of `parent` by smaller ones: a tile of 32x32 pixels by blocks of 8x8, a block by
  /// cells of 4x2.
  void trace_tile(const FigureShape& shape, Index x_px, Index y_px, const Cones& parent, int lane,
                  BitMask* mask, DepthImage* distance_m) const;
  void trace_block(const FigureShape& shape, Index x_px, Index y_px, const Cones& parent, int lane,
                   BitMask* mask, DepthImage* distance_m) const;
  /// Rays of one block, each empty before `begin_m`.
  struct RayQueue {
    struct Ray {
      Vec3f direction;
      float begin_m;
      Index x_px, y_px;
    };
    std::array<Ray, 64> rays;
    int count = 0;
    float end_m = 0;  ///< all are empty after it
    unsigned limbs = FigureShape::kAllLimbs;
  };
  /// Adds the rays of tile `lane`, 4x2 pixels from (x_px, y_px) on.
  void queue_pixels(Index x_px, Index y_px, const Cones& parent, int lane, RayQueue& queue) const;
  /// Sets the pixels of the rays that hit.
  void trace_hits(const FigureShape& shape, const RayQueue& queue, BitMask& mask) const;
  /// Whether a ray that came near the figure at t_m hits it, as `first_hit_m` decides.
  bool resolve(const FigureShape& shape, const RayQueue::Ray& ray, float t_m, unsigned limbs) const;
  /// Sets the distances of the rays that hit, and their pixels.
  void trace_distances(const FigureShape& shape, const RayQueue& queue, BitMask* mask,
                       DepthImage& distance_m) const;
  void set_pixels(Index x_px, Index y_px, Size size, BitMask& mask) const;

  Index width_px_, height_px_;
  Vec3f eye_m_;
  Mat3f M_;  ///< pixel to direction (not unit)
};

}  // namespace tactus
