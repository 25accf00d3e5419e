#pragma once
/// A film of liquid on a surface of triangles: one height per vertex, which is a volume over an area.
///
/// Lubrication (Oron, Davis, Bankoff 1997): q = h^3 / (3 mu) (rho g_t - grad p), with
/// p = rho g_n h - sigma laplacian(h). Cells are the vertices' shares of their triangles, bounded by segments
/// from the middle of an edge to the middle of the triangle. Within a triangle, p is linear, so the flux
/// through a segment is one number, and what a vertex gives the other one takes. Volumes and fluxes are
/// integers: their sum is exact, and no order of sums matters.
///
/// Steps are explicit. The mobility h^3 / (3 mu) is held below the value at which a pass would be unstable.
/// So a film at rest is the right one, and thick liquid on fine triangles moves slower than it should.
#include "tactus/base/vec.h"
#include "tactus/compute/atomic.h"
#include "tactus/compute/fold.h"
#include "tactus/fluid/film/film_surface.h"
#include "tactus/frame/frame_params.h"
#include "tactus/geom/arrays/index_lists.h"

namespace tactus {

/// Volumes are multiples of 2^-56 m^3, 1.4e-8 mm^3.
inline constexpr float kFilmUnits_1_m3 = 72057594037927936.F;
inline constexpr float kFilmUnit_m3 = 1.F / kFilmUnits_1_m3;

struct FilmLaw {
  float density_kg_m3 = 0;
  float mobility_1_Pa_s = 0;  ///< 1 / (3 mu)
  float tension_N_m = 0;
  /// sigma (1 - cos(angle)): the force per length that holds an edge which is about to advance.
  float hold_N_m = 0;
  float finest_1_m2 = 0;  ///< largest eigenvalue of the Laplacian that is resolved
};

/// A triangle in its plane: corner 0 at (0, 0), 1 at (bx, 0), 2 at (cx, cy).
struct FilmTriangle {
  float bx = 0, cx = 0, cy = 0;  ///< cy 0: it has no area and nothing flows there
  float bx_1 = 0, cy_1 = 0;      ///< 1 / bx, 1 / cy
  float gx = 0, gy = 0, gn = 0;  ///< gravity along the plane, and into it [m/s^2]
  /// Largest eigenvalue of its Laplacian [1/m^2], cut at the finest that is resolved, and the factor that
  /// cuts it. That factor makes slivers stiffer to flow through, and their surfaces softer.
  float eigen_1_m2 = 0, factor = 0;
  /// A mobility m in a step of dt is stable while m dt times this is below 1.
  float stiffness = 0;
  Index is_closed = 0;  ///< 1: at the rim of those that a frame looks at; nothing flows there

