#include "tactus/run/wall_look.h"

#include <cmath>
#include <cstdint>
#include <unordered_set>
#include <utility>
#include <vector>

#include "tactus/base/at.h"
#include "tactus/geom/mesh/point_cells.h"
#include "tactus/geom/mesh/surface_samples.h"

namespace tactus {
namespace {

constexpr float kLip = 0.1F, kGrain = 0.12F;  // in spacings
constexpr float kFar = 4;                     // spacings; depths beyond aren't told apart

constexpr std::uint8_t kSkin = 1, kWall = 2, kRim = kSkin | kWall;

/// Per vertex: kSkin, kWall or kRim.
std::vector<std::uint8_t> kinds_of(const TriangleMesh& surface, const CutWalls& walls) {
  std::vector<std::uint8_t> kinds(surface.positions_m.size());
  for (std::size_t t = 0; t < surface.triangles.size(); ++t)
    for (const Index v : surface.triangles[t]) kinds[at(v)] |= walls.is_wall[t] != 0 ? kWall : kSkin;
  return kinds;
}

Vec3f area_normal(const TriangleMesh& surface, const std::array<Index, 3>& corners) {
  const Vec3f from_m = surface.positions_m[at(corners[0])];
  return cross(surface.positions_m[at(corners[1])] - from_m, surface.positions_m[at(corners[2])] - from_m);
}

/// Walls and skin share no vertex any more; those that they shared have normals of their own side.
void split_rim(TriangleMesh& surface, const CutWalls& walls, std::vector<Index>& origins) {
  const std::vector<std::uint8_t> kinds = kinds_of(surface, walls);
  std::vector<Index> of_wall(kinds.size(), -1);
  std::vector<Vec3f> of_skin(kinds.size());
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    auto& corners = surface.triangles[t];
    const Vec3f normal = area_normal(surface, corners);
    for (Index& v : corners) {
      if (kinds[at(v)] != kRim) continue;
      if (walls.is_wall[t] == 0) {
        of_skin[at(v)] += normal;
        continue;
      }
      Index& own = of_wall[at(v)];
      if (own < 0) {
        own = static_cast<Index>(surface.positions_m.size());
        origins.push_back(v);
        surface.positions_m.push_back(Vec3f{surface.positions_m[at(v)]});
        surface.normals.push_back({});
      }
      surface.normals[at(own)] += normal;
      v = own;
    }
  }
  for (std::size_t v = 0; v < kinds.size(); ++v)
    if (kinds[v] == kRim) surface.normals[v] = normalized(of_skin[v], surface.normals[v]);
  for (std::size_t v = kinds.size(); v < surface.normals.size(); ++v)
    surface.normals[v] = normalized(surface.normals[v], Vec3f{0, 1, 0});
}

void smooth_walls(TriangleMesh& surface, const CutWalls& walls, const std::vector<std::uint8_t>& kinds) {
  TriangleMesh of_walls{surface.positions_m, {}, {}};
  for (std::size_t t = 0; t < surface.triangles.size(); ++t)
    if (walls.is_wall[t] != 0) of_walls.triangles.push_back(surface.triangles[t]);
  const SurfaceSamples samples(of_walls, walls.spacing_m, bounds(surface));
  for (std::size_t v = 0; v < surface.normals.size(); ++v) {
    if (kinds[v] != kWall) continue;
    Vec3f sum{};
    samples.around(surface.positions_m[v], surface.normals[v],
                   [&](const SurfaceSamples::Sample& s, float weight, Vec3f) { sum += weight * s.normal; });
    surface.normals[v] = normalized(sum, surface.normals[v]);
  }
}

/// Edges of skin along which a wall begins. @param place of a vertex: the first vertex that was there
std::vector<std::array<Index, 2>> rim_of(const TriangleMesh& surface, const CutWalls& walls,
                                         const std::vector<Index>& place) {
  const auto key = [&](Index a, Index b) {
    return static_cast<std::uint64_t>(place[at(a)]) << 32U | static_cast<std::uint64_t>(place[at(b)]);
  };
  std::unordered_set<std::uint64_t> of_walls;
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    const auto& c = surface.triangles[t];
    if (walls.is_wall[t] != 0)
      for (std::size_t k = 0; k < 3; ++k) of_walls.insert(key(c[k], c[(k + 1) % 3]));
  }
  std::vector<std::array<Index, 2>> rim;
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    const auto& c = surface.triangles[t];
    if (walls.is_wall[t] != 0) continue;
    for (std::size_t k = 0; k < 3; ++k)
      if (of_walls.contains(key(c[(k + 1) % 3], c[k]))) rim.push_back({c[k], c[(k + 1) % 3]});
  }
  return rim;
}

