// The one stage through which meshes of all formats go: the same shape comes out of each of them.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "io/io_test_files.h"
#include "io/mesh_texts.h"
#include "support/message_of.h"
#include "tactus/geom/mesh/mesh_defects.h"
#include "tactus/io/mesh/mesh_file.h"

namespace tactus {
namespace {

using test::message_of;
using test::PolygonMesh;

const char* const kTextFormats[] = {".obj", ".ply", ".off"};

/// A prism over an outline in the xy plane, of height 1.
PolygonMesh prism(const std::vector<std::array<double, 2>>& outline) {
  PolygonMesh mesh;
  const int n = static_cast<int>(outline.size());
  for (const double z : {0., 1.}) {
    for (const auto& [x, y] : outline) mesh.vertices.push_back({x, y, z});
  }
  std::vector<int> bottom, top;
  for (int i = 0; i < n; ++i) {
    bottom.push_back(n - 1 - i);
    top.push_back(n + i);
    mesh.faces.push_back({i, (i + 1) % n, n + (i + 1) % n, n + i});
  }
  mesh.faces.push_back(bottom);
  mesh.faces.push_back(top);
  return mesh;
}

/// As exporters write it that keep a normal or texture coordinate a vertex: corners once a face.
PolygonMesh split_at_edges(const PolygonMesh& mesh, double noise) {
  PolygonMesh split;
  for (const auto& face : mesh.faces) {
    auto& corners = split.faces.emplace_back();
    for (const int v : face) {
      corners.push_back(static_cast<int>(split.vertices.size()));
      Vec3d p = mesh.vertices.at(static_cast<std::size_t>(v));
      p.x += (split.vertices.size() % 2 == 0 ? 1 : -1) * noise;
      split.vertices.push_back(p);
    }
  }
  return split;
}

const std::vector<std::array<double, 2>> kSquare = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};

TEST(MeshImport, CornersOfAllFacesAreWeldedInAllFormats) {
  const TempFolder folder;
  // Half of the distance to either side, then three times as far: 1e-6 of a size of 1.
  for (const double noise : {0., 0.4e-6, 3e-6}) {
    for (const std::string format : kTextFormats) {
      SCOPED_TRACE(format + " " + std::to_string(noise));
      const PolygonMesh cube = split_at_edges(prism(kSquare), noise);
      const TriangleMesh mesh = read_mesh(folder.write("cube" + format, cube.text(format)));
      EXPECT_EQ(topology(mesh).closed_manifold(), noise < 1e-6);
      if (noise > 1e-6) continue;
      EXPECT_EQ(mesh.positions_m.size(), 8U);
      EXPECT_EQ(mesh.triangles.size(), 12U);
      EXPECT_NEAR(volume_m3(mesh), 1, 2e-6);  // twice the noise
    }
  }
}

TEST(MeshImport, NormalsStayWhereNothingIsWelded) {
  const TempFolder folder;
  TriangleMesh mesh = read_mesh(folder.write("a.obj", prism(kSquare).text(".obj")));
  compute_normals(mesh);
  write_mesh(folder.path + "/b.ply", mesh);
  EXPECT_EQ(read_mesh(folder.path + "/b.ply").normals, mesh.normals);
  mesh.positions_m.push_back(mesh.positions_m[0]);
  mesh.normals.push_back({1, 0, 0});
  mesh.triangles.push_back({8, 1, 2});
  write_mesh(folder.path + "/c.ply", mesh);
  EXPECT_TRUE(read_mesh(folder.path + "/c.ply").normals.empty());
}

TEST(MeshImport, ConcavePolygonsKeepVolumeAndArea) {
  // A fan around a corner folds: the volume stays, as folds cancel, but surfaces cross and the area grows.
  struct Case {
    std::vector<std::array<double, 2>> outline;
    double area, around;
  };
  const Case cases[] = {{{{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 3}, {0, 3}}, 4, 10},
                        {{{0, 0}, {3, 0}, {3, 3}, {2, 3}, {2, 1}, {1, 1}, {1, 3}, {0, 3}}, 7, 16},
                        {{{0, 0}, {4, 3}, {0, 6}, {1.75, 3}}, 6.75, 10 + 2 * std::hypot(1.75, 3)}};
  const TempFolder folder;
  for (Case c : cases) {
    for (std::size_t first = 0; first < c.outline.size(); ++first) {
      for (const std::string format : kTextFormats) {
        SCOPED_TRACE(format);
        const TriangleMesh mesh = read_mesh(folder.write("l" + format, prism(c.outline).text(format)));
        EXPECT_TRUE(topology(mesh).closed_manifold());
        EXPECT_EQ(find_self_crossings(mesh).pairs, 0);
        EXPECT_NEAR(volume_m3(mesh), c.area, 1e-5);  // floats of numbers up to 6
        EXPECT_NEAR(area_m2(mesh), 2 * c.area + c.around, 1e-5);
      }
      std::rotate(c.outline.begin(), c.outline.begin() + 1, c.outline.end());
    }
  }
}

TEST(MeshImport, VerticesOfNoFaceDoNotCount) {
  const TempFolder folder;
  PolygonMesh cube = prism(kSquare);
  cube.vertices.insert(cube.vertices.begin() + 3, {100, std::nan(""), -1e30});
  for (auto& face : cube.faces) {
    for (int& v : face) v += v >= 3 ? 1 : 0;
  }
  for (const std::string format : kTextFormats) {
    const TriangleMesh mesh = read_mesh(folder.write("s" + format, cube.text(format)));
    EXPECT_EQ(mesh.positions_m.size(), 8U);
    EXPECT_EQ(bounds(mesh).max, (Vec3f{1, 1, 1}));
    EXPECT_NEAR(volume_m3(mesh), 1, 1e-6);
  }
}

TEST(MeshImport, FarFromItsOriginAShapeKeepsItsPrecision) {
  // A ball of 0.1 m at UTM coordinates, where float steps by 0.5 m.
  const Vec3d far{512345.625, 5212345.25, 318.5};
  PolygonMesh ball = prism(kSquare);
  ball.vertices.clear();
  ball.faces.clear();
  constexpr int kRings = 24, kParts = 48;
  const double step = 3.14159265358979323846 / kRings;
  for (int i = 0; i <= kRings; ++i) {
    for (int k = 0; k < kParts; ++k) {
      const double r = 0.1 * std::sin(step * i);
      ball.vertices.push_back({r * std::cos(step * k), r * std::sin(step * k), -0.1 * std::cos(step * i)});
    }
  }
  for (int i = 0; i < kRings; ++i) {
    for (int k = 0; k < kParts; ++k) {
      const int a = i * kParts + k, b = i * kParts + (k + 1) % kParts;
      ball.faces.push_back({a, b, b + kParts, a + kParts});
    }
  }
  const TempFolder folder;
  const TriangleMesh near = read_mesh(folder.write("near.obj", ball.text(".obj")));
  for (Vec3d& p : ball.vertices) p = p + far;
  for (const std::string format : kTextFormats) {
    SCOPED_TRACE(format);
    const std::string path = folder.write("far" + format, ball.text(format));
    const ImportedMesh imported = import_mesh(path);
    ASSERT_EQ(imported.mesh.triangles.size(), near.triangles.size());
    EXPECT_TRUE(topology(imported.mesh).closed_manifold());
    // Doubles step by 1e-9 m there, a hundred-millionth of the ball.
    EXPECT_NEAR(volume_m3(imported.mesh), volume_m3(near), 1e-6 * volume_m3(near));
    EXPECT_NEAR(length(imported.origin_m - far), 0, 1e-8);
    EXPECT_LT(length(bounds(imported.mesh).center()), 1e-7F);
    // In millimetres it is near: 512 m are more than 100 m still, but 5 m are not.
    EXPECT_NEAR(length(import_mesh(path, 1e-3).origin_m - 1e-3 * far), 0, 1e-11);
    EXPECT_EQ(import_mesh(path, 1e-6).origin_m, (Vec3d{}));
  }
  // What is as large as it is far stays: it is a landscape, or its unit is wrong.
  PolygonMesh large = prism(kSquare);
  for (Vec3d& p : large.vertices) p = 200. * p + Vec3d{500, 0, 0};
  EXPECT_EQ(import_mesh(folder.write("large.obj", large.text(".obj"))).origin_m, (Vec3d{}));
}

TEST(MeshImport, TakesNoMemoryOfWhatHasNoEnd) {
  const TempFolder folder;
  for (const std::string name : {"a.ply", "a.obj", "a.stl", "a.off", "a.gltf", "a.glb"}) {
    const std::string path = folder.path + "/" + name;
    std::filesystem::create_symlink("/dev/zero", path);
    EXPECT_EQ(message_of([&] { read_mesh(path); }), "can't read '" + path + "': not a regular file");
    std::filesystem::remove(path);
    ASSERT_EQ(mkfifo(path.c_str(), 0600), 0);
    EXPECT_EQ(message_of([&] { read_mesh(path); }), "can't read '" + path + "': not a regular file");
  }
}

}  // namespace
}  // namespace tactus
