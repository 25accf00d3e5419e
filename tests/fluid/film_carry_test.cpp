/// A film that goes from mesh to mesh: its volume to the unit, where it is, and the same bits.
#include "tactus/fluid/film/film_carry.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <random>

#include "support/device_sets.h"
#include "tactus/geom/maths/rotation.h"
#include "tactus/geom/mesh/polygonize.h"
#include "tactus/multi_device/device_set.h"

namespace tactus {
namespace {

constexpr float kRadius_m = 0.04F, kCell_m = 0.005F;
constexpr Index kMost = 20000;

/// A ball, cut out of a lattice that lies elsewhere each time: other vertices, other triangles.
TriangleMesh ball(unsigned seed, Vec3f center_m = {}) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> part(0.F, kCell_m);
  const Vec3f low = center_m - Vec3f{0.06F + part(random), 0.06F + part(random), 0.06F + part(random)};
  return polygonize({low, low + 24 * kCell_m * Vec3f{1, 1, 1}}, 24,
                    [&](Vec3f x) { return length(x - center_m) - kRadius_m; });
}

class Carried {
 public:
  explicit Carried(DeviceSet& devices, Index max_waiting = 4096)
      : ctx_(devices.context(0)),
        film(ctx_, {}, kMost, 2 * kMost, 6 * kMost),
        carry(ctx_, {.max_vertices = kMost,
                     .max_triangles = 2 * kMost,
                     .reach_m = 2 * kCell_m,
                     .max_waiting = max_waiting}),
        x_(ctx_.device(), kMost),
        triangles_(ctx_.device(), 2 * kMost),
        counts_(ctx_.device(), 3) {}
  /// The first mesh, which is linked at once.
  void begin(const TriangleMesh& mesh) {
    show(mesh);
    carry.link(ctx_, view_, counts_.const_view().part(2, 1));
  }
  /// A new one; the film of the last one moved by T.
  void next(const TriangleMesh& mesh, const Rigidd& T = {Mat3d::identity(), {}}) {
    carry.lift(ctx_, film);
    const auto n =
        static_cast<std::size_t>(to_host(ctx_, View<const Index>(carry.points().device_count, 1))[0]);
    std::vector<Vec3f> places = to_host(ctx_, View<const Vec3f>(carry.places_m()));
    std::vector<FilmPoint> points = to_host(ctx_, View<const FilmPoint>(carry.point()));
    for (std::size_t k = 0; k < n; ++k) {
      places[k] = vec_cast<float>(T * vec_cast<double>(places[k]));
      points[k].normal = vec_cast<float>(T.R * vec_cast<double>(points[k].normal));
    }
    ctx_.upload(places, carry.places_m());
    ctx_.upload(points, carry.point());
    ctx_.synchronize();
    show(mesh);
    carry.land(ctx_, film, view_);
  }
  void set(const std::vector<std::int64_t>& volumes) {
    std::vector<std::int64_t> all = volumes;
    all.resize(kMost);
    film.set_volumes(ctx_, all);
  }
  std::vector<std::int64_t> volumes() {
    std::vector<std::int64_t> all = to_host(ctx_, film.volumes());
    all.resize(mesh_.positions_m.size());
    return all;
  }
  std::int64_t units() {
    const std::vector<std::int64_t> all = to_host(ctx_, film.volumes());
    return std::accumulate(all.begin(), all.end(), std::int64_t{0});
  }
  FilmWaiting waiting() { return to_host(ctx_, carry.waiting())[0]; }
  ExecContext& context() { return ctx_; }
  FilmSurface surface() const { return carry.surface(view_, carry.x_m()); }
  /// Centre of all volume, and its root mean square distance from there.
  struct Spread {
    Vec3d center_m{};
    double width_m = 0;
  };
  Spread spread() {
    Spread all;
    double sum = 0, square = 0;
    const std::vector<std::int64_t> v = volumes();
    for (std::size_t k = 0; k < v.size(); ++k) {
      const Vec3d x = vec_cast<double>(mesh_.positions_m[k]);
      sum += static_cast<double>(v[k]);
      all.center_m += static_cast<double>(v[k]) * x;
      square += static_cast<double>(v[k]) * dot(x, x);
    }
    all.center_m = (1 / sum) * all.center_m;
    all.width_m = std::sqrt(square / sum - dot(all.center_m, all.center_m));
    return all;
  }
  const TriangleMesh& mesh() const { return mesh_; }