  struct Slope {
    float x, y;
  };
  TACTUS_HD Slope gradient(float a, float b, float c) const {
    const float x = (b - a) * bx_1;
    return {x, (c - a - cx * x) * cy_1};
  }
  TACTUS_HD float area_m2() const { return 0.5F * bx * cy; }
};

/// A triangle as one of its corners sees it.
struct FilmSpoke {
  Index left = 0, right = 0;        ///< its other corners
  float to_left = 0, to_right = 0;  ///< weights of differences in the Laplacian, times the corner's area
  Index give = 0, take = 0;         ///< flows that leave the corner there and that come
};

/// What flows in a triangle of the region, as fields of all of them one after the other: a core of a CPU
/// works on eight side by side.
struct FilmFlowFields {
  enum Field : Index { kBx, kCx, kCy, kBx_1, kCy_1, kGx, kGy, kGn, kFactor, kStiffness, kFields };
  View<float> values;   ///< kFactor 0: it is closed
  View<Index> corners;  ///< three fields, too
  TACTUS_HD float& at(Field f, Index n) const { return values[f * (values.size() / kFields) + n]; }
  TACTUS_HD Index& corner(int k, Index n) const { return corners[k * (corners.size() / 3) + n]; }
  TACTUS_HD void set(Index n, const FilmTriangle& t, const Index (&of)[3]) const {
    at(kBx, n) = t.bx;
    at(kCx, n) = t.cx;
    at(kCy, n) = t.cy;
    at(kBx_1, n) = t.bx_1;
    at(kCy_1, n) = t.cy_1;
    at(kGx, n) = t.gx;
    at(kGy, n) = t.gy;
    at(kGn, n) = t.gn;
    at(kFactor, n) = t.is_closed != 0 ? 0.F : t.factor;
    at(kStiffness, n) = t.stiffness;
    for (int k = 0; k < 3; ++k) corner(k, n) = of[k];
  }
  TACTUS_HD FilmTriangle get(Index n) const {
    FilmTriangle t;
    t.bx = at(kBx, n);
    t.cx = at(kCx, n);
    t.cy = at(kCy, n);
    t.bx_1 = at(kBx_1, n);
    t.cy_1 = at(kCy_1, n);
    t.gx = at(kGx, n);
    t.gy = at(kGy, n);
    t.gn = at(kGn, n);
    t.factor = at(kFactor, n);
    t.stiffness = at(kStiffness, n);
    return t;
  }
};

/// How a step is divided.
struct FilmPasses {
  Index passes = 0;
  float dt_s = 0;        ///< of a pass
  float wanted_1_s = 0;  ///< passes per time that would slow nothing
};

/// The part of a surface that a frame looks at: wet vertices, some rings more, and their triangles.
struct FilmRegion {
  Count vertices = 0, triangles = 0;
  View<const Index> vertex, triangle;  ///< in any order
};

/// Seconds of a frame; 0 while bodies settle.
TACTUS_HD inline float film_frame_s(const FrameParams& f) {
  return f.settles != 0 ? 0.F : f.dt_s * static_cast<float>(f.substeps);
}

/// Thread: triangle of the region. Its shape now.
struct MeasureFilmTriangles {
  FilmLaw law;
  FilmSurface surface;
  View<const Index> region;
  View<const FrameParams> frame;
  View<const Index> mark;
  View<FilmTriangle> triangles;  ///< by their places in the region
  View<Index> place;             ///< of each
  TACTUS_HD void operator()(Index i) const {
    const Index t = region[i], a = surface.corners[3 * t], b = surface.corners[3 * t + 1],
                c = surface.corners[3 * t + 2];
    const Vec3f e = surface.x_m[b] - surface.x_m[a], d = surface.x_m[c] - surface.x_m[a];
    FilmTriangle out;
    out.is_closed = 1;
    place[t] = i;
    out.bx = length(e);
    const Vec3f e1 = normalized(e), across = cross(e1, d), n = normalized(across), g = frame[0].gravity_m_s2;
    out.cy = length(across);
    if (!(out.bx > 1e-9F && out.cy > 1e-9F)) {
      out.bx = out.cy = 0;
      triangles[i] = out;
      return;
    }
    out.cx = dot(d, e1);
    out.bx_1 = 1.F / out.bx;
    out.cy_1 = 1.F / out.cy;
    out.gx = dot(g, e1);
    out.gy = dot(g, cross(n, e1));
    out.gn = -dot(g, n);
    out.is_closed = mark[a] == 0 || mark[b] == 0 || mark[c] == 0 ? 1 : 0;
    // The two eigenvalues of a triangle's stiffness have the sum s = sum of l^2 / (4 area) and the product
    // 3/4; each corner bears a third of the area.
    const float c2 = sqr(out.cx) + sqr(out.cy), b2 = sqr(out.bx), a2 = sqr(out.cx - out.bx) + sqr(out.cy);
    const float s = (a2 + b2 + c2) / (4 * out.area_m2());
    const float eigen = 3 * (0.5F * (s + sqrt(max(sqr(s) - 3.F, 0.F)))) / out.area_m2();
    out.eigen_1_m2 = min(eigen, law.finest_1_m2);
    out.factor = out.eigen_1_m2 / eigen;
    triangles[i] = out;
  }
};

/// Thread: vertex of the region. Its share of the surface, the height of its volume there, and how it sees
/// its triangles.
struct MeasureFilmVertices {
  FilmSurface surface;
  View<const Index> region;
  View<const FilmTriangle> triangles;
  View<const Index> place;
  View<const std::int64_t> volume;
  View<float> area_m2, gravity_m_s2, eigen_1_m2, height_m;
  View<FilmSpoke> spokes;
  TACTUS_HD void operator()(Index i) const {
    const Index v = region[i];
    float area = 0, into = 0, eigen = 0;
    for (Index e = surface.lists[v].begin; e < surface.lists[v].end; ++e) {
      const Index triangle = surface.incident[e];
      const FilmTriangle t = triangles[place[triangle]];
      const float share = (1.F / 3) * t.area_m2();
      area += share;
      into += share * t.gn;
      eigen = max(eigen, t.eigen_1_m2);
      spokes[e] = spoke(t, triangle, v);
    }
    area_m2[v] = area;
    gravity_m_s2[v] = area > 0 ? into / area : 0.F;
    eigen_1_m2[v] = eigen;
    height_m[v] = area > 0 ? kFilmUnit_m3 * static_cast<float>(volume[v]) / area : 0.F;
  }

