#include "tactus/tissue/surface_nets.h"

#include <cmath>
#include <string>
#include <vector>

#include "tactus/base/at.h"
#include "tactus/base/error.h"

namespace tactus {
namespace {

/// Samples on a grid that reaches two points beyond the box; the outermost points are outside by decree.
struct SampledField {
  Vec3f origin_m{};
  float h = 0;
  Vec3i dims{};
  std::vector<float> value;

  std::size_t index(Vec3i p) const { return at((std::int64_t{p.z} * dims.y + p.y) * dims.x + p.x); }
  Vec3f point(Vec3f p) const { return origin_m + h * p; }
  bool inside(Vec3i p) const { return value[index(p)] < 0; }
};

SampledField sample(const std::function<float(Vec3f)>& distance_m, const Box3f& box, float h) {
  if (!(h > 0) || !std::isfinite(h))
    throw Error("surface spacing must be a positive length, not " + std::to_string(h));
  SampledField field;
  field.h = h;
  field.origin_m = box.min - Vec3f{1.5F * h, 1.5F * h, 1.5F * h};
  double points = 1;
  for (int a = 0; a < 3; ++a) {
    const double n = std::ceil(double{box.extent()[a]} / double{h}) + 4;
    if (!(n < 1e5)) throw Error("surface spacing " + std::to_string(h) + " m is too small for the body");
    field.dims[a] = static_cast<Index>(n);
    points *= n;
  }
  if (points > 2e9)
    throw Error("surface spacing " + std::to_string(h) + " m needs " + bytes_text(points * 8));
  field.value.resize(at(static_cast<std::int64_t>(points)));
  for (Index z = 0; z < field.dims.z; ++z)
    for (Index y = 0; y < field.dims.y; ++y)
      for (Index x = 0; x < field.dims.x; ++x) {
        const bool rim = x == 0 || y == 0 || z == 0 || x + 1 == field.dims.x || y + 1 == field.dims.y ||
                         z + 1 == field.dims.z;
        const float d = rim ? h : distance_m(field.point(vec_cast<float>(Vec3i{x, y, z})));
        if (!std::isfinite(d)) throw Error("signed distance is not finite inside the body's box");
        field.value[field.index({x, y, z})] = rim ? max(d, 0.1F * h) : d;
      }
  return field;
}

/// Mean of the crossings on the twelve edges of a cell; count 0: the surface does not pass.
Vec3f cell_vertex(const SampledField& f, Vec3i cell, int& count) {
  Vec3f sum{};
  count = 0;
  for (int axis = 0; axis < 3; ++axis) {
    for (int e = 0; e < 4; ++e) {
      Vec3i a = cell;
      a[(axis + 1) % 3] += e & 1;
      a[(axis + 2) % 3] += e >> 1;
      Vec3i b = a;
      ++b[axis];
      if (f.inside(a) == f.inside(b)) continue;
      const float va = f.value[f.index(a)], vb = f.value[f.index(b)];
      Vec3f p = vec_cast<float>(a);
      p[axis] += va / (va - vb);
      sum += p;
      ++count;
    }
  }
  return sum;
}

}  // namespace

TriangleMesh surface_nets(const std::function<float(Vec3f)>& distance_m, const Box3f& box_m,
                          float spacing_m) {
  const SampledField f = sample(distance_m, box_m, spacing_m);
  TriangleMesh mesh;
  std::vector<Index> vertex(f.value.size(), -1);
  const auto for_each = [&](Vec3i last, auto&& body) {
    for (Index z = 0; z < last.z; ++z)
      for (Index y = 0; y < last.y; ++y)
        for (Index x = 0; x < last.x; ++x) body(Vec3i{x, y, z});
  };
  for_each(f.dims - Vec3i{1, 1, 1}, [&](Vec3i cell) {
    int count = 0;
    const Vec3f sum = cell_vertex(f, cell, count);
    if (count == 0) return;
    vertex[f.index(cell)] = static_cast<Index>(mesh.positions_m.size());
    mesh.positions_m.push_back(f.point((1.F / static_cast<float>(count)) * sum));
  });
  for_each(f.dims - Vec3i{1, 1, 1}, [&](Vec3i p) {
    for (int axis = 0; axis < 3; ++axis) {
      Vec3i q = p;
      ++q[axis];
      if (f.inside(p) == f.inside(q)) continue;
      Vec3i u{}, w{};
      u[(axis + 1) % 3] = 1;
      w[(axis + 2) % 3] = 1;
      // The four cells round the edge, counter-clockwise seen from the edge's far end.
      const Index a = vertex[f.index(p - u - w)], b = vertex[f.index(p - w)], c = vertex[f.index(p)],
                  d = vertex[f.index(p - u)];
      const bool outward = f.inside(p);
      mesh.triangles.push_back(outward ? std::array<Index, 3>{a, b, c} : std::array<Index, 3>{a, c, b});
      mesh.triangles.push_back(outward ? std::array<Index, 3>{a, c, d} : std::array<Index, 3>{a, d, c});
    }
  });
  if (mesh.triangles.empty())
    throw Error("the solid is empty at a surface spacing of " + std::to_string(spacing_m) + " m");
  compute_normals(mesh);
  return mesh;
}

TriangleMesh surface_of_labels(const LabelVolume& volume, const std::set<VoxelLabel>& solid,
                               float spacing_m) {
  const Vec3i n = volume.dims;
  if (n.x <= 0 || n.y <= 0 || n.z <= 0 || volume.labels.size() != at(std::int64_t{n.x} * n.y * n.z))
    throw Error("label volume of " + std::to_string(n.x) + "x" + std::to_string(n.y) + "x" +
                std::to_string(n.z) + " voxels holds " + std::to_string(volume.labels.size()) + " labels");
  const Vec3f v = volume.voxel_size_m;
  const auto share = [&](Vec3i p) {
    if (p.x < 0 || p.y < 0 || p.z < 0 || p.x >= n.x || p.y >= n.y || p.z >= n.z) return 0.F;
    return solid.contains(volume.labels[at((std::int64_t{p.z} * n.y + p.y) * n.x + p.x)]) ? 1.F : 0.F;
  };
  // Trilinear between voxel centres, 0.5 at the boundary; in units of a length so that it reads like a
  // distance.
  const auto field = [&](Vec3f p) {
    const Vec3f q = p - volume.origin_m;
    const Vec3f g{q.x / v.x - 0.5F, q.y / v.y - 0.5F, q.z / v.z - 0.5F};
    const Vec3i c{floor_to_int(g.x), floor_to_int(g.y), floor_to_int(g.z)};
    const Vec3f t = g - vec_cast<float>(c);
    float sum = 0;
    for (int k = 0; k < 8; ++k) {
      const Vec3i o{k & 1, k >> 1 & 1, k >> 2};
      const float w = (o.x != 0 ? t.x : 1 - t.x) * (o.y != 0 ? t.y : 1 - t.y) * (o.z != 0 ? t.z : 1 - t.z);
      sum += w * share(c + o);
    }
    return 0.5F - sum;
  };
  const Vec3f size{v.x * static_cast<float>(n.x), v.y * static_cast<float>(n.y),
                   v.z * static_cast<float>(n.z)};
  TriangleMesh mesh = surface_nets(field, {volume.origin_m, volume.origin_m + size}, spacing_m);
  for (Vec3f& p : mesh.positions_m) p = vec_cast<float>(volume.R_body_volume * vec_cast<double>(p));
  return mesh;
}

}  // namespace tactus
