#include "tactus/tissue/boundary/surface_loads.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>

#include "tactus/base/compared_text.h"
#include "tactus/base/error.h"
#include "tactus/tissue/boundary/load_kernels.h"
#include "tactus/tissue/embedded_surface.h"

namespace tactus {
namespace {

void check_load(const SurfaceLoad& load) {
  const auto refuse = [&](const std::string& what) { throw usage_error(load.name + ": " + what); };
  if (load.triangles.empty()) refuse("it loads nothing: its region holds no piece of the surface");
  if (!std::isfinite(length(load.traction_Pa) + load.pressure_Pa))
    refuse("its force or pressure is not a number");
  double last_s = -1;
  for (std::size_t k = 0; k < load.keys.size(); ++k) {
    const boundary::LoadKey& key = load.keys[k];
    const std::string head = "keyframe " + std::to_string(k) + " ";
    if (!std::isfinite(key.time_s + key.factor)) refuse(head + "holds a value that is not a number");
    if (key.time_s < 0) refuse(head + "is at " + number_text(key.time_s) + " s, expected 0 or more");
    if (key.time_s <= last_s)
      refuse(head + "is at " + number_text(key.time_s, last_s) +
             " s, expected later than the one before, at " + number_text(last_s) + " s");
    last_s = key.time_s;
  }
}

Vec3d area_vector_m2(const TriangleMesh& surface, Index triangle) {
  const auto& t = surface.triangles[static_cast<std::size_t>(triangle)];
  const auto corner = [&](std::size_t k) {
    return vec_cast<double>(surface.positions_m[static_cast<std::size_t>(t[k])]);
  };
  return 0.5 * cross(corner(1) - corner(0), corner(2) - corner(0));
}

/// The part of one load that sits in one cube.
struct Part {
  Vec3d force_N, pressed_N;
  double area_m2 = 0;
  std::array<double, 8> weights{};
};

/// Three points inside each triangle, a third of it each: exact for weights that are quadratic along it.
std::vector<Vec3f> points_of(const SurfaceLoad& load, const TriangleMesh& surface) {
  std::vector<Vec3f> points;
  for (const Index t : load.triangles) {
    const auto& corners = surface.triangles[static_cast<std::size_t>(t)];
    const auto corner = [&](std::size_t k) {
      return surface.positions_m[static_cast<std::size_t>(corners[k])];
    };
    const Vec3f sum = corner(0) + corner(1) + corner(2);
    for (std::size_t k = 0; k < 3; ++k) points.push_back(1.F / 6 * sum + 0.5F * corner(k));
  }
  return points;
}

std::map<Index, Part> parts_of(const SurfaceLoad& load, const CubeLattice& lattice,
                               const TriangleMesh& surface) {
  const std::vector<embed::Anchor> anchors =
      bearing_anchors(lattice, anchor_points(lattice, points_of(load, surface), 1));
  auto anchor_of = anchors.begin();
  std::map<Index, Part> parts;
  for (const Index t : load.triangles) {
    const Vec3d area = (1.0 / 3) * area_vector_m2(surface, t);
    for (int k = 0; k < 3; ++k) {
      const embed::Anchor& anchor = *anchor_of++;
      Part& part = parts[anchor.cube];
      part.force_N += length(area) * load.traction_Pa;
      part.pressed_N += load.pressure_Pa * area;
      part.area_m2 += length(area);
      for (std::size_t q = 0; q < 8; ++q) {
        double weight = length(area);
        for (int a = 0; a < 3; ++a) {
          const auto at = static_cast<double>(anchor.local[a]);
          weight *= (q >> a & 1U) != 0 ? at : 1 - at;
        }
        part.weights[q] += weight;
      }
    }
  }
  return parts;
}

}  // namespace

double area_m2(const TriangleMesh& surface, std::span<const Index> triangles) {
  double sum = 0;
  for (const Index t : triangles) sum += length(area_vector_m2(surface, t));
  return sum;
}

SurfaceLoads::SurfaceLoads(ExecContext& ctx, const CubeLattice& lattice, const TriangleMesh& surface,
                           std::span<const SurfaceLoad> loads, const NodeWindow& window)
    : gradient_per_m_(1 / (4 * lattice.spacing_m)) {
  if (loads.empty()) return;
  std::vector<boundary::LoadCurve> curves;
  std::vector<boundary::LoadKey> keys;
  std::vector<boundary::LoadedCube> loaded;
  std::map<Index, std::vector<boundary::LoadShare>> of_node;
  for (const SurfaceLoad& load : loads) {
    check_load(load);
    const auto begin = static_cast<Index>(keys.size()), index = static_cast<Index>(curves.size());
    if (load.keys.empty()) keys.emplace_back();
    keys.insert(keys.end(), load.keys.begin(), load.keys.end());
    std::set<Index> sharing;
    curves.push_back({begin, static_cast<Index>(keys.size())});
    for (const auto& [cube, part] : parts_of(load, lattice, surface)) {
      const std::array<Index, 8>& corners = lattice.cube_nodes[static_cast<std::size_t>(cube)];
      sharing.insert(corners.begin(), corners.end());
      if (std::none_of(corners.begin(), corners.end(), [&](Index node) { return window.owns(node); }))
        continue;
      embed::CubeNodes nodes;
      for (std::size_t q = 0; q < 8; ++q) {
        nodes.node[q] = corners[q] - window.held.begin;
        if (window.owns(corners[q]))
          of_node[nodes.node[q]].push_back(
              {static_cast<Index>(loaded.size()), static_cast<float>(part.weights[q] / part.area_m2)});
      }
      loaded.push_back({nodes, index, vec_cast<float>(part.force_N), vec_cast<float>(part.pressed_N)});
    }
    nodes_of_.emplace_back(sharing.begin(), sharing.end());
  }
  std::vector<Index> nodes, begin{0};
  std::vector<boundary::LoadShare> shares;
  for (const auto& [node, own] : of_node) {
    nodes.push_back(node);
    shares.insert(shares.end(), own.begin(), own.end());
    begin.push_back(static_cast<Index>(shares.size()));
  }
  curves_ = to_device(ctx, curves);
  keys_ = to_device(ctx, keys);
  clock_s_ = to_device(ctx, std::vector<double>{0});
  factor_ = to_device(ctx, std::vector<float>(curves.size()));
  loaded_ = to_device(ctx, loaded);
  part_force_N_ = to_device(ctx, std::vector<Vec3f>(loaded.size()));
  nodes_ = to_device(ctx, nodes);
  begin_ = to_device(ctx, begin);
  shares_ = to_device(ctx, shares);
}

void SurfaceLoads::apply(ExecContext& ctx, BodyState& state, const StepTime& time) {
  if (empty()) return;
  ctx.parallel_for(
      "loads/step", 1,
      boundary::StepLoads{curves_.const_view(), keys_.const_view(), clock_s_.view(), factor_.view(), time});
  ctx.parallel_for("loads/cubes", loaded_.size(),
                   boundary::LoadCubes{loaded_.const_view(), factor_.const_view(), state.x_m.const_view(),
                                       part_force_N_.view(), gradient_per_m_});
  ctx.parallel_for("loads/nodes", nodes_.size(),
                   boundary::GatherLoads{nodes_.const_view(), begin_.const_view(), shares_.const_view(),
                                         part_force_N_.const_view(), state.f_ext_N.view()});
}

}  // namespace tactus
