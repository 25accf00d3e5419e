#include "tactus/geom/figures/figures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "tactus/base/error.h"
#include "tactus/geom/figures/figure_builders.h"

namespace tactus {
namespace {

float inverse_4(float blend_m) { return blend_m > 0 ? 0.25F / blend_m : 0.F; }

/// Sphere around the cones of a limb. Filled seams bulge by less than the blend width in all.
void bound_cones(std::span<const RoundCone> cones, FigureShape::Limb& limb) {
  Vec3f low{1e9F, 1e9F, 1e9F}, high = -low;
  const auto each_end = [&](const auto& visit) {
    for (const RoundCone& c : cones) {
      visit(c.a_m, c.radius_a_m);
      visit(c.a_m + c.length_m * c.axis, c.radius_a_m - c.slope * c.length_m);
    }
  };
  each_end([&](Vec3f p, float r) {
    low = min(low, p - Vec3f{r, r, r});
    high = max(high, p + Vec3f{r, r, r});
  });
  limb.center_m = 0.5F * (low + high);
  limb.radius_m = 0;
  each_end([&](Vec3f p, float r) { limb.radius_m = max(limb.radius_m, length(p - limb.center_m) + r); });
  limb.radius_m += limb.blend_m;
}

Box3f united(const Box3f& a, const Box3f& b) { return {min(a.min, b.min), max(a.max, b.max)}; }

constexpr std::array kBuilders = {build_hand,   build_rabbit, build_scalpel,
                                  build_sphere, build_bowl,   build_liver};

}  // namespace

Box3f FigureShape::bounds_m() const {
  Box3f box{{1e9F, 1e9F, 1e9F}, {-1e9F, -1e9F, -1e9F}};
  for (const Limb& limb : limbs_) {
    const float pad = limb.blend_m + seam_m_;
    const auto add = [&](Vec3f p, float r) { box = united(box, {p - Vec3f{r, r, r}, p + Vec3f{r, r, r}}); };
    for (int i = 0; i < limb.cone_count; ++i) {
      const RoundCone& c = cones_[static_cast<std::size_t>(limb.first_cone + i)];
      add(c.a_m, c.radius_a_m + pad);
      add(c.a_m + c.length_m * c.axis, c.radius_a_m - c.slope * c.length_m + pad);
    }
    if (limb.cone_count == 0) add(limb.center_m, limb.radius_m + pad);
  }
  return box;
}

Figure::Figure(std::string name, bool moving, FigureParts parts)
    : name_(std::move(name)), moving_(moving), parts_(std::move(parts)) {
  bounds_m_ = at(0).bounds_m();
  if (!moving_) return;
  constexpr int kSamples = 128;
  float step_m = 0;
  Box3f last = bounds_m_;
  for (int i = 1; i <= kSamples; ++i) {
    const Box3f box = at(parts_.period_s * i / kSamples).bounds_m();
    step_m = std::max({step_m, length(box.min - last.min), length(box.max - last.max)});
    bounds_m_ = united(bounds_m_, box);
    last = box;
  }
  // Between two samples no face can move further than from one to the next (motion is slow and smooth).
  bounds_m_.min = bounds_m_.min - Vec3f{step_m, step_m, step_m};
  bounds_m_.max = bounds_m_.max + Vec3f{step_m, step_m, step_m};
}

void Figure::pose(double time_s, std::vector<Rigidf>& T_world_bone) const {
  T_world_bone.resize(static_cast<std::size_t>(parts_.bone_count));
  parts_.pose(moving_ ? std::remainder(time_s, parts_.period_s) : 0.0, T_world_bone);
}

std::vector<Rigidf> Figure::bones(double time_s) const {
  std::vector<Rigidf> T_world_bone;
  pose(time_s, T_world_bone);
  return T_world_bone;
}

FigureShape Figure::at(double time_s) const {
  FigureShape shape;
  at(time_s, shape);
  return shape;
}

void Figure::at(double time_s, FigureShape& shape) const {
  pose(time_s, shape.T_world_bone_);
  const std::vector<Rigidf>& T = shape.T_world_bone_;
  shape.seam_m_ = parts_.seam_m;
  shape.inverse_4_seam_ = inverse_4(parts_.seam_m);
  shape.limbs_.clear();
  shape.cones_.clear();
  shape.planes_.clear();
  shape.shells_.clear();
  for (const FigureParts::Limb& part : parts_.limbs) {
    FigureShape::Limb limb;
    limb.first_cone = static_cast<int>(shape.cones_.size());
    limb.cone_count = static_cast<int>(part.cones.size());
    limb.first_plane = static_cast<int>(shape.planes_.size());
    limb.plane_count = static_cast<int>(part.planes.size());
    limb.first_shell = static_cast<int>(shape.shells_.size());
    limb.shell_count = static_cast<int>(part.shells.size());
    limb.blend_m = part.blend_m;
    limb.inverse_4_blend = inverse_4(part.blend_m);
    for (const FigureParts::Cone& c : part.cones) {
      const Rigidf& M = T[static_cast<std::size_t>(c.bone)];
      shape.cones_.push_back(make_round_cone(M * c.a_m, M * c.b_m, c.radius_a_m, c.radius_b_m));
    }
    for (const FigureParts::Plane& p : part.planes) {
      const Rigidf& M = T[static_cast<std::size_t>(p.bone)];
      const Vec3f n = M.R * p.side.normal;
      shape.planes_.push_back({n, p.side.offset_m + dot(n, M.t)});
    }
    for (const SphereShell& s : part.shells)
      shape.shells_.push_back({T.front() * s.center_m, s.radius_m, s.half_thickness_m});
    if (limb.cone_count > 0) {
      bound_cones(std::span(shape.cones_).subspan(static_cast<std::size_t>(limb.first_cone)), limb);
    } else {
      limb.center_m = T.front() * part.planes_center_m;
      limb.radius_m = part.planes_radius_m;
    }
    shape.limbs_.push_back(limb);
  }
}

Vec3f Figure::velocity_m_s(Vec3f p_m, double time_s) const {
  if (!moving_) return {};
  const std::vector<Rigidf> now = bones(time_s);
  std::size_t nearest_bone = 0;
  float nearest_m = std::numeric_limits<float>::max();
  for (const FigureParts::Limb& limb : parts_.limbs) {
    for (const FigureParts::Cone& c : limb.cones) {
      const Rigidf& M = now[static_cast<std::size_t>(c.bone)];
      const float d = make_round_cone(M * c.a_m, M * c.b_m, c.radius_a_m, c.radius_b_m).distance_m(p_m);
      if (d < nearest_m) {
        nearest_m = d;
        nearest_bone = static_cast<std::size_t>(c.bone);
      }
    }
  }
  // Central difference over 20 ms: float poses round to 1e-7 m, so to 1e-5 m/s; the cut-off error is
  // (dt^2 / 24) |x'''| < 1e-4 m/s for motions of 0.3 m and 4 s.
  constexpr double kStep_s = 0.02;
  const Vec3f local = inverse(now[nearest_bone]) * p_m;
  const Vec3f before = bones(time_s - 0.5 * kStep_s)[nearest_bone] * local;
  const Vec3f after = bones(time_s + 0.5 * kStep_s)[nearest_bone] * local;
  return static_cast<float>(1 / kStep_s) * (after - before);
}

std::span<const std::string> figure_names() {
  static const std::vector<std::string> names = {"hand", "rabbit", "scalpel", "sphere", "bowl", "liver"};
  return names;
}

Figure make_figure(const std::string& name, const FigureOptions& options) {
  const std::span<const std::string> names = figure_names();
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end()) throw usage_error("unknown figure '" + name + "'" + suggestion(name, names));
  if (!(options.scale > 0 && options.scale <= kMostFigureScale)) {
    throw usage_error("figure '" + name + "': scale " + std::to_string(options.scale) +
                      ", expected above 0 and at most " + number_text(static_cast<double>(kMostFigureScale)));
  }
  const Vec3f o = options.offset_m;
  if (!std::isfinite(o.x) || !std::isfinite(o.y) || !std::isfinite(o.z))
    throw usage_error("figure '" + name + "': the offset is not finite");
  return {name, options.moving, kBuilders[static_cast<std::size_t>(found - names.begin())](options)};
}

