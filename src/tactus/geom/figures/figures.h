#pragma once
/// The built-in figures of the synthetic rig: bodies given by signed distance functions, still or moving, so
/// that every silhouette, depth and volume made from them is known exactly.
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "tactus/geom/mesh/signed_distance.h"

namespace tactus {

/// A figure at one moment: a trunk (limb 0) and limbs that grow out of it with a filled seam.
///
/// f = smooth_min(trunk, min(limbs)). The inner minimum is sharp, which makes it exact to leave out a limb
/// whose bounding sphere is farther away than the best so far.
class FigureShape {
 public:
  /// All limbs (bit i: limb i).
  static constexpr unsigned kAllLimbs = ~0U;
  struct Limb {
    int first_cone = 0, cone_count = 0;    ///< their seams are filled within `blend_m`; or none, then:
    int first_plane = 0, plane_count = 0;  ///< the intersection of half-spaces
    int first_shell = 0, shell_count = 0;  ///< and of shells; its edges are rounded within `blend_m`
    float blend_m = 0, inverse_4_blend = 0;
    Vec3f center_m;  ///< bounding sphere
    float radius_m = 0;
  };

  /// Signed distance [m], 1-Lipschitz, negative inside: a step of this length along a ray meets no surface.
  /// `limbs`: leave the others out. Where every omitted limb is farther than `seam_m()` (+ margin) the sign
  /// is that of the whole figure.
  template <class T>
  T distance_m(const Vec3<T>& p_m, unsigned limbs = kAllLimbs) const {
    T trunk(1e3F), nearest(1e3F);
    if (limbs & 1U) trunk = limb_distance_m(limbs_.front(), p_m);
    for (std::size_t i = 1; i < limbs_.size(); ++i) {
      if (!(limbs >> i & 1U)) continue;
      const Limb& limb = limbs_[i];
      const Vec3<T> q{p_m.x - T(limb.center_m.x), p_m.y - T(limb.center_m.y), p_m.z - T(limb.center_m.z)};
      // The limb can't matter outside its sphere while something else is that near; 1e-5 m covers rounding.
      const T at_least = sqrt(dot(q, q)) - T(limb.radius_m + 1e-5F);
      if (!less_bits(at_least, min(nearest, trunk + T(seam_m_)))) continue;
      nearest = min(nearest, limb_distance_m(limb, p_m));
    }
    return smooth_min(trunk, nearest, seam_m_, inverse_4_seam_);
  }
  float distance_m(Vec3f p_m) const { return distance_m<float>(p_m); }

  /// Width of the filled seam between trunk and limbs [m].
  float seam_m() const { return seam_m_; }
  std::span<const Limb> limbs() const { return limbs_; }
  /// Those of a limb. A point farther than blend_m + d from all of them is farther than d from the limb.
  std::span<const RoundCone> cones(const Limb& limb) const {
    return std::span(cones_).subspan(static_cast<std::size_t>(limb.first_cone),
                                     static_cast<std::size_t>(limb.cone_count));
  }
  /// Those of a limb that is a convex body.
  std::span<const HalfSpace> planes(const Limb& limb) const {
    return std::span(planes_).subspan(static_cast<std::size_t>(limb.first_plane),
                                      static_cast<std::size_t>(limb.plane_count));
  }
  /// Contains the figure (not the smallest such box).
  Box3f bounds_m() const;

 private:
  friend class Figure;
  template <class T>
  T limb_distance_m(const Limb& limb, const Vec3<T>& p_m) const {
    T d(1e3F);
    for (int i = 0; i < limb.cone_count; ++i) {
      const T cone = cones_[static_cast<std::size_t>(limb.first_cone + i)].distance_m(p_m);
      d = i == 0 ? cone : smooth_min(d, cone, limb.blend_m, limb.inverse_4_blend);
    }
    if (limb.plane_count == 0) return d;
    d = planes_[static_cast<std::size_t>(limb.first_plane)].distance_m(p_m);
    const auto cut = [&](const T& other) { d = smooth_max(d, other, limb.blend_m, limb.inverse_4_blend); };
    for (int i = 1; i < limb.plane_count; ++i)
      cut(planes_[static_cast<std::size_t>(limb.first_plane + i)].distance_m(p_m));
    for (int i = 0; i < limb.shell_count; ++i)
      cut(shells_[static_cast<std::size_t>(limb.first_shell + i)].distance_m(p_m));
    // Planes alone underrate far points; the sphere holds the body and makes its own bound exact.
    const Vec3<T> q{p_m.x - T(limb.center_m.x), p_m.y - T(limb.center_m.y), p_m.z - T(limb.center_m.z)};
    return max(d, sqrt(dot(q, q)) - T(limb.radius_m));
  }