 private:
  void show(const TriangleMesh& mesh) {
    mesh_ = mesh;
    std::vector<Vec3i> t;
    for (const auto& c : mesh.triangles) t.push_back({c[0], c[1], c[2]});
    const auto n = static_cast<Index>(mesh.positions_m.size()), m = static_cast<Index>(t.size());
    ctx_.upload(mesh.positions_m, x_.view().part(0, n));
    ctx_.upload(t, triangles_.view().part(0, m));
    const std::vector<Index> counts{n, m, 1};
    ctx_.upload(counts, counts_.view());
    ctx_.synchronize();
    view_ = {x_.const_view(),
             triangles_.const_view(),
             {counts_.const_view().part(0, 1), kMost},
             {counts_.const_view().part(1, 1), 2 * kMost},
             {}};
  }
  ExecContext& ctx_;

 public:
  Film film;
  FilmCarry carry;

 private:
  Buffer<Vec3f> x_;
  Buffer<Vec3i> triangles_;
  Buffer<Index> counts_;
  MeshView view_;
  TriangleMesh mesh_;
};

/// So thick where wet(x).
template <class F>
std::vector<std::int64_t> film_where(const TriangleMesh& mesh, float height_m, const F& wet) {
  std::vector<double> third_m2(mesh.positions_m.size());
  for (const auto& t : mesh.triangles) {
    const auto x = [&](std::size_t k) { return mesh.positions_m[static_cast<std::size_t>(t.at(k))]; };
    for (std::size_t k = 0; k < 3; ++k)
      third_m2[static_cast<std::size_t>(t.at(k))] += double{length(cross(x(1) - x(0), x(2) - x(0)))} / 6;
  }
  std::vector<std::int64_t> all;
  for (std::size_t v = 0; v < third_m2.size(); ++v)
    all.push_back(wet(mesh.positions_m[v])
                      ? std::llround(third_m2[v] * double{height_m} * double{kFilmUnits_1_m3})
                      : 0);
  return all;
}

class FilmCarriedOn : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { TACTUS_SKIP_WITHOUT_DEVICES(GetParam()); }
};
TACTUS_INSTANTIATE_DEVICES(FilmCarriedOn);

/// One side of a ball is wet. The ball turns by 90 degrees about an axis and moves by 5 cells, in 30 frames
/// with a mesh of its own each. The wet side turns with it: its edge is where it would be within a cell, but
/// for 2 % of the volume; and no volume is lost, to the unit. The film's own flow is left out, so nothing
/// closes holes, where no share of a sixteenth landed on a vertex: with 3 shares a vertex, as many triangles
/// come to one that three get, some e^-3 = 5 %, and more where vertices are crowded: 10 % of the area.
TEST_P(FilmCarriedOn, TurnsAndMovesWithABall) {
  DeviceSet devices(GetParam(), 5);
  Carried all(devices);
  const TriangleMesh first = ball(1);
  all.begin(first);
  all.set(film_where(first, 2e-4F, [](Vec3f x) { return x.x > 0; }));
  const std::int64_t units = all.units();
  constexpr int kFrames = 30;
  const Vec3d axis = normalized(Vec3d{0.1, 1, 0.2});
  Mat3d turned = Mat3d::identity();
  Vec3d center{};
  for (int k = 1; k <= kFrames; ++k) {
    const Mat3d R = rotation_from_vector(M_PI / 2 / kFrames * axis);
    const Vec3d to = 5 * double{kCell_m} / kFrames * static_cast<double>(k) * normalized(Vec3d{3, 1, 2});
    all.next(ball(static_cast<unsigned>(k) + 1, vec_cast<float>(to)), {R, to - R * center});
    center = to;
    turned = R * turned;
    ASSERT_EQ(all.units(), units) << k;
  }
  const Vec3d side = turned * Vec3d{1, 0, 0};
  double outside = 0, missing_m2 = 0, inside_m2 = 0;
  const std::vector<std::int64_t> v = all.volumes();
  const std::vector<std::int64_t> third = film_where(all.mesh(), 1, [](Vec3f) { return true; });
  for (std::size_t k = 0; k < v.size(); ++k) {
    const double beyond_m = dot(vec_cast<double>(all.mesh().positions_m[k]) - center, side);
    if (beyond_m < -double{kCell_m}) outside += static_cast<double>(v[k]);
    if (beyond_m > double{kCell_m}) inside_m2 += static_cast<double>(third[k]);
    if (beyond_m > double{kCell_m} && v[k] == 0) missing_m2 += static_cast<double>(third[k]);
  }
  std::printf("%s: %.2f %% more than a cell outside; %.2f %% of the inside dry\n", GetParam().c_str(),
              100 * outside / static_cast<double>(units), 100 * missing_m2 / inside_m2);
  EXPECT_LT(outside, 0.02 * static_cast<double>(units));
  EXPECT_LT(missing_m2, 0.1 * inside_m2);
  EXPECT_EQ(all.waiting().film, 0U);
}