 private:
  TACTUS_HD FilmSpoke spoke(const FilmTriangle& t, Index i, Index v) const {
    const Index corner[3] = {surface.corners[3 * i], surface.corners[3 * i + 1], surface.corners[3 * i + 2]};
    const int k = corner[0] == v ? 0 : corner[1] == v ? 1 : 2, left = (k + 1) % 3, right = (k + 2) % 3;
    // The weight of an edge is half the cotangent of the angle at the third corner.
    const float cot[3] = {t.cx * t.cy_1, (t.bx - t.cx) * t.cy_1,
                          (sqr(t.cy) - t.cx * (t.bx - t.cx)) * t.bx_1 * t.cy_1};
    return {corner[left],
            corner[right],
            0.5F * t.factor * cot[right],
            0.5F * t.factor * cot[left],
            k * triangles.size() + place[i],
            right * triangles.size() + place[i]};
  }
};

/// Block: kThreads triangles of the region. The stiffness of each, and the largest number of passes per time
/// that one asks for. A film at rest takes one a frame, so that it can be disturbed: more would change
/// nothing.
struct FindFilmRates {
  static constexpr int kThreads = 256;
  static constexpr int kGrain = 8;
  /// By so much of itself a volume at rest changes in the last pass: sixteen passes a frame are 1 % a second.
  static constexpr float kStill = 1e-5F;
  FilmLaw law;
  FilmSurface surface;
  FilmRegion region;
  View<const float> eigen_1_m2, height_m;
  View<const std::int64_t> volume;
  View<const Index> change;  ///< of volumes, in the last pass
  View<const FilmTriangle> triangles;
  FilmFlowFields fields;
  View<float> rate_1_s;  ///< one per block
  struct Shared {
    float rate[kThreads];
  };
  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    const Index begin = b.index() * kThreads, n = region.triangles.get();
    if (begin >= n) return;
    b.for_each_thread([&](int t) { s.rate[t] = begin + t < n ? rate(begin + t) : 0.F; });
    fold<kThreads>(b, kThreads, [&](int t, int other) { s.rate[t] = max(s.rate[t], s.rate[other]); });
    b.on_one_thread([&] { rate_1_s[b.index()] = s.rate[0]; });
  }