/// The rim of a cut at rest.
class Rim {
 public:
  struct Segment {
    Vec3f from_m, to_m, from_normal, to_normal;
  };
  Rim(std::vector<Segment> segments, float spacing_m)
      : segments_(std::move(segments)), near_(segments_, 0.25F * spacing_m), farther_(segments_, spacing_m) {}
  /// Distance from p_m, at most far_m, and the skin's normal there. @param normal stays where the rim is
  /// farther
  float distance_m(Vec3f p_m, float far_m, Vec3f& normal) const {
    Nearest found{far_m * far_m, segments_.size(), 0};
    const auto is_found_in = [&](const Places& places) {
      places.cells.around(p_m, [&](std::size_t k) { look_at(places.segments[k], p_m, found); });
      return found.distance_m2 < places.sure_m * places.sure_m;
    };
    if (!is_found_in(near_) && !is_found_in(farther_))
      for (std::size_t k = 0; k < segments_.size(); ++k) look_at(k, p_m, found);
    if (found.segment < segments_.size()) {
      const Segment& s = segments_[found.segment];
      normal = normalized((1 - found.along) * s.from_normal + found.along * s.to_normal, normal);
    }
    return std::sqrt(found.distance_m2);
  }

 private:
  struct Nearest {
    float distance_m2;
    std::size_t segment;
    float along;
  };
  void look_at(std::size_t k, Vec3f p_m, Nearest& found) const {
    const Segment& s = segments_[k];
    const Vec3f way = s.to_m - s.from_m, to = p_m - s.from_m;
    const float along = clamp(dot(to, way) / max(dot(way, way), 1e-20F), 0.F, 1.F);
    const Vec3f off = to - along * way;
    const float d_m2 = dot(off, off);
    if (d_m2 < found.distance_m2 ||
        (d_m2 == found.distance_m2 && k < found.segment && found.segment < segments_.size()))
      found = {d_m2, k, along};
  }
  /// Places along segments, so near one another that the part of a segment that is nearer than sure_m has one
  /// in the cells round.
  struct Places {
    std::vector<Vec3f> points_m;
    std::vector<std::size_t> segments;  ///< of each
    float sure_m;
    PointCells cells;
    Places(const std::vector<Segment>& all, float cell_m)
        : sure_m(0.75F * cell_m), cells(laid(all, cell_m, points_m, segments), cell_m) {}
    Places(const Places&) = delete;  // the cells hold on to the points
    Places& operator=(const Places&) = delete;
    static const std::vector<Vec3f>& laid(const std::vector<Segment>& all, float cell_m,
                                          std::vector<Vec3f>& points_m, std::vector<std::size_t>& segments) {
      for (std::size_t k = 0; k < all.size(); ++k) {
        const Vec3f way = all[k].to_m - all[k].from_m;
        const int count = 1 + static_cast<int>(2 * length(way) / cell_m);
        for (int i = 0; i < count; ++i) {
          points_m.push_back(all[k].from_m +
                             ((static_cast<float>(i) + 0.5F) / static_cast<float>(count)) * way);
          segments.push_back(k);
        }
      }
      return points_m;
    }
  };
  std::vector<Segment> segments_;
  Places near_, farther_;
};

}  // namespace

ViewFlesh part_walls(TriangleMesh& surface, const CutWalls& walls, std::vector<Index>& origins) {
  split_rim(surface, walls, origins);
  const std::vector<std::uint8_t> kinds = kinds_of(surface, walls);
  smooth_walls(surface, walls, kinds);
  std::vector<Index> place(surface.positions_m.size());
  const std::size_t first = place.size() - origins.size();
  for (std::size_t v = 0; v < place.size(); ++v)
    place[v] = v < first ? static_cast<Index>(v) : place[at(origins[v - first])];
  const auto rest_m = [&](Index v) { return walls.rest_m[at(place[at(v)])]; };
  std::vector<Rim::Segment> segments;
  for (const auto& [a, b] : rim_of(surface, walls, place))
    segments.push_back({rest_m(a), rest_m(b), surface.normals[at(a)], surface.normals[at(b)]});
  const Rim rim(std::move(segments), walls.spacing_m);
  const float far_m = kFar * walls.spacing_m;
  ViewFlesh flesh{
      .lip = surface.normals, .grain_m = kGrain * walls.spacing_m, .lip_m = kLip * walls.spacing_m};
  for (Index v = 0; v < static_cast<Index>(place.size()); ++v) {
    flesh.rest_m.push_back(rest_m(v));
    flesh.depth_m.push_back(kinds[at(v)] == kWall ? rim.distance_m(rest_m(v), far_m, flesh.lip[at(v)])
                                                  : -far_m);
  }
  return flesh;
}

void follow_refinement(ViewFlesh& flesh, const EdgeRefinement& made) {
  for (const auto& [a, b] : made.ends) {
    flesh.rest_m.push_back(0.5F * (flesh.rest_m[at(a)] + flesh.rest_m[at(b)]));
    flesh.depth_m.push_back(0.5F * (flesh.depth_m[at(a)] + flesh.depth_m[at(b)]));
    flesh.lip.push_back(normalized(flesh.lip[at(a)] + flesh.lip[at(b)], flesh.lip[at(a)]));
  }
}

}  // namespace tactus
