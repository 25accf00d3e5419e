#include "tactus/track/blade_model.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "tactus/base/error.h"
#include "tactus/base/math.h"
#include "tactus/geom/figures/figures.h"
#include "tactus/geom/mesh/closest_point.h"
#include "tactus/geom/mesh/mesh_defects.h"

namespace tactus {
namespace {

constexpr double kLeast_m = 0.02, kMost_m = 0.6;  // of a tool that a hand holds

void append(TriangleMesh& mesh, const TriangleMesh& other) {
  const auto first = static_cast<Index>(mesh.positions_m.size());
  mesh.positions_m.insert(mesh.positions_m.end(), other.positions_m.begin(), other.positions_m.end());
  for (auto t : other.triangles) mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
}

/// The convex body that half-spaces have in common; it must be bounded.
TriangleMesh convex_body(std::span<const HalfSpace> sides, double size_m) {
  TriangleMesh mesh;
  const auto vertex = [&](Vec3d p) {
    for (std::size_t i = 0; i < mesh.positions_m.size(); ++i) {
      if (length(vec_cast<double>(mesh.positions_m[i]) - p) < 1e-5 * size_m) return static_cast<Index>(i);
    }
    mesh.positions_m.push_back(vec_cast<float>(p));
    return static_cast<Index>(mesh.positions_m.size()) - 1;
  };
  for (const HalfSpace& side : sides) {
    const Vec3d n = vec_cast<double>(side.normal), middle = static_cast<double>(side.offset_m) * n;
    const Vec3d u = normalized(cross(std::abs(n.x) < 0.7 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0}, n)),
                v = cross(n, u);
    std::vector<Vec3d> face;
    for (const auto& [a, b] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}})
      face.push_back(middle + (4 * size_m) * (a * u + b * v));
    for (const HalfSpace& other : sides) {
      if (&other == &side) continue;
      std::vector<Vec3d> kept;
      const auto depth = [&](Vec3d p) {
        return static_cast<double>(other.offset_m) - dot(vec_cast<double>(other.normal), p);
      };
      for (std::size_t i = 0; i < face.size(); ++i) {
        const Vec3d a = face[i], b = face[(i + 1) % face.size()];
        if (depth(a) >= 0) kept.push_back(a);
        if ((depth(a) >= 0) != (depth(b) >= 0))
          kept.push_back(a + depth(a) / (depth(a) - depth(b)) * (b - a));
      }
      face = std::move(kept);
    }
    std::vector<Index> corners;
    for (const Vec3d& p : face) {
      const Index i = vertex(p);
      if (corners.empty() || (corners.back() != i && corners.front() != i)) corners.push_back(i);
    }
    for (std::size_t i = 2; i < corners.size(); ++i)
      mesh.triangles.push_back({corners[0], corners[i - 1], corners[i]});
  }
  return mesh;
}

double distance_m(const TriangleMesh& mesh, Vec3f p_m) {
  float nearest = 1e30F;
  for (const auto& t : mesh.triangles) {
    const auto at = [&](int i) {
      return mesh.positions_m[static_cast<std::size_t>(t[static_cast<std::size_t>(i)])];
    };
    nearest = min(nearest, length(closest_point_on_triangle(p_m, at(0), at(1), at(2)) - p_m));
  }
  return static_cast<double>(nearest);
}

std::string mm(double m) { return number_text(std::round(m * 1e5) / 100) + " mm"; }

/// A section of a flat part across x: how far it reaches to -y and +y, with chamfers.
struct Section {
  float x_m, below_m, above_m;
  float half_thickness_m;
  float ground_m = 0;  ///< height of the grind: the lower chamfer ends in an edge. 0: chamfered as above
};

/// The surface through sections, closed at both ends.
TriangleMesh flat_part(std::span<const Section> sections) {
  constexpr float kChamfer = 0.5F;  // of the half thickness
  constexpr Index kRing = 8;
  TriangleMesh mesh;
  for (const Section& s : sections) {
    const float t = s.half_thickness_m, half_height_m = 0.5F * (s.below_m + s.above_m),
                c = min(kChamfer * t, half_height_m);
    const float low = min(s.ground_m > 0 ? s.ground_m : c, half_height_m),
                edge = s.ground_m > 0 ? 0.05F * t : t - c;
    const Vec2f ring[kRing] = {{s.above_m, t - c},  {s.above_m - c, t},  {low - s.below_m, t},
                               {-s.below_m, edge},  {-s.below_m, -edge}, {low - s.below_m, -t},
                               {s.above_m - c, -t}, {s.above_m, c - t}};
    for (const Vec2f yz : ring) mesh.positions_m.push_back({s.x_m, yz.x, yz.y});
  }
  const auto last = static_cast<Index>(sections.size()) - 1;
  for (Index s = 0; s < last; ++s) {
    for (Index k = 0; k < kRing; ++k) {
      const Index a = kRing * s + k, b = kRing * s + (k + 1) % kRing;
      mesh.triangles.push_back({a, a + kRing, b});
      mesh.triangles.push_back({b, a + kRing, b + kRing});
    }
  }
  for (Index k = 2; k < kRing; ++k) {
    mesh.triangles.push_back({0, k - 1, k});
    mesh.triangles.push_back({kRing * last, kRing * last + k, kRing * last + k - 1});
  }
  return mesh;
}