 private:
  TACTUS_HD float rate(Index n) const {
    const Index i = region.triangle[n],
                corner[3] = {surface.corners[3 * i], surface.corners[3 * i + 1], surface.corners[3 * i + 2]};
    FilmTriangle t = triangles[n];
    if (t.is_closed != 0) {  // corners outside of the region have no measures
      fields.set(n, t, corner);
      return 0;
    }
    float eigen = 0, h = 0;
    bool is_still = true;
    for (const Index v : corner) {
      eigen = max(eigen, eigen_1_m2[v]);
      h = max(h, height_m[v]);
      is_still &= abs(static_cast<float>(change[v])) <= kStill * static_cast<float>(volume[v]);
    }
    t.stiffness = t.eigen_1_m2 * (law.density_kg_m3 * abs(t.gn) + law.tension_N_m * eigen);
    fields.set(n, t, corner);
    // In a pass, liquid flows a quarter of a triangle's height at most: a corner then has what it gives.
    const float speed =
        law.density_kg_m3 * sqrt(sqr(t.gx) + sqr(t.gy)) * law.mobility_1_Pa_s * sqr(h) * sqrt(t.eigen_1_m2);
    const float wanted = max(law.mobility_1_Pa_s * h * sqr(h) * t.stiffness, 2 * speed);
    constexpr float kLeast_1_s = 1;  // more than none
    return is_still ? min(wanted, kLeast_1_s) : wanted;
  }
};

/// One block. Divides a frame into passes.
struct PlanFilmPasses {
  static constexpr int kThreads = 256;
  FilmRegion region;
  View<const FrameParams> frame;
  View<const float> rate_1_s;
  View<FilmPasses> passes;
  View<Index> vertex_count, triangle_count;  ///< (most passes) of each pass
  struct Shared {
    float rate[kThreads];
    Index passes;
  };
  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    const Index vertices = region.vertices.get(), triangles = region.triangles.get(),
                blocks = ceil_div(triangles, FindFilmRates::kThreads);
    b.for_each_thread([&](int t) {
      float most = 0;
      for (Index i = t; i < blocks; i += kThreads) most = max(most, rate_1_s[i]);
      s.rate[t] = most;
    });
    fold<kThreads>(b, kThreads, [&](int t, int other) { s.rate[t] = max(s.rate[t], s.rate[other]); });
    b.on_one_thread([&] {
      const float dt_s = film_frame_s(frame[0]);
      const float wanted = clamp(s.rate[0] * dt_s, 0.F, static_cast<float>(vertex_count.size()));
      s.passes = wanted > 0 ? min(floor_to_int(wanted) + 1, vertex_count.size()) : 0;
      passes[0] = {s.passes, s.passes > 0 ? dt_s / static_cast<float>(s.passes) : 0.F, s.rate[0]};
    });
    b.for_range(vertex_count.size(), [&](int k) {
      vertex_count[k] = k < s.passes ? vertices : 0;
      triangle_count[k] = k < s.passes ? triangles : 0;
    });
  }
};

/// Thread: vertex of the region. The pressure in its film.
struct PressFilm {
  FilmLaw law;
  View<const Index> region;
  View<const IndexRange> lists;
  View<const FilmSpoke> spokes;
  View<const float> area_m2, gravity_m_s2, height_m;
  View<float> pressure_Pa;
  TACTUS_HD void operator()(Index i) const {
    const Index v = region[i];
    const float h = height_m[v], area = area_m2[v];
    float bend = 0;
    for (Index e = lists[v].begin; e < lists[v].end; ++e) {
      const FilmSpoke s = spokes[e];
      bend += s.to_left * (height_m[s.left] - h) + s.to_right * (height_m[s.right] - h);
    }
    pressure_Pa[v] =
        law.density_kg_m3 * gravity_m_s2[v] * h - (area > 0 ? law.tension_N_m * (bend / area) : 0.F);
  }
};

