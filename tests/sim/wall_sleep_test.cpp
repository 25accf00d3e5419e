/// Points of a cut's walls that sleep while the cut gapes.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "tactus/contact/pairs/body_pairs.h"
#include "tactus/geom/lattice/lattice_cut.h"
#include "tactus/geom/mesh/box_surface.h"
#include "tactus/multi_device/device_set.h"
#include "tactus/sim/body/cut_solid.h"
#include "tactus/sim/body/slab_points.h"
#include "tactus/tissue/cut/cut_points.h"
#include "tactus/tissue/embedded_surface.h"

namespace tactus {
namespace {

constexpr float kSpacing_m = 0.02F;
constexpr Vec3i kCubes{8, 4, 4};
std::size_t at(std::int64_t i) { return static_cast<std::size_t>(i); }

/// A block with a plane cut at the height of 2.3 cubes, from its left face to `to_x` cubes. Nothing moves its
/// nodes but the test.
class CutBlock {
 public:
  static constexpr float kHeight = 2.3F;

  explicit CutBlock(float to_x)
      : tip_x_(to_x),
        lattice_(cut_lattice(lattice_from_box({}, kCubes, {.spacing_m = kSpacing_m}),
                             [](Vec3i, int) { return false; }, {.copies = 200, .nodes = 400})),
        surface_(box()),
        cutter_(lattice_, {}, surface_, anchor_vertices(lattice_, surface_),
                {.vertices = 20000, .triangles = 40000}),
        solid_(rest_solid(lattice_, surface_, MeshFill::closed)),
        boundary_(body_boundary(lattice_, surface_, ElementMask(lattice_.cubes.size(), 1))),
        points_(embed_points(lattice_, boundary_.points, boundary_.bearing)) {
    points_.insert(points_.begin() + boundary_.first_count, at(kPointCapacity), EmbeddedPoint{});
    cut::CutPoints cut_points(lattice_, boundary_.points, boundary_.anchors, boundary_.bearing,
                              boundary_.first_count, kPointCapacity);
    CutSolid cut_solid(lattice_, solid_);
    TopologyChange change;
    const auto edge = [](float x) {
      return std::vector<Vec3f>{kSpacing_m * Vec3f{x, kHeight, -1}, kSpacing_m * Vec3f{x, kHeight, 5}};
    };
    const cut::BladeStrip strip{edge(-1), edge(to_x), 0};
    cutter_.cut(strip, lattice_.rest_positions_m(), change);
    change_ =
        cut_solid.update(cutter_, change, cut_points.update(cutter_.lattice(), cutter_.surface(), change));
    for (Index i = 0; i < after().node_count(); ++i)
      is_upper_.push_back(static_cast<float>(after().nodes[at(i)].y) > kHeight);
    for (const TopologyChange::Copy& copy : change.copies)
      for (const Index node : copy.nodes) is_upper_[at(node)] = (copy.copy.corners & kLowCorners) == 0;
  }
  const CubeLattice& after() const { return cutter_.lattice().lattice(); }
  const SolidChange& change() const { return change_; }
  PairedBody described(const ContactNodes& nodes) const {
    return {.lattice = lattice_, .surface = surface_, .points = points_, .nodes = nodes, .cuttable = true};
  }
  /// Where nodes are when what is above the cut rose by that, in spacings: at the left face, and at its end
  /// where it was cut through. All is pressed flat, too.
  std::vector<Vec3f> opened_m(float gap, float flat) const {
    std::vector<Vec3f> x_m = after().rest_positions_m();
    for (std::size_t i = 0; i < x_m.size(); ++i) {
      x_m[i].y *= flat;
      const float share = tip_x_ > kCubes.x ? 1 : std::max(0.F, 1 - x_m[i].x / (kSpacing_m * tip_x_));
      if (is_upper_[i]) x_m[i].y += kSpacing_m * gap * share;
    }
    return x_m;
  }