/// A drop at one vertex. Nothing drifts: after 60 meshes of other lattices, while the ball turns by 60
/// degrees, its centroid is where the place turned to, within a tenth of a cell of 40 mm times the ways'
/// mean. It is no wider than two cells.
TEST_P(FilmCarriedOn, ADropStaysWhereItIs) {
  DeviceSet devices(GetParam(), 5);
  Carried all(devices);
  const TriangleMesh first = ball(1);
  all.begin(first);
  std::vector<std::int64_t> v(first.positions_m.size());
  const auto top =
      static_cast<std::size_t>(std::max_element(first.positions_m.begin(), first.positions_m.end(),
                                                [](Vec3f a, Vec3f b) { return a.x < b.x; }) -
                               first.positions_m.begin());
  v[top] = std::int64_t{1} << 40;
  all.set(v);
  Vec3d at = vec_cast<double>(first.positions_m[top]);
  for (int k = 1; k <= 60; ++k) {
    const Mat3d R = rotation_from_vector({0, M_PI / 180, 0});
    all.next(ball(static_cast<unsigned>(k) + 1), {R, {}});
    at = R * at;
  }
  const Carried::Spread is = all.spread();
  std::printf("%s: %.2f cells off, %.2f cells wide\n", GetParam().c_str(),
              length(is.center_m - at) / double{kCell_m}, is.width_m / double{kCell_m});
  EXPECT_EQ(all.units(), std::int64_t{1} << 40);
  EXPECT_LT(length(is.center_m - at), 0.5 * double{kCell_m});
  EXPECT_LT(is.width_m, 2 * double{kCell_m});
}

/// The same mesh again and again changes nothing, to the unit.
TEST_P(FilmCarriedOn, StaysOnTheSameMesh) {
  DeviceSet devices(GetParam(), 5);
  Carried all(devices);
  const TriangleMesh first = ball(1);
  all.begin(first);
  all.set(film_where(first, 2e-4F, [](Vec3f x) { return x.y > 0.01F; }));
  const std::vector<std::int64_t> before = all.volumes();
  for (int k = 0; k < 5; ++k) all.next(first);
  EXPECT_EQ(all.volumes(), before);
}

/// A ball that isn't there any more: its film waits, in fewer places than there were vertices. It is there
/// again when the ball is, and none goes to a surface that faces the other way.
TEST_P(FilmCarriedOn, WaitsForASurface) {
  DeviceSet devices(GetParam(), 5);
  Carried all(devices, 100);
  const TriangleMesh first = ball(1);
  all.begin(first);
  all.set(film_where(first, 2e-4F, [](Vec3f x) { return x.y > 0; }));
  const std::int64_t units = all.units();
  all.next(ball(2, {0.2F, 0, 0}));
  EXPECT_EQ(all.units(), 0);
  EXPECT_EQ(all.waiting().film, static_cast<std::uint64_t>(units));
  // Below where the film waits, another ball is upside down: its nearest vertices face away.
  all.next(ball(3, {0, 2 * kRadius_m, 0}));
  EXPECT_EQ(static_cast<std::int64_t>(all.waiting().film) + all.units(), units);
  all.next({});
  EXPECT_EQ(all.units(), 0);
  all.next(ball(4));
  EXPECT_EQ(all.waiting().film, 0U);
  EXPECT_EQ(all.units(), units);
}

/// In the frames of a scene the film flows between two meshes; gravity pulls it down the ball.
std::vector<std::int64_t> flows(const std::string& set, unsigned seed) {
  DeviceSet devices(set, seed);
  Carried all(devices);
  const TriangleMesh first = ball(1);
  all.begin(first);
  all.set(film_where(first, 4e-4F, [](Vec3f x) { return x.y > 0.02F; }));
  const std::int64_t units = all.units();
  const FrameParams params{.dt_s = 1.F / 60, .gravity_m_s2 = {0, -9.81F, 0}, .substeps = 1};
  const Buffer<FrameParams> frame = to_device(all.context(), std::vector<FrameParams>{params});
  for (int k = 1; k <= 8; ++k) {
    all.film.step(all.context(), all.surface(), frame.const_view());
    all.next(ball(static_cast<unsigned>(k) + 1), {rotation_from_vector({0.02, 0, 0.01}), {}});
    EXPECT_EQ(all.units() + static_cast<std::int64_t>(all.waiting().film), units);
  }
  return all.volumes();
}

TEST_P(FilmCarriedOn, HasTheSameBits) {
  const std::vector<std::int64_t> one = flows("cpu", 1);
  for (const unsigned seed : {1U, 2U}) EXPECT_EQ(flows(GetParam(), seed), one);
}

}  // namespace
}  // namespace tactus