/// Thread: triangle of the region. The volumes that flow from corner 0 to 1, from 1 to 2 and from 2 to 0.
/// Without a branch, so that a core of a CPU works on eight at once.
struct FlowFilm {
  static constexpr int kGrain = 1024;
  FilmLaw law;
  FilmFlowFields fields;
  View<const FilmPasses> passes;
  View<const float> height_m, pressure_Pa;
  View<Index> flow;  ///< three fields
  float dt_s = 0;
  TACTUS_HD void load() { dt_s = passes[0].dt_s; }
  TACTUS_HD TACTUS_ALWAYS_INLINE void operator()(Index n) const {
    const Index a = fields.corner(0, n), b = fields.corner(1, n), c = fields.corner(2, n),
                many = flow.size() / 3;
    const float ha = height_m[a], hb = height_m[b], hc = height_m[c];
    const FilmTriangle t = fields.get(n);
    const FilmTriangle::Slope p = t.gradient(pressure_Pa[a], pressure_Pa[b], pressure_Pa[c]);
    const FilmTriangle::Slope h = t.gradient(ha, hb, hc);
    const Drive drive{law.density_kg_m3 * t.gx - p.x, law.density_kg_m3 * t.gy - p.y,
                      0.5F * law.tension_N_m * (sqr(h.x) + sqr(h.y)),
                      t.stiffness > 0 ? 1.F / (dt_s * t.stiffness) : 1e30F};
    const float bx = t.bx, cx = t.cx, cy = t.cy;
    flow[n] = through(t, drive, {bx, 0}, {(1.F / 3) * cy, (1.F / 3) * (0.5F * bx - cx)}, ha, hb);
    flow[many + n] = through(t, drive, {cx - bx, cy}, {(-1.F / 6) * cy, (1.F / 6) * (bx + cx)}, hb, hc);
    flow[2 * many + n] = through(t, drive, {-cx, -cy}, {(-1.F / 6) * cy, (1.F / 6) * (cx - 2 * bx)}, hc, ha);
  }

 private:
  struct Drive {
    float x, y;   ///< force per volume
    float steep;  ///< sigma / 2 (grad h)^2
    float most;   ///< mobility that is stable
  };
  /// @param along from one corner to the other @param normal of the segment between, times its length
  TACTUS_HD TACTUS_ALWAYS_INLINE Index through(const FilmTriangle& t, const Drive& d,
                                               FilmTriangle::Slope along, FilmTriangle::Slope normal,
                                               float from_m, float to_m) const {
    const float push = d.x * normal.x + d.y * normal.y, sign = push > 0 ? 1.F : -1.F;
    const float h = push > 0 ? from_m : to_m, other = push > 0 ? to_m : from_m;
    // An edge is held until what presses on it is stronger. Along a line to it, through a film at rest,
    // sigma / 2 (dh/dx)^2 + rho g_n h^2 / 2 + (weight that the slope bears) = sigma (1 - cos(angle)) at the
    // angle at which it advances: the first term alone near the edge, the second far from it. So triangles
    // may be smaller or larger than the edge's curve.
    const float fall = max(sign * (t.gx * along.x + t.gy * along.y), 0.F);
    const float press = d.steep + 0.5F * law.density_kg_m3 * h * (max(t.gn, 0.F) * h + fall);
    const float held = other == 0 ? law.hold_N_m : 0.F;
    const float mobility = t.factor * min(law.mobility_1_Pa_s * h * sqr(h), d.most);
    // A corner has two such segments in a triangle, and a third of its area.
    const float most_m3 = (0.49F / 3) * h * t.area_m2();
    const float units = min(min(mobility * abs(push) * dt_s, most_m3) * kFilmUnits_1_m3, 1e9F);
    const bool flows = (h > 0) & (press >= held) & (t.factor > 0);
    return static_cast<Index>(flows ? sign * units : 0.F);
  }
};

