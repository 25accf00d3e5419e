#include "tactus/tissue/cut/cut_surface.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "tactus/compute/cpu_for.h"
#include "tactus/tissue/cut/cut_geometry.h"

namespace tactus::cut {
namespace {

/// Small numbers that look random, -0.5..0.5.
double scatter(std::uint64_t i) { return static_cast<double>(mixed(i) >> 11U) * 0x1p-53 - 0.5; }

/// Vertices are whole multiples of it, in spacings: a power of two that is larger than the rounding error of
/// their places as floats, so a face on a plane of the lattice lies on it.
double grain_of(const CubeLattice& lattice, const TriangleMesh& surface) {
  double farthest_m = 0;
  for (const Vec3f p : surface.positions_m)
    farthest_m = std::max({farthest_m, double{std::abs(p.x)}, double{std::abs(p.y)}, double{std::abs(p.z)}});
  const double unsure = 6 * farthest_m * 0x1p-24 / double{lattice.spacing_m};
  return std::exp2(std::ceil(std::log2(std::max(unsure, 0x1p-14))));
}

}  // namespace

CutSurface::CutSurface(const LatticeCutter& cutter, const TriangleMesh& surface,
                       std::span<const embed::Anchor> anchors, Capacity capacity)
    : capacity_(capacity),
      parted_place_(cutter.lattice().cubes.size(), -1),
      parent_(cutter.lattice().cubes.size(), -1),
      joined_(cutter.lattice().cubes.size(), -1),
      ends_(cutter.lattice().copies.size()),
      held_(cutter.lattice().copies.size()) {
  const std::size_t most = std::max(index(capacity.triangles), surface.triangles.size());
  bins_.resize(cutter.lattice().regular_cubes());
  wall_points_.reserve(4 * cutter.lattice().copies.size());
  triangles_.reserve(most);
  vertices_of_.reserve(most);
  points_.reserve(std::max(index(capacity.vertices), surface.positions_m.size()));
  place_points(cutter, surface, anchors);
  TriangleMesh in_lattice;
  for (const Point& point : points_) in_lattice.positions_m.push_back(vec_cast<float>(point.p));
  in_lattice.triangles = surface.triangles;
  solid_ = std::make_unique<PointInMesh>(in_lattice);
  for (const auto& t : surface.triangles) {
    Triangle triangle;
    for (std::size_t k = 0; k < 3; ++k) triangle.corner[k] = {t[k], anchors[index(t[k])].cube};
    triangles_.push_back(triangle);
    vertices_of_.push_back(t);
    const Index place = triangle_count() - 1;
    add_to_bins(cutter, {&place, 1});
  }
  find_empty_cubes(cutter);
  take_capacity_for_frame(std::min(cutter.lattice().copies.size() / 2, kFrameSplits));
}

/// Cubes beside a face of the body that holds none of it: where floats put them. Cubes that hang together
/// without a triangle are all inside or all outside.
void CutSurface::find_empty_cubes(const LatticeCutter& cutter) {
  const Index count = cutter.lattice().regular_cubes();
  std::vector<std::uint8_t> is_known(index(count));
  is_empty_.assign(index(count), 0);
  std::vector<Index> found;
  for (Index first = 0; first < count; ++first) {
    if (is_known[index(first)] != 0 || !bins_.empty(first)) continue;
    const Vec3d middle = vec_cast<double>(cutter.lattice().cubes[index(first)]) + Vec3d{0.5, 0.5, 0.5};
    const std::uint8_t is_empty = solid_->inside(vec_cast<float>(middle)) ? 0 : 1;
    is_known[index(first)] = 1;
    found.assign(1, first);
    while (!found.empty()) {
      const Index cube = found.back();
      found.pop_back();
      is_empty_[index(cube)] = is_empty;
      for (int side = 0; side < 6; ++side) {
        Vec3i next = cutter.lattice().cubes[index(cube)];
        next[side / 2] += side % 2 == 0 ? 1 : -1;
        const Index to = cutter.regular_at(next);
        if (to < 0 || is_known[index(to)] != 0 || !bins_.empty(to)) continue;
        is_known[index(to)] = 1;
        found.push_back(to);
      }
    }
  }
}

void CutSurface::place_points(const LatticeCutter& cutter, const TriangleMesh& surface,
                              std::span<const embed::Anchor> anchors) {
  const CubeLattice& lattice = cutter.lattice();
  std::vector<Vec3d> normal(surface.positions_m.size());
  for (const auto& [a, b, c] : surface.triangles) {
    const Vec3d o = vec_cast<double>(surface.positions_m[index(a)]);
    const Vec3d n = cross(vec_cast<double>(surface.positions_m[index(b)]) - o,
                          vec_cast<double>(surface.positions_m[index(c)]) - o);
    for (const Index v : {a, b, c}) normal[index(v)] += n;
  }
  const double grain = grain_of(lattice, surface);
  for (std::size_t v = 0; v < normal.size(); ++v) {
    const embed::Anchor& anchor = anchors[v];
    const Vec3d low = vec_cast<double>(lattice.cubes[index(anchor.cube)]);
    Vec3d p = (vec_cast<double>(surface.positions_m[v]) - vec_cast<double>(lattice.origin_m)) /
              double{lattice.spacing_m};
    for (int a = 0; a < 3; ++a) {
      const double n = normalized(normal[v])[a];
      const double inward = std::abs(n) > 0.1 ? (n > 0 ? 2e-6 : -2e-6) : 0;
      const double moved = 1e-6 * scatter(3 * v + static_cast<std::uint64_t>(a));
      // Nothing sticks out of all cubes.
      const double in_grains = grain * std::round(p[a] / grain) - inward;
      p[a] = rounded(std::clamp(in_grains, low[a] + 1.5e-6, low[a] + 1 - 1.5e-6) + moved);
    }
    points_.push_back({p});
    vertex_point_.push_back(static_cast<Index>(v));
    vertex_cube_.push_back(anchor.cube);
    local_.push_back(anchor.local);
  }
}

/// @param triangles that have the same corners
void CutSurface::add_to_bins(const LatticeCutter& cutter, std::span<const Index> triangles) {
  const auto& corner = triangles_[index(triangles.front())].corner;
  for_each_cell(at(corner[0].point), at(corner[1].point), at(corner[2].point), [&](Vec3i cell) {
    if (const Index cube = cutter.regular_at(cell); cube >= 0)
      for (const Index triangle : triangles) bins_.push_back(cube, triangle);
  });
}

/// @returns its place; -1: there is no capacity
Index CutSurface::place_triangle(const Triangle& triangle) {
  if (!free_.empty()) {
    const Index place = free_.back();
    free_.pop_back();
    triangles_[index(place)] = triangle;
    return place;
  }
  if (triangle_count() >= capacity_.triangles) {
    is_full_ = true;
    return -1;
  }
  triangles_.push_back(triangle);
  vertices_of_.push_back({0, 0, 0});
  return triangle_count() - 1;
}

void CutSurface::add_triangle(const LatticeCutter& cutter, const Triangle& triangle) {
  if (const Index place = place_triangle(triangle); place >= 0) add_to_bins(cutter, {&place, 1});
}

Index CutSurface::leaf(Index cube, Vec3d p) const {
  for (;;) {
    if (const Index joined = joined_[index(cube)]; joined >= 0)
      cube = joined;
    else if (const Index place = parted_place_[index(cube)]; place >= 0)
      cube = parted_[index(place)].part_at(p);
    else
      return cube;
  }
}

Vec3d CutSurface::outward(Vec3d p) const {
  constexpr double kStep = 0.01;  // spacings: distances are floats
  Vec3d way{};
  for (int a = 0; a < 3; ++a) {
    Vec3d step{};
    step[a] = kStep;
    way[a] = depth(p - step) - depth(p + step);
  }
  return normalized(way, Vec3d{0, 1, 0});
}

void CutSurface::make_walls(const LatticeCutter& cutter, const std::vector<CubeSplit>& stage, Stage& s) {
  const CubeLattice& lattice = cutter.lattice();
  const std::size_t first_parted = parted_.size();
  s.splits.resize(stage.size());
  parted_.resize(first_parted + stage.size());
  std::size_t faces = 0;
  for (std::size_t k = 0; k < stage.size(); ++k) {
    Split& split = s.splits[k];
    split = {};
    split.split = stage[k];
    split.regular = cutter.regular_of(stage[k].parent);
    is_cut_again_ = is_cut_again_ || split.regular != stage[k].parent;
    find_points(cutter, split);
    split.first_face = faces;
    for (const Index triangle : bins_.of(split.regular)) {
      set_.insert(triangle);
      ++faces;
    }
    if (faces > split.first_face) at_surface_.push_back(k);
  }
  s.faces.resize(faces);
  set_.take(s.near);
  s.segments.reset(static_cast<Index>(s.near.size()));
  s.first_point = static_cast<Index>(points_.size());
  cpu_for(stage.size(), 8, [&](std::size_t k) {
    Split& split = s.splits[k];
    std::array<Vec3d, kPairs> place;
    for (std::size_t pair = 0; pair < kPairs; ++pair)
      if (split.point[pair] >= 0) place[pair] = at(split.point[pair]);
    Parted& parted = parted_[first_parted + k];
    parted = {Wall(lattice.cubes[index(split.regular)], split.split.sides, cutter.corners(split.split.parent),
                   place, split.wedges),
              {split.split.part[0], split.split.part[1]},
              -1};
    split.wall = &parted.wall;
    find_reference(cutter, split);
    find_faces(s, split);
  });
  for (Split& split : s.splits) {
    split.first_wall = s.walls.size();
    const std::size_t first = next_split_walls_.size();
    for (const Wall::Triangle& t : split.wall->triangles()) {
      const auto of = [&](std::size_t corner) { return split.point[t.pair[corner]]; };
      const Piece p{of(0), of(1), of(2)};
      const std::uint32_t pairs = 1U << t.pair[0] | 1U << t.pair[1] | 1U << t.pair[2];
      s.walls.push_back({p, static_cast<std::size_t>(&split - s.splits.data()), t.tet,
                         (pairs & ~split.in_reach) == 0 && (pairs & ~split.at_end) != 0});
      next_split_walls_.push_back({at(p[0]), at(p[1]), at(p[2])});
    }
    split.end_wall = s.walls.size();
    next_splits_.push_back({split.split, first, next_split_walls_.size()});
  }
  s.wall_segments.reset(static_cast<Index>(s.walls.size()));
}

/// A plane through crossings of a cube with a wall, as well as they have one: sum (g (p - middle))^2 is least
/// among the g that rise by 1 from the middle of the corners on side 0 to that of the others.
class CrossingPlane {
 public:
  CrossingPlane(std::uint8_t sides, std::span<const Vec3d> crossings) {
    for (const Vec3d& p : crossings) middle_ += p / static_cast<double>(crossings.size());
    Mat3d m;
    for (int a = 0; a < 3; ++a) m.row[a][a] = 1e-9;
    for (const Vec3d& p : crossings)
      for (int a = 0; a < 3; ++a) m.row[a] += (p - middle_)[a] * (p - middle_);
    Vec3d rise{};
    const int above = std::popcount(static_cast<unsigned>(sides));
    for (int q = 0; q < 8; ++q) {
      const Vec3d corner{double(q & 1), double(q >> 1 & 1), double(q >> 2)};
      rise += (sides >> q & 1) != 0 ? corner / above : -(corner / (8 - above));
    }
    // Cramer's rule; only the direction counts.
    const Vec3d bc = cross(m.row[1], m.row[2]), ca = cross(m.row[2], m.row[0]),
                ab = cross(m.row[0], m.row[1]);
    slope_ = normalized(rise.x * bc + rise.y * ca + rise.z * ab, rise);
    if (dot(slope_, rise) < 0) slope_ = -slope_;
  }
  double above(Vec3d p) const { return dot(slope_, p - middle_); }