 private:
  static constexpr Index kPointCapacity = 2000;
  static constexpr unsigned kLowCorners = 0b00110011;  ///< of a cube: those with y = 0
  static TriangleMesh box() {
    const Vec3f half_m = 0.5F * kSpacing_m * vec_cast<float>(kCubes);
    TriangleMesh mesh = box_surface(half_m, kCubes);
    for (Vec3f& p : mesh.positions_m) p += half_m;
    return mesh;
  }
  float tip_x_;
  CubeLattice lattice_;
  TriangleMesh surface_;
  cut::BodyCutter cutter_;
  RestSolid solid_;
  BodyBoundary boundary_;
  std::vector<EmbeddedPoint> points_;
  SolidChange change_;
  std::vector<bool> is_upper_;
};

/// Contact of the block with itself, as its nodes are put from step to step.
class Toucher {
 public:
  Toucher(ExecContext& ctx, const CutBlock& block)
      : ctx_(ctx),
        block_(block),
        x_m_(to_device(ctx, block.opened_m(0, 1))),
        v_m_s_(to_device(ctx, std::vector<Vec3f>(at(x_m_.size())))),
        mass_kg_(to_device(ctx, std::vector<float>(at(x_m_.size()), 1))),
        poses_(to_device(ctx, std::vector<SurfacePoses>(1))),
        pairs_(ctx, std::vector<PairedBody>{
                        block.described({x_m_.view(), v_m_s_.view(), mass_kg_.const_view(), {}})}) {
    pairs_.apply(ctx, 0, block.change());
  }
  /// Points that touch there. @param anew all of them are looked for
  Index touch(const std::vector<Vec3f>& x_m, bool anew) {
    ctx_.upload(x_m, x_m_.view());
    ctx_.fill_bytes(v_m_s_.view(), 0);
    if (anew) pairs_.apply(ctx_, 0, {});
    pairs_.begin_frame(ctx_);
    pairs_.correct(ctx_, poses_.const_view(), {1e-3F});
    pairs_.end_frame(ctx_);
    return to_host(ctx_, pairs_.totals())[0].contacts;
  }

 private:
  ExecContext& ctx_;
  const CutBlock& block_;
  Buffer<Vec3f> x_m_, v_m_s_;
  Buffer<float> mass_kg_;
  Buffer<SurfacePoses> poses_;
  BodyPairs pairs_;
};

/// A cut opens and shuts at random, by up to 0.15 spacings a step, in a body that is cut through or has a
/// slit, as it was or pressed to two thirds of its height. A point that slept is late by a hundredth of a
/// spacing at most: at least those touch that touch where the walls are that much, and a tenth of it for
/// rounding, farther apart.
TEST(WallSleep, NoPointIsLateByMoreThanAHundredth) {
  DeviceSet cpu("cpu");
  ExecContext& ctx = cpu.context(0);
  for (const float to_x : {10.F, 6.F})
    for (const float flat : {1.F, 0.66F}) {
      const CutBlock block(to_x);
      ASSERT_GT(block.change().cubes.size(), 20U);
      Toucher sleeps(ctx, block), anew(ctx, block), later(ctx, block);
      std::mt19937 random(7);
      std::uniform_real_distribution<float> u(-0.15F, 0.15F);
      float gap = 0.5F, to = 1;
      Index most = 0;
      int shut = 0;
      for (int k = 0; k < 800; ++k) {
        gap += 0.7F * std::abs(u(random)) * (to > gap ? 1 : -1) + 0.3F * u(random);
        if (k % 40 == 39) to = to > 0 ? -0.3F : 1.2F;
        gap = std::max(gap, -0.3F);
        const Index now = sleeps.touch(block.opened_m(gap, flat), false),
                    all = anew.touch(block.opened_m(gap, flat), true),
                    sure = later.touch(block.opened_m(gap + 0.011F, flat), true);
        // What is deep in material that is pressed flat may come out again: deeper isn't always more.
        EXPECT_LE(std::min(sure, all), now)
            << "step " << k << ", gap " << gap << ", to " << to_x << ", flat " << flat;
        EXPECT_LE(now, all) << "step " << k << ", gap " << gap;
        most = std::max(most, now);
        shut += now > 0 ? 1 : 0;
      }
      std::printf("to %.0f, flat %.2f: %d of 800 steps touch, at most %d points\n", static_cast<double>(to_x),
                  static_cast<double>(flat), shut, most);
      EXPECT_GT(shut, 50);
      EXPECT_GT(most, 100);
    }
}

}  // namespace
}  // namespace tactus
