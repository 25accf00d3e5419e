#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "tactus/base/error.h"
#include "tactus/geom/rasterize.h"
#include "tactus/geom/symmetric_eigen.h"
#include "tactus/reconstruct/components.h"
#include "tactus/reconstruct/surface_texture.h"
#include "tactus/reconstruct/velocity.h"
#include "tactus/rig/figure_tracer.h"

namespace tactus {
namespace {

constexpr Box3f kCube{{-0.5F, 0, -0.5F}, {0.5F, 1, 0.5F}};

/// A box of 2 triangles a side.
TriangleMesh box(Vec3f center, Vec3f half) {
  TriangleMesh m;
  for (int i = 0; i < 8; ++i) {
    m.positions_m.push_back(center + Vec3f{(i & 1) != 0 ? half.x : -half.x, (i & 2) != 0 ? half.y : -half.y,
                                           (i & 4) != 0 ? half.z : -half.z});
  }
  m.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                 {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return m;
}
void append(TriangleMesh& to, const TriangleMesh& from) {
  const auto base = static_cast<Index>(to.positions_m.size());
  to.positions_m.insert(to.positions_m.end(), from.positions_m.begin(), from.positions_m.end());
  for (const auto& t : from.triangles) to.triangles.push_back({t[0] + base, t[1] + base, t[2] + base});
}
TriangleMesh moved(TriangleMesh mesh, const Rigidf& T) {
  for (Vec3f& p : mesh.positions_m) p = T * p;
  return mesh;
}

TEST(Components, OfBoxesHaveTheirMoments) {
  const Mat3f turn = rotation_matrix(axis_angle(normalized(Vec3f{1, 2, 2}), 0.7F));
  TriangleMesh mesh = moved(box({}, {0.05F, 0.1F, 0.2F}), {turn, {1, 2, 3}});
  append(mesh, box({-1, 0, 0}, {0.3F, 0.3F, 0.3F}));
  mesh.positions_m.push_back({9, 9, 9});  // in no triangle
  const MeshComponents c = find_components(mesh);
  ASSERT_EQ(c.pieces.size(), 2U);
  EXPECT_EQ(c.of_vertex.back(), -1);
  EXPECT_EQ(c.of_vertex.front(), 1);
  // Float32 positions: 1e-7 of 3 m over 5 cm, so 1e-5 is safe for ratios, squares of it for lengths.
  EXPECT_NEAR(c.pieces[0].volume_m3, 0.216, 1e-6);
  const MeshComponent& p = c.pieces[1];
  EXPECT_EQ(p.vertices, 8);
  EXPECT_EQ(p.triangles, 12);
  EXPECT_NEAR(p.volume_m3, 0.1 * 0.2 * 0.4, 1e-7);
  EXPECT_NEAR(p.area_m2, 2 * (0.1 * 0.2 + 0.2 * 0.4 + 0.4 * 0.1), 1e-6);
  EXPECT_LT(length(p.centroid_m - Vec3d{1, 2, 3}), 1e-6);
  for (int i = 0; i < 3; ++i) {
    const double side = i == 0 ? 0.4 : (i == 1 ? 0.2 : 0.1);
    EXPECT_NEAR(p.extent_m[i], side / std::sqrt(12.0), 1e-5);  // standard deviation of a uniform segment
    EXPECT_NEAR(std::abs(dot(p.axes.row[i], vec_cast<double>(turn.column(2 - i)))), 1, 1e-5);
  }
  EXPECT_NEAR(determinant(p.axes), 1, 1e-9);
}

TEST(Components, AnEmptyMeshHasNoneAndABadOneIsRefused) {
  EXPECT_TRUE(find_components({}).pieces.empty());
  TriangleMesh bad = box({}, {1, 1, 1});
  bad.triangles.push_back({0, 1, 8});
  EXPECT_THROW(find_components(bad), Error);
}

TEST(Components, LabelsStayWithTheirPieces) {
  ComponentTracker tracker;
  std::vector<int> labels;
  for (int frame = 0; frame < 20; ++frame) {
    // Two boxes pass each other; their sizes, and so their order in the list, swap on the way. A third one is
    // away for three frames.
    const float t = 0.05F * static_cast<float>(frame), grow = 0.004F * static_cast<float>(frame - 10);
    TriangleMesh mesh = box({-0.5F + t, 0, 0}, {0.1F + grow, 0.1F, 0.1F});
    append(mesh, box({0.5F - t, 0.5F, 0}, {0.1F - grow, 0.1F, 0.1F}));
    if (frame < 8 || frame > 10) append(mesh, box({0, 0, 2}, {0.05F, 0.05F, 0.05F}));
    MeshComponents c = find_components(mesh);
    tracker.update(c);
    const auto label_of = [&](std::size_t box_number) {
      return c.pieces[static_cast<std::size_t>(c.of_vertex[8 * box_number])].label;
    };
    if (frame == 0) labels = {label_of(0), label_of(1), label_of(2)};
    EXPECT_EQ(label_of(0), labels[0]) << frame;
    EXPECT_EQ(label_of(1), labels[1]) << frame;
    if (c.pieces.size() == 3) {
      EXPECT_EQ(label_of(2), labels[2]) << frame;
    }
  }
  EXPECT_NE(labels[0], labels[1]);
  EXPECT_NE(labels[1], labels[2]);
  // What comes anew far away gets a new label.
  MeshComponents c = find_components(box({30, 0, 0}, {0.1F, 0.1F, 0.1F}));
  tracker.update(c);
  EXPECT_EQ(c.pieces[0].label, 3);
}

/// Two pieces touch (and are one), then let go.
TEST(Components, LabelsComeBackAfterATouch) {
  ComponentTracker tracker;
  int left = -1, right = -1;
  for (int frame = 0; frame < 30; ++frame) {
    // A gap of 0.24 m that closes by 2 cm a frame; closed from frame 12 to 18, then opening.
    const float gap = 0.02F * static_cast<float>(std::max({15 - frame, frame - 15, 3}) - 3);
    TriangleMesh mesh = box({-0.1F - 0.5F * gap, 0, 0}, {0.1F, 0.1F, 0.15F});
    append(mesh, box({0.1F + 0.5F * gap, 0, 0}, {0.1F, 0.12F, 0.1F}));
    if (gap == 0) mesh.triangles.push_back({1, 8, 3});  // a bridge makes them one piece
    MeshComponents c = find_components(mesh);
    tracker.update(c);
    ASSERT_EQ(c.pieces.size(), gap == 0 ? 1U : 2U) << frame;
    if (gap == 0) {
      EXPECT_TRUE(c.pieces[0].label == left || c.pieces[0].label == right) << frame;
      continue;
    }
    const int first = c.pieces[static_cast<std::size_t>(c.of_vertex[0])].label,
              second = c.pieces[static_cast<std::size_t>(c.of_vertex[8])].label;
    if (frame == 0) {
      left = first;
      right = second;
    }
    EXPECT_EQ(first, left) << frame;
    EXPECT_EQ(second, right) << frame;
  }
}

/// A brick that turns twice about the vertical: its axes turn with it, without a flip.
TEST(Components, AxesKeepTheirSigns) {
  ComponentTracker tracker;
  Mat3d before{};
  for (int frame = 0; frame <= 72; ++frame) {
    const double angle = 4 * std::numbers::pi / 72 * frame;
    const Mat3f turn = rotation_matrix(axis_angle(Vec3f{0, 1, 0}, static_cast<float>(angle)));
    MeshComponents c = find_components(moved(box({}, {0.2F, 0.05F, 0.1F}), {turn, {0.3F, 0.4F, 0}}));
    tracker.update(c);
    const Mat3d axes = c.pieces[0].axes;
    EXPECT_NEAR(determinant(axes), 1, 1e-9);
    for (int i = 0; i < 3 && frame > 0; ++i)  // 10 degrees a frame; float32 positions: 1e-5
      EXPECT_GT(dot(axes.row[i], before.row[i]), std::cos(10 * std::numbers::pi / 180) - 1e-4) << frame;
    before = axes;
  }
}

/// What a rig sees of a mesh, as a hull with normals, frame after frame.
class Rebuilt {
 public:
  explicit Rebuilt(Index resolution)
      : set_("cpu"),
        hull_(set_, cameras(), {kCube, resolution}),
        normals_(set_.device(0), hull_.mesh().positions_m.size()) {}
  static std::vector<Camera> cameras() {
    std::vector<Camera> result;
    for (int i = 0; i < 8; ++i) {
      const double angle = 2 * std::numbers::pi * (i + 0.5) / 8;
      result.push_back(look_at({1.6 * std::sin(angle), i % 2 == 0 ? 0.4 : 1.2, 1.6 * std::cos(angle)},
                               {0, 0.5, 0}, {0, 1, 0}, 640, 480, 600));
    }
    return result;
  }
  /// @param noise_px each pixel within this distance of a contour is set or not at random
  TriangleMesh see(const TriangleMesh& mesh, int noise_px = 0, unsigned seed = 0) {
    std::mt19937 random(seed);
    std::vector<BitMask> masks;
    for (const Camera& c : cameras()) {
      const BitMask exact = render_silhouette(mesh, c);
      BitMask mask = exact;
      for (Index y = noise_px; y < c.height_px - noise_px && noise_px > 0; ++y) {
        for (Index x = noise_px; x < c.width_px - noise_px; ++x) {
          const bool here = exact(x, y);
          if (exact(x - noise_px, y) == here && exact(x + noise_px, y) == here &&
              exact(x, y - noise_px) == here && exact(x, y + noise_px) == here)
            continue;
          if ((random() & 1U) != 0)
            mask.set(x, y);
          else
            mask.clear(x, y);
        }
      }
      masks.push_back(std::move(mask));
    }
    return rebuild(masks);
  }
  /// A still figure, turned about the middle of the workspace: instead, the cameras are turned back.
  TriangleMesh see(const FigureShape& figure, const Mat3d& R) {
    const Vec3d c{0, 0.5, 0};
    std::vector<BitMask> masks;
    for (Camera camera : cameras()) {
      camera.T_cam_world = camera.T_cam_world * Rigidd{R, c - R * c};
      masks.emplace_back(camera.width_px, camera.height_px);
      const FigureTracer tracer(camera);
      for (Index strip = 0; strip < tracer.strip_count(); ++strip)
        tracer.trace_strip(figure, strip, &masks.back(), nullptr);
    }
    return rebuild(masks);
  }
  TriangleMesh rebuild(const std::vector<BitMask>& masks) {
    hull_.upload(masks);
    hull_.reconstruct();
    normals_.compute(set_.context(0), hull_.mesh(), hull_.voxel_size_m());
    TriangleMesh result = hull_.download();
    result.normals =
        to_host(set_.context(0), normals_.view().part(0, static_cast<Index>(result.positions_m.size())));
    return result;
  }
  float voxel_m() const { return hull_.voxel_size_m(); }

 private:
  DeviceSet set_;
  VisualHull hull_;
  SurfaceNormals normals_;
};

/// An L of two bars: no symmetry that hides a turn.
TriangleMesh bars() {
  TriangleMesh mesh = box({0, 0.4F, 0}, {0.3F, 0.06F, 0.08F});
  append(mesh, box({0.22F, 0.55F, 0.05F}, {0.07F, 0.2F, 0.07F}));
  return mesh;
}

struct VelocityError {
  double relative_rms = 0, mean_speed_m_s = 0;
  int rigid = 0, frames = 0;
};
/// RMS difference of the vertices' velocities from w x (p - c) + v over the frames after the first.
VelocityError follow(Rebuilt& rig, const std::string& figure, Vec3d w, int frames, double fps) {
  ComponentTracker tracker;
  VelocityTracker velocity({.voxel_size_m = static_cast<double>(rig.voxel_m())});
  const FigureShape shape = make_figure(figure).at(0);
  VelocityError result;
  double squares = 0, truth_squares = 0;
  for (int frame = 0; frame < frames; ++frame) {
    const double angle = length(w) * frame / fps;
    const Mat3f R = rotation_matrix(axis_angle(vec_cast<float>(normalized(w)), static_cast<float>(angle)));
    const TriangleMesh mesh = rig.see(shape, mat_cast<double>(R));
    MeshComponents components = find_components(mesh);
    tracker.update(components);
    const auto motions = velocity.update(mesh, components, frame == 0 ? 0 : 1 / fps);
    if (frame == 0) continue;
    const std::vector<Vec3f> got = vertex_velocities(mesh, components, motions);
    for (std::size_t i = 0; i < got.size(); ++i) {
      // Phantoms, far from the figure, have no truth.
      const Vec3f at_rest = transpose(R) * (mesh.positions_m[i] - Vec3f{0, 0.5F, 0}) + Vec3f{0, 0.5F, 0};
      if (shape.distance_m(at_rest) > rig.voxel_m()) continue;
      const Vec3d truth = cross(w, vec_cast<double>(mesh.positions_m[i]) - Vec3d{0, 0.5, 0});
      const Vec3d off = vec_cast<double>(got[i]) - truth;
      squares += dot(off, off);
      truth_squares += dot(truth, truth);
    }
    result.rigid += motions[0].source == VelocitySource::rigid ? 1 : 0;
    ++result.frames;
  }
  result.relative_rms = std::sqrt(squares / truth_squares);
  return result;
}

TEST(Velocity, OfFiguresThatTurnOnceASecond) {
  // 12 degrees a frame at 30 frames a second. 5 % is the goal of the method.
  for (const char* figure : {"rabbit", "hand"}) {
    Rebuilt rig(64);
    const VelocityError e = follow(rig, figure, {0, 2 * std::numbers::pi, 0}, 30, 30);
    EXPECT_EQ(e.rigid, e.frames) << figure;
    EXPECT_LT(e.relative_rms, 0.05) << figure;
    const VelocityError tilted = follow(rig, figure, {1, 2, -0.5}, 20, 30);
    EXPECT_EQ(tilted.rigid, tilted.frames) << figure;
    EXPECT_LT(tilted.relative_rms, 0.05) << figure;
  }
}

TEST(Velocity, OfAStillFigureWithNoisyMasksIsNone) {
  Rebuilt rig(64);
  ComponentTracker tracker;
  VelocityTracker velocity({.voxel_size_m = static_cast<double>(rig.voxel_m())});
  for (unsigned frame = 0; frame < 8; ++frame) {
    const TriangleMesh mesh = rig.see(bars(), 1, frame);
    MeshComponents components = find_components(mesh);
    tracker.update(components);
    const auto motions = velocity.update(mesh, components, frame == 0 ? 0 : 1.0 / 30);
    const std::vector<Vec3f> got = vertex_velocities(mesh, components, motions);
    double squares = 0;
    for (const Vec3f v : got) squares += static_cast<double>(dot(v, v));
    EXPECT_LT(std::sqrt(squares / static_cast<double>(got.size())), 0.002) << frame;
  }
}

TEST(Velocity, TwoPiecesMoveEachTheirOwnWay) {
  Rebuilt rig(96);
  ComponentTracker tracker;
  VelocityTracker velocity({.voxel_size_m = static_cast<double>(rig.voxel_m())});
  const double speed = 0.3, fps = 30;
  for (int frame = 0; frame < 5; ++frame) {
    const float t = static_cast<float>(frame / fps * speed);
    TriangleMesh both = box({0.2F + t, 0.5F, 0}, {0.08F, 0.12F, 0.05F});
    append(both, box({-0.25F, 0.4F, 0}, {0.1F, 0.1F, 0.1F}));
    const TriangleMesh mesh = rig.see(both);
    MeshComponents components = find_components(mesh);
    ASSERT_EQ(components.pieces.size(), 2U);
    tracker.update(components);
    const auto motions = velocity.update(mesh, components, frame == 0 ? 0 : 1 / fps);
    if (frame == 0) continue;
    for (std::size_t i = 0; i < 2; ++i) {
      const Vec3d center = components.pieces[i].centroid_m;
      const Vec3d truth = center.x > 0 ? Vec3d{speed, 0, 0} : Vec3d{};
      EXPECT_LT(length(motions[i].at(center) - truth), 0.05 * speed) << "frame " << frame;
    }
  }
}

TEST(Velocity, FallsBackToTheCentroidWhenTheShapeChanged) {
  VelocityTracker velocity({.voxel_size_m = 0.01});
  const auto step = [&](TriangleMesh mesh) {
    compute_normals(mesh);
    MeshComponents components = find_components(mesh);
    components.pieces[0].label = 0;
    return velocity.update(mesh, components, 0.1)[0];
  };
  step(box({}, {0.1F, 0.1F, 0.1F}));
  const PieceMotion motion = step(box({0.2F, 0, 0}, {0.3F, 0.02F, 0.2F}));
  EXPECT_EQ(motion.source, VelocitySource::centroid);
  EXPECT_NEAR(motion.at({}).x, 2, 1e-5);
}

TEST(SymmetricEigenTest, SolvesRandomMatrices) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  for (int k = 0; k < 50; ++k) {
    Mat3d a{};
    for (int i = 0; i < 3; ++i) {
      for (int j = i; j < 3; ++j) a(i, j) = a(j, i) = normal(random);
    }
    const SymmetricEigen e = symmetric_eigen(a);
    EXPECT_GE(e.values.x, e.values.y);
    EXPECT_GE(e.values.y, e.values.z);
    // Jacobi is good to some rounding errors of the norm.
    for (int i = 0; i < 3; ++i)
      EXPECT_LT(length(a * e.vectors.row[i] - e.values[i] * e.vectors.row[i]), 1e-12);
    EXPECT_NEAR(determinant(e.vectors), 1, 1e-12);
  }
}

}  // namespace
}  // namespace tactus