 private:
  Vec3d middle_{}, slope_{};
};

/// Shares of the ways between corners on different sides. Where the strip ended before it came there, the
/// wall goes on as a plane.
std::array<double, kPairs> CutSurface::places_of(const LatticeCutter& cutter, const CubeSplit& split) const {
  std::array<double, kPairs> places;
  places.fill(-1);
  ShortList<Vec3d, 20> crossings;
  const auto corner = [](int q) { return vec_cast<double>(Vec3i{q & 1, q >> 1 & 1, q >> 2}); };
  bool is_known = true;
  for (std::size_t pair = 0; pair < kPairs; ++pair) {
    const auto [a, b] = kCornerPairs[pair];
    if ((split.sides >> a & 1) == (split.sides >> b & 1)) continue;
    places[pair] = cutter.place(split.parent, a, b);
    is_known = is_known && places[pair] >= 0;
    if (places[pair] >= 0) crossings.push_back(corner(a) + places[pair] * (corner(b) - corner(a)));
  }
  if (is_known) return places;
  const CrossingPlane plane(split.sides, {crossings.begin(), crossings.end()});
  for (std::size_t pair = 0; pair < kPairs; ++pair) {
    const auto [a, b] = kCornerPairs[pair];
    if ((split.sides >> a & 1) == (split.sides >> b & 1) || places[pair] >= 0) continue;
    const double sign = (split.sides >> a & 1) != 0 ? 1 : -1;
    const double of_a = std::max(sign * plane.above(corner(a)), 1e-9),
                 of_b = std::max(-sign * plane.above(corner(b)), 1e-9);
    places[pair] = crossings.empty() ? 0.5 : std::clamp(of_a / (of_a + of_b), kFromNode, 1 - kFromNode);
  }
  return places;
}

/// Where the wall crosses the ways between corners on different sides.
void CutSurface::find_points(const LatticeCutter& cutter, Split& split) {
  const auto& nodes = cutter.lattice().cube_nodes[index(split.split.parent)];
  const Vec3d low = vec_cast<double>(cutter.lattice().cubes[index(split.regular)]);
  std::array<double, kPairs> places = places_of(cutter, split.split);
  keep_in_reach(cutter, split, places);
  for (std::size_t pair = 0; pair < kPairs; ++pair) {
    const auto [a, b] = kCornerPairs[pair];
    split.point[pair] = -1;
    if (places[pair] < 0) continue;
    const auto [known, is_new] = wall_points_.try_emplace(edge_key(nodes[index(a)], nodes[index(b)]),
                                                          static_cast<Index>(points_.size()));
    split.point[pair] = *known;
    if (!is_new) continue;
    const auto corner = [&](int q) { return low + vec_cast<double>(Vec3i{q & 1, q >> 1 & 1, q >> 2}); };
    points_.push_back(
        {between(corner(a), corner(b), places[pair]), true, {-1, -1}, (split.beyond >> pair & 1) != 0});
  }
  note_ends(cutter, split);
}

/// A cube's material, as it came from the walls that parted its cube.
template <class F>
void CutSurface::for_each_tet(const LatticeCutter& cutter, Index cube, F&& f) const {
  // Cubes that fell apart on the way to this one, the last one first. Each has a corner more than the next,
  // but for those that an island left.
  std::array<Index, kMostParents> from;
  std::size_t count = 0;
  Index root = cube;
  for (Index parent = parent_[index(cube)]; parent >= 0; parent = parent_[index(parent)])
    from[count++] = root = parent;
  const auto descend = [&](const auto& self, const Tet& tet, std::size_t left) -> void {
    if (left == 0) {
      f(tet);
      return;
    }
    const Parted& parted = parted_[index(parted_place_[index(from[left - 1])])];
    const int side = parted.part[0] == (left > 1 ? from[left - 2] : cube) ? 0 : 1;
    part(tet, parted.wall, [&](int of, const Tet& piece, double) {
      if (of == side) self(self, piece, left - 1);
    });
  };
  for (const Tet& tet : whole_cube(cutter.lattice().cubes[index(root)])) descend(descend, tet, count);
}

/// Near a corner of the parent the original surface says whether there is material.
void CutSurface::find_reference(const LatticeCutter& cutter, Split& split) const {
  split.has_surface = !bins_.empty(split.regular);
  split.is_reference_inside = is_empty_[index(split.regular)] == 0;
  if (!split.has_surface) return;
  const Vec3d low = vec_cast<double>(cutter.lattice().cubes[index(split.regular)]);
  const std::uint8_t own = cutter.corners(split.split.parent);
  float deepest = -1;
  for (const double share : {0.2, 0.07, 0.02, 0.005, 0.001, 1e-4, 1e-5}) {
    for (int q = 0; q < 8; ++q) {
      if ((own >> q & 1) == 0) continue;
      const Vec3d corner{double(q & 1), double(q >> 1 & 1), double(q >> 2)};
      const Vec3d p = low + corner + share * (Vec3d{0.51731, 0.48677, 0.50913} - corner);
      if (leaf(split.regular, p) != split.split.parent) continue;
      const Vec3f near = vec_cast<float>(p);
      const float distance = std::abs(solid_->distance_m(near));
      if (!(distance > deepest)) continue;
      deepest = distance;
      split.reference = p;
      split.is_reference_inside = solid_->inside(near);
      if (distance > 1e-4F) return;
    }
  }
  // Islands may have nothing near their corners.
  for_each_tet(cutter, split.split.parent, [&](const Tet& tet) {
    const Vec3d p = 0.25 * (tet[0] + tet[1] + tet[2] + tet[3]);
    const float distance = std::abs(solid_->distance_m(vec_cast<float>(p)));
    if (leaf(split.regular, p) != split.split.parent || !(distance > deepest)) return;
    deepest = distance;
    split.reference = p;
    split.is_reference_inside = solid_->inside(vec_cast<float>(p));
  });
}

void CutSurface::find_faces(Stage& s, Split& split) const {
  for (const Index triangle : bins_.of(split.regular)) {
    const Triangle& t = triangles_[index(triangle)];
    if (t.is_fill || (t.home >= 0 && t.home != split.split.parent)) continue;
    const Vec3d a = at(t.corner[0].point), b = at(t.corner[1].point), c = at(t.corner[2].point);
    const Vec3d low = min(a, min(b, c)), high = max(a, max(b, c));
    split.faces_low = min(split.faces_low, low - kFaceMargin);
    split.faces_high = max(split.faces_high, high + kFaceMargin);
    s.faces[split.first_face + split.face_count++] = {
        triangle, a, b, c, low, high, volume6(a, b, c, split.reference), t.home >= 0};
  }
}

/// A way from the reference crosses the parent's surface an even number of times, or not.
bool CutSurface::inside(const Stage& s, const Split& split, Vec3d p) const {
  if (!split.has_surface) return split.is_reference_inside;
  bool is_inside = split.is_reference_inside;
  const Vec3d from = split.reference, low = min(from, p), high = max(from, p);
  if (apart(low, high, split.faces_low, split.faces_high)) return is_inside;
  for (const Face& f : std::span(s.faces).subspan(split.first_face, split.face_count)) {
    if (apart(low, high, f.low - kFaceMargin, f.high + kFaceMargin)) continue;
    const double of_p = volume6(f.a, f.b, f.c, p);
    if ((f.of_reference > 0) == (of_p > 0) || !turns_round(from, p, f.a, f.b, f.c)) continue;
    const Vec3d where = from + f.of_reference / (f.of_reference - of_p) * (p - from);
    if (f.is_wall || leaf(split.regular, where) == split.split.parent) is_inside = !is_inside;
  }
  return is_inside;
}

/// Looked up at five points.
double CutSurface::inside_share(const Stage& s, const Split& split, const Tet& tet) const {
  const Vec3d middle = 0.25 * (tet[0] + tet[1] + tet[2] + tet[3]);
  int count = inside(s, split, middle) ? 1 : 0;
  for (const Vec3d& corner : tet) count += inside(s, split, 0.5 * (middle + corner)) ? 1 : 0;
  return count;
}

double CutSurface::share(const LatticeCutter& cutter, const Stage& s, const Split& split) const {
  std::array<double, 2> sum{};
  for_each_tet(cutter, split.split.parent, [&](const Tet& tet) {
    part(tet, *split.wall, [&](int side, const Tet& piece, double volume) {
      sum[side == 0 ? 0 : 1] += split.has_surface ? volume * inside_share(s, split, piece) / 5 : volume;
    });
  });
  const auto [low, high] = sum;
  return low + high > 0 ? high / (low + high) : -1;
}

void CutSurface::find_share(const LatticeCutter& cutter, Stage& s, std::size_t k) const {
  const Split& split = s.splits[k];
  const double fill = double{cutter.lattice().cube_fill[index(split.split.parent)]},
               least = fill > 0 ? std::min(0.5, kLeastFill / fill) : 0;
  const double found = share(cutter, s, split), own = found < 0 ? 0.5 : found;
  s.found[k] = own;
  s.shares[k] = std::clamp(own, least, 1 - least);
  s.is_sliver[k] = own < least || own > 1 - least ? 1 : 0;
  s.empty_side[k] = found < 0    ? kBothSides
                    : found == 0 ? std::int8_t{1}
                    : found == 1 ? std::int8_t{0}
                                 : kNoSide;
}

const std::vector<double>& CutSurface::cut(const LatticeCutter& cutter, const std::vector<CubeSplit>& stage) {
  Stage& s = stage_;
  s.clear();
  at_surface_.clear();
  make_walls(cutter, stage, s);
  intersect_all(s);
  find_pieces(cutter, s);
  divide_near(cutter, s);
  add_walls(cutter, s);
  drop_empty_parts(cutter, s);
  note_slivers(cutter, s);
  slivers_ += static_cast<Index>(std::count(s.is_sliver.begin(), s.is_sliver.end(), 1));
  return s.shares;
}

}  // namespace tactus::cut