/// Thread: vertex of the region. Takes what flows to it.
struct GatherFilm {
  View<const Index> region;
  View<const IndexRange> lists;
  View<const FilmSpoke> spokes;
  View<const Index> flow;
  View<const float> area_m2;
  View<std::int64_t> volume;
  View<Index> change;
  View<float> height_m;
  TACTUS_HD void operator()(Index i) const {
    const Index v = region[i];
    const std::int64_t before = volume[v];
    std::int64_t sum = before;
    for (Index e = lists[v].begin; e < lists[v].end; ++e)
      sum += std::int64_t{flow[spokes[e].take]} - flow[spokes[e].give];
    volume[v] = sum;
    constexpr std::int64_t kMost = 1 << 30;
    change[v] = static_cast<Index>(clamp(sum - before, -kMost, kMost));
    const float area = area_m2[v];
    height_m[v] = area > 0 ? kFilmUnit_m3 * static_cast<float>(sum) / area : 0.F;
  }
};

/// Block: kThreads vertices of the region. What dries stays where it is.
struct DryFilm {
  static constexpr int kThreads = 256;
  static constexpr int kGrain = 8;
  float drying_m_s;
  View<const FrameParams> frame;
  FilmRegion region;
  View<const float> area_m2;
  View<std::int64_t> volume, stain;
  View<float> height_m;
  View<std::uint64_t> dried;  ///< (1) all that ever did: a sum of integers
  struct Shared {
    std::int64_t units[kThreads];
  };
  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    const Index begin = b.index() * kThreads, n = region.vertices.get();
    if (begin >= n) return;
    b.for_each_thread([&](int t) { s.units[t] = begin + t < n ? dry(region.vertex[begin + t]) : 0; });
    fold<kThreads>(b, kThreads, [&](int t, int other) { s.units[t] += s.units[other]; });
    b.on_one_thread([&] {
      if (s.units[0] > 0) atomic_add(dried[0], static_cast<std::uint64_t>(s.units[0]));
    });
  }

 private:
  TACTUS_HD std::int64_t dry(Index v) const {
    const float area = area_m2[v], most = drying_m_s * film_frame_s(frame[0]) * area * kFilmUnits_1_m3;
    const std::int64_t dries = min(volume[v], static_cast<std::int64_t>(min(most, 1e15F)));
    if (dries == 0) return 0;
    volume[v] -= dries;
    stain[v] += dries;
    height_m[v] = area > 0 ? kFilmUnit_m3 * static_cast<float>(volume[v]) / area : 0.F;
    return dries;
  }
};

/// Sums over a film, in units of kFilmUnit_m3.
struct FilmSums {
  std::uint64_t film = 0, stain = 0;
  std::uint64_t wet = 0;  ///< vertices
};

/// Block: kThreads vertices of a list that has all wet ones. Sums of integers: in any order the same.
struct SumFilm {
  static constexpr int kThreads = 256;
  static constexpr int kGrain = 8;
  Count vertices;
  View<const Index> list;
  View<const std::int64_t> volume;
  View<const std::uint64_t> dried;
  View<FilmSums> sums;  ///< (1) emptied before
  struct Shared {
    std::uint64_t film[kThreads], wet[kThreads];
  };
  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    const Index begin = b.index() * kThreads, n = vertices.get();
    b.on_one_thread([&] {
      if (begin == 0) sums[0].stain = dried[0];
    });
    if (begin >= n) return;
    b.for_each_thread([&](int t) {
      const std::int64_t units = begin + t < n ? volume[list[begin + t]] : 0;
      s.film[t] = static_cast<std::uint64_t>(units);
      s.wet[t] = units > 0 ? 1 : 0;
    });
    fold<kThreads>(b, kThreads, [&](int t, int other) {
      s.film[t] += s.film[other];
      s.wet[t] += s.wet[other];
    });
    b.on_one_thread([&] {
      if (s.wet[0] == 0) return;
      atomic_add(sums[0].film, s.film[0]);
      atomic_add(sums[0].wet, s.wet[0]);
    });
  }
};

}  // namespace tactus