Box3f figure_displacement_m(const std::string& name) {
  return make_figure(name, {.moving = true, .scale = 1e-4F}).bounds_m();
}

namespace {

/// Volume by cells of edge `edge_m` at the finest; `h_m` is that of the cell asked about.
class VolumeIntegral {
 public:
  VolumeIntegral(const FigureShape& shape, float finest_m) : shape_(shape), finest_m_(finest_m) {}

  /// The eight halves of a cell at once.
  double split(Vec3f center_m, float h_m) const {
    const float half = 0.5F * h_m, quarter = 0.25F * h_m;
    Vec3<Float8> p;
    for (int i = 0; i < 8; ++i) {
      p.x.set(i, center_m.x + ((i & 1) ? quarter : -quarter));
      p.y.set(i, center_m.y + ((i & 2) ? quarter : -quarter));
      p.z.set(i, center_m.z + ((i & 4) ? quarter : -quarter));
    }
    const Float8 f = shape_.distance_m(p);
    const double cell_m3 = static_cast<double>(half) * half * half;
    const float to_corner_m = 0.8660255F * half;
    double sum = 0;
    for (int i = 0; i < 8; ++i) {
      if (f[i] <= -to_corner_m) {
        sum += cell_m3;
      } else if (f[i] < to_corner_m) {
        if (half > 1.5F * finest_m_) {
          sum += split({p.x[i], p.y[i], p.z[i]}, half);
        } else {
          sum += cell_m3 * static_cast<double>(clamp(0.5F - f[i] / half, 0.F, 1.F));
        }
      }
    }
    return sum;
  }

 private:
  const FigureShape& shape_;
  float finest_m_;
};

}  // namespace

FigureVolume figure_volume(const FigureShape& shape, double tolerance) {
  const Box3f box = shape.bounds_m();
  const Vec3f e = box.extent();
  // Roots of 1/16 of the longest edge, laid over the box; a cube would be mostly empty.
  const float root_m = std::max({e.x, e.y, e.z}) / 16;
  const auto integrate = [&](int halvings) {
    const VolumeIntegral integral(shape, root_m / static_cast<float>(1 << halvings));
    double sum = 0;
    for (float z = 0; z < e.z; z += root_m)
      for (float y = 0; y < e.y; y += root_m)
        for (float x = 0; x < e.x; x += root_m) {
          const Vec3f center = box.min + Vec3f{x + 0.5F * root_m, y + 0.5F * root_m, z + 0.5F * root_m};
          const float f = shape.distance_m(center);
          if (f < 0.8660255F * root_m) sum += integral.split(center, root_m);
        }
    return sum;
  };
  constexpr int kMostHalvings = 7;
  double coarse = integrate(2), fine = integrate(3);
  for (int h = 4; std::abs(fine - coarse) > 3 * tolerance * fine && h <= kMostHalvings; ++h) {
    coarse = fine;
    fine = integrate(h);
  }
  return {fine, std::abs(fine - coarse) / 3};
}

}  // namespace tactus