/// The outline of the figure "scalpel", which is thicker so that its masks are, with the handle of a No. 3:
/// flat, round at its end, waved where fingers hold it; and a blade whose belly is round.
TriangleMesh drawn_scalpel() {
  constexpr int kSteps = 24;
  constexpr float kHandle_m = 0.0055F, kNeck_m = 0.0035F, kBlade_m = 0.0014F, kGrind_m = 0.009F;
  std::vector<Section> handle, blade;
  const auto smooth = [](float t) { return t * t * (3 - 2 * t); };
  const auto between = [&](float x0, float x1, Vec2f y0, Vec2f y1, int steps) {
    for (int k = 0; k <= steps; ++k) {
      const float t = static_cast<float>(k) / static_cast<float>(steps), s = smooth(t);
      handle.push_back({x0 + t * (x1 - x0), y0.x + s * (y1.x - y0.x), y0.y + s * (y1.y - y0.y), kHandle_m});
    }
  };
  between(-0.075F, 0.03F, {0.0125F, 0.0115F}, {0.034F, 0.016F}, kSteps / 2);
  between(0.04F, 0.296F, {0.034F, 0.016F}, {0.018F, 0.015F}, kSteps / 2);
  for (int k = 1; k <= 6; ++k) {
    const SinCos turn = sin_cos(0.5F * kPi * 0.96F * static_cast<float>(k) / 6);
    handle.push_back({0.296F + 0.016F * turn.sin, 0.018F * turn.cos, 0.015F * turn.cos, kHandle_m});
  }
  const Section neck[] = {{-0.086F, 0.0105F, 0.0095F, kNeck_m},
                          {-0.078F, 0.0125F, 0.0115F, kNeck_m},
                          {-0.03F, 0.0135F, 0.0125F, kNeck_m}};
  const auto back = [](float x) { return 0.004F + 0.05F * (x + 0.24F); };
  for (int k = 1; k <= kSteps; ++k) {  // the belly, a quarter of an ellipse
    const SinCos turn = sin_cos(0.5F * kPi * static_cast<float>(k) / kSteps);
    const float x = -0.175F - 0.065F * turn.cos;
    blade.push_back({x, 0.032F * turn.sin - 0.004F, back(x), kBlade_m, kGrind_m});
  }
  blade.push_back({-0.085F, 0.028F, back(-0.085F), kBlade_m, kGrind_m});
  blade.push_back(
      {-0.062F, 0.0005F - back(-0.062F), back(-0.062F), kBlade_m, kGrind_m});  // the heel is oblique
  TriangleMesh mesh = flat_part(handle);
  append(mesh, flat_part(neck));
  append(mesh, flat_part(blade));
  for (Vec3f& p : mesh.positions_m) p *= static_cast<float>(kScalpelScale);
  return mesh;
}

}  // namespace

void check_blade_model(const BladeModel& model) {
  const std::string who = "blade model '" + model.name + "'";
  check_closed(model.mesh, who.c_str());
  const Box3f box = bounds(model.mesh);
  const double size_m = static_cast<double>(length(box.extent()));
  if (!(size_m >= kLeast_m && size_m <= kMost_m)) {
    const bool is_mm = size_m >= 1000 * kLeast_m && size_m <= 1000 * kMost_m;
    throw Error(who + " is " + number_text(size_m) + " m long, expected " + number_text(kLeast_m) + " to " +
                number_text(kMost_m) + (is_mm ? "; it seems to be in mm: say 'unit_m: 0.001'" : ""));
  }
  if (model.edge_m.size() < 2)
    throw Error(who + " has no edge: it has " + std::to_string(model.edge_m.size()) +
                " points, expected two or more, from the tip");
  for (std::size_t i = 0; i < model.edge_m.size(); ++i) {
    const Vec3f p = model.edge_m[i];
    if (!(std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z)))
      throw Error(who + ": point " + std::to_string(i) + " of its edge is not finite");
    const double off_m = distance_m(model.mesh, p);
    if (off_m > 0.02 * size_m)
      throw Error(who + ": point " + std::to_string(i) + " of its edge is " + mm(off_m) +
                  " from its mesh, expected at most " + mm(0.02 * size_m) +
                  "; edge and mesh have one frame and unit");
    if (i > 0 && !(length(p - model.edge_m[i - 1]) > 0))
      throw Error(who + ": points " + std::to_string(i - 1) + " and " + std::to_string(i) +
                  " of its edge are the same");
  }
}

BladeModel built_in_scalpel() {
  const Figure figure = make_figure("scalpel", {.scale = static_cast<float>(kScalpelScale)});
  const FigureShape shape = figure.at(0);
  const Rigidf T_world_model = figure.bones(0).front(), T_model_world = inverse(T_world_model);
  BladeModel model{"scalpel", {}, {}};
  for (const FigureShape::Limb& limb : shape.limbs()) {
    std::vector<HalfSpace> sides;
    for (const HalfSpace& side : shape.planes(limb)) {
      const Vec3f n = T_model_world.R * side.normal;
      sides.push_back({n, side.offset_m - dot(side.normal, T_world_model.t)});
    }
    append(model.mesh, convex_body(sides, 0.5 * kScalpelScale));
  }
  for (const Vec3f p : scalpel_edge_m()) model.edge_m.push_back(static_cast<float>(kScalpelScale) * p);
  model.drawn = drawn_scalpel();
  return model;
}

}  // namespace tactus