  float seam_m_ = 0, inverse_4_seam_ = 0;
  std::vector<Limb> limbs_;
  std::vector<RoundCone> cones_;
  std::vector<HalfSpace> planes_;
  std::vector<SphereShell> shells_;
  std::vector<Rigidf> T_world_bone_;
};

inline constexpr float kMostFigureScale = 10;

struct FigureOptions {
  bool moving = false;
  /// Size over that of the benchmarks, where `hand` (0.9 m) and `rabbit` (0.78 m) fill a 1 m cube.
  /// A life-size hand is 1 / 3.5. Motion keeps its way and speed.
  float scale = 1;
  /// Shift in the world. Without: still figures are centred in the cube of 1 m (x, z in [-0.5, 0.5], y in
  /// [0, 1]); the moving hand's lowest point over time is at y = 0.2 m.
  Vec3f offset_m{};
};

/// The parts of a figure, in the frames of its bones; filled by the builders.
struct FigureParts {
  struct Cone {
    int bone;
    Vec3f a_m, b_m;
    float radius_a_m, radius_b_m;
  };
  struct Plane {
    int bone;
    HalfSpace side;
  };
  struct Limb {
    float blend_m = 0;
    std::vector<Cone> cones;
    std::vector<Plane> planes;
    std::vector<SphereShell> shells;  ///< in the frame of bone 0; one of radius 0 is a ball
    float planes_radius_m = 0;  ///< bounding sphere of planes and shells, around `planes_center_m` (bone 0)
    Vec3f planes_center_m{};
  };
  float seam_m = 0;
  std::vector<Limb> limbs;  ///< the trunk first; at most 32
  /// Poses T_world_bone of all bones at a time [s].
  std::function<void(double time_s, std::vector<Rigidf>& T_world_bone)> pose;
  int bone_count = 1;
  double period_s = 4;
};

/// A figure over time. The hand has jointed fingers; all others are rigid (one bone).
class Figure {
 public:
  Figure(std::string name, bool moving, FigureParts parts);
  const std::string& name() const { return name_; }
  bool moving() const { return moving_; }
  /// Motion repeats after this time.
  double period_s() const { return parts_.period_s; }

  FigureShape at(double time_s) const;
  /// The same into an existing shape, whose memory is reused.
  void at(double time_s, FigureShape& shape) const;
  /// Signed distance of one point; `at` is faster for many.
  float distance_m(Vec3f p_m, double time_s) const { return at(time_s).distance_m(p_m); }
  /// Contains the figure at all times.
  Box3f bounds_m() const { return bounds_m_; }
  /// Poses T_world_bone; a rigid figure has one.
  std::vector<Rigidf> bones(double time_s) const;
  bool rigid() const { return parts_.bone_count == 1; }
  /// Velocity [m/s] of the material at a point of the figure: that of the bone nearest to it.
  Vec3f velocity_m_s(Vec3f p_m, double time_s) const;

 private:
  void pose(double time_s, std::vector<Rigidf>& T_world_bone) const;

  std::string name_;
  bool moving_;
  FigureParts parts_;
  Box3f bounds_m_;
};

/// Where the origin of a moving figure goes: the limit of its box as its scale goes to 0. At a scale s <= 1,
/// each of its points is at s (x(t) - w(t)) + w(t), whose largest coordinate over time is convex in s. So the
/// figure stays within s times its box plus 1 - s times this one.
Box3f figure_displacement_m(const std::string& name);

/// hand, rabbit, scalpel, sphere, bowl, liver.
std::span<const std::string> figure_names();

/// @throws usage_error for an unknown name (with the nearest one), a scale outside (0, 10] or an offset that
/// is not finite.
Figure make_figure(const std::string& name, const FigureOptions& options = {});

/// The cutting edge of the figure `scalpel` at scale 1, from the tip, in the frame of its bone.
std::span<const Vec3f> scalpel_edge_m();

struct FigureVolume {
  double volume_m3 = 0;
  double error_m3 = 0;  ///< estimated from the last two refinements
};
/// Volume inside a shape: octree cells that the distance at their centre proves full or empty are not split;
/// the finest (edge h) count clamp(1/2 - f/h, 0, 1), whose error averages out to O(h^2). h is halved until
/// the change, which is three times the error left, shrinks below `tolerance` of the volume.
FigureVolume figure_volume(const FigureShape& shape, double tolerance = 5e-4);

}  // namespace tactus
