#include "tactus/io/mesh/mesh_file.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <limits>
#include <sstream>

#include "io/io_test_files.h"
#include "support/message_of.h"
#include "tactus/base/error.h"
#include "tactus/base/read_file.h"
#include "tactus/base/safe_file.h"

namespace tactus {
namespace {
namespace fs = std::filesystem;
using test::message_of;

/// A tetrahedron with numbers that have no short decimal form.
TriangleMesh tetrahedron() {
  TriangleMesh mesh;
  mesh.positions_m = {{0.1F, 1.F / 3, -2.F / 7}, {1.1F, 1e-30F, 0}, {0, 1.7F, 123456.789F}, {-0.3F, 0.2F, 1}};
  mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
  compute_normals(mesh);
  return mesh;
}

bool same_bits(const std::vector<Vec3f>& a, const std::vector<Vec3f>& b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof a[0]) == 0);
}

std::string read_error(const std::string& path) {
  return message_of([&] { read_mesh(path); });
}

/// The error of a file with this content; FILE stands for its path.
std::string content_error(const std::string& name, const std::string& content) {
  const TempFolder folder;
  std::string message = read_error(folder.write(name, content));
  if (const std::size_t at = message.find(folder.path); at != message.npos)
    message.replace(at, folder.path.size() + 1 + name.size(), "FILE");
  return message;
}

template <class T>
std::string bytes_of(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

std::string binary_stl(const TriangleMesh& mesh) {
  std::string bytes(80, ' ');
  const auto n = static_cast<std::uint32_t>(mesh.triangles.size());
  bytes += bytes_of(std::vector<std::uint32_t>{n});
  for (const auto& triangle : mesh.triangles) {
    bytes += bytes_of(std::vector<float>{0, 0, 0});
    for (const Index v : triangle)
      bytes += bytes_of(std::vector<Vec3f>{mesh.positions_m[static_cast<std::size_t>(v)]});
    bytes += std::string(2, '\0');
  }
  return bytes;
}

TEST(MeshFile, BinaryPlyKeepsEveryBit) {
  const TempFolder folder;
  TriangleMesh mesh = tetrahedron();
  const std::string path = folder.path + "/a.PLY";
  const std::vector<Rgb8> colors(4, Rgb8{1, 2, 3});
  write_mesh(path, mesh, colors);
  TriangleMesh back = read_mesh(path);
  EXPECT_TRUE(same_bits(back.positions_m, mesh.positions_m));
  EXPECT_TRUE(same_bits(back.normals, mesh.normals));
  EXPECT_EQ(back.triangles, mesh.triangles);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path), fs::directory_iterator()), 1);
  // Without normals and colours, over the old file.
  mesh.normals.clear();
  write_mesh(path, mesh);
  back = read_mesh(path);
  EXPECT_TRUE(same_bits(back.positions_m, mesh.positions_m));
  EXPECT_TRUE(back.normals.empty());
}

TEST(MeshFile, ObjComesBackWithTheSameBits) {
  // 9 significant digits identify every float.
  const TempFolder folder;
  TriangleMesh mesh = tetrahedron();
  for (int pass = 0; pass < 2; ++pass) {
    write_mesh(folder.path + "/a.obj", mesh);
    const TriangleMesh back = read_mesh(folder.path + "/a.obj");
    EXPECT_TRUE(same_bits(back.positions_m, mesh.positions_m));
    EXPECT_TRUE(same_bits(back.normals, mesh.normals));
    EXPECT_EQ(back.triangles, mesh.triangles);
    mesh.normals.clear();
  }
}

TEST(MeshFile, ReadsObjOfOthers) {
  const TempFolder folder;
  const TriangleMesh mesh = read_mesh(folder.write("a.obj",
                                                   "mtllib x.mtl\r\n"
                                                   "v 0 0 0 # first\nv +1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\n"
                                                   "vn 0 0 1\ns off\nf 1/1/1 2/1/1 3/1/1 -1/1/1\n"));
  EXPECT_EQ(mesh.positions_m.size(), 4U);
  EXPECT_EQ(mesh.triangles, (std::vector<std::array<Index, 3>>{{0, 1, 2}, {0, 2, 3}}));
  EXPECT_TRUE(mesh.normals.empty());
}

TEST(MeshFile, ReadsPlyOfOthers) {
  const TempFolder folder;
  const std::string header =
      "element vertex 3\nproperty double x\nproperty float y\nproperty short z\nproperty uchar quality\n"
      "element edge 1\nproperty list uchar short stuff\nelement face 1\nproperty list ushort uint "
      "vertex_index\n"
      "end_header\n";
  const TriangleMesh ascii =
      read_mesh(folder.write("a.ply", "ply\nformat ascii 1.0\ncomment a # b\n" + header +
                                          "0 0 0 7\n1 0.5 -2 7\n\n0 1 0 7\n2 5 6\n3 0 1 2\n"));
  EXPECT_EQ(ascii.positions_m[1], (Vec3f{1, 0.5F, -2}));
  EXPECT_EQ(ascii.triangles.at(0), (std::array<Index, 3>{0, 1, 2}));

  std::string big = "ply\nformat binary_big_endian 1.0\n" + header;
  const auto add = [&](auto value) {
    std::string b = bytes_of(std::vector{value});
    std::reverse(b.begin(), b.end());
    big += b;
  };
  for (int i = 0; i < 3; ++i) {
    add(i == 1 ? 1.0 : 0.0);
    add(i == 1 ? 0.5F : static_cast<float>(i / 2));
    add(static_cast<std::int16_t>(i == 1 ? -2 : 0));
    add(std::uint8_t{7});
  }
  add(std::uint8_t{1});
  add(std::int16_t{5});
  add(std::uint16_t{3});
  for (const std::uint32_t v : {0U, 1U, 2U}) add(v);
  const TriangleMesh same = read_mesh(folder.write("b.ply", big));
  EXPECT_TRUE(same_bits(same.positions_m, ascii.positions_m));
  EXPECT_EQ(same.triangles, ascii.triangles);
}

TEST(MeshFile, StlIsWelded) {
  const TempFolder folder;
  TriangleMesh mesh = tetrahedron();
  const TriangleMesh binary = read_mesh(folder.write("a.stl", binary_stl(mesh)));
  EXPECT_EQ(binary.positions_m.size(), 4U);
  EXPECT_TRUE(topology(binary).closed_manifold());
  // The volume sums the same triangles about another order of vertices: equal up to rounding.
  EXPECT_NEAR(volume_m3(binary), volume_m3(mesh), 1e-6 * std::abs(volume_m3(mesh)));

  std::string text = "solid a b\n";
  for (const auto& t : std::vector<std::array<std::string, 3>>{{{"0 0 0", "0 1 0", "1 0 0"}},
                                                               {{"0 0 -0", "1 0 0", "0 0 1"}},
                                                               {{"1 0 0", "0 1 0", "0 0 1"}},
                                                               {{"0 1 0", "0 0 0", "0 0 1"}}}) {
    text += "facet normal 0 0 0\nouter loop\n";
    for (const std::string& p : t) text += "vertex " + p + "\n";
    text += "endloop\nendfacet\n";
  }
  const TriangleMesh ascii = read_mesh(folder.write("b.stl", text + "endsolid a b\n"));
  EXPECT_EQ(ascii.positions_m.size(), 4U);
  EXPECT_TRUE(topology(ascii).closed_manifold());
  EXPECT_NEAR(volume_m3(ascii), 1. / 6, 1e-7);
  EXPECT_EQ(content_error("c.stl", text), "FILE: truncated after line 29, expected 'endsolid'");
}

TEST(MeshFile, GltfPlacesNodesAndWeldsSeams) {
  // A buffer with a tetrahedron whose vertex 0 is stored twice, at a node that shifts, scales and mirrors it.
  std::string buffer = bytes_of(std::vector<Vec3f>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0}});
  buffer += bytes_of(std::vector<std::uint16_t>{0, 2, 1, 4, 1, 3, 1, 2, 3, 2, 4, 3});
  const TempFolder folder;
  folder.write("data.bin", buffer);
  const auto json = [](const std::string& last_index_count) {
    return R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
      "nodes": [{"children": [1], "translation": [10, 0, 0]}, {"mesh": 0, "scale": [-2, 2, 2]}],
      "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
      "buffers": [{"byteLength": 84, "uri": "data.bin"}],
      "bufferViews": [{"buffer": 0, "byteLength": 60}, {"buffer": 0, "byteOffset": 60, "byteLength": 24}],
      "accessors": [{"bufferView": 0, "componentType": 5126, "count": 5, "type": "VEC3"},
                    {"bufferView": 1, "componentType": 5123, "count": )" +
           last_index_count + R"(, "type": "SCALAR"}]})";
  };
  const TriangleMesh mesh = read_mesh(folder.write("a.gltf", json("12")));
  EXPECT_EQ(mesh.positions_m.size(), 4U);
  EXPECT_TRUE(topology(mesh).closed_manifold());
  EXPECT_NEAR(volume_m3(mesh), 8. / 6,
              1e-5);  // positive: the mirrored triangles were turned; 10 m off the origin
  EXPECT_EQ(bounds(mesh).min, (Vec3f{8, 0, 0}));
  EXPECT_EQ(read_error(folder.write("b.gltf", json("13"))),
            folder.path + "/b.gltf: indices (accessor 1) reaches beyond its buffer of 84 bytes");
  EXPECT_TRUE(read_error(folder.write("c.gltf", "{\"asset\": "))
                  .starts_with(folder.path + "/c.gltf: not a valid glTF file: "));
  EXPECT_TRUE(
      read_error(folder.write("d.glb", "glTF")).starts_with(folder.path + "/d.glb: not a valid glTF file: "));
}

TEST(MeshFile, TextErrorsNameTheLine) {
  EXPECT_EQ(content_error("a.obj", "v 0 0 0\nv 1 x 0\n"), "FILE:2: 'x', expected a number");
  EXPECT_EQ(content_error("a.obj", "v 0 0 0\nv 1 0\n"), "FILE:2: 3 values, expected at least 4");
  EXPECT_EQ(content_error("a.obj", "v 0 0 0\nv 1 0 nan\nv 0 1 0\nf 1 2 3\n"),
            "FILE:2: vertex 1 is (1, 0, nan), expected finite numbers");
  EXPECT_EQ(content_error("a.obj", "v 0 0 0\nv 1 0 1e99\nv 0 1 0\nf 1 2 3\n"),
            "FILE:2: vertex 1 is (1, 0, 1e+99), expected at most 1e18 m");
  EXPECT_EQ(content_error("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n\nf 1 2 4\n"),
            "FILE:5: a face refers to vertex 3, but there are 3 (counted from 0)");
  EXPECT_EQ(content_error("a.obj", "v 0 0 0\nf 1 2\n"), "FILE:2: a face with 2 corners, expected 3 or more");
  EXPECT_EQ(content_error("a.obj", "v 0 0 0\nf 1 0 1\n"),
            "FILE:2: corner '0', expected vertex numbers from 1 such as 3 or 3/1/2");
  EXPECT_EQ(content_error("a.obj", "v 0 0 0\n"), "FILE: no triangles in it, expected a surface");
  EXPECT_EQ(content_error("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n"),
            "FILE: truncated after line 4, expected vertex 2 of 3");
  EXPECT_EQ(content_error("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 7\n"),
            "FILE:6: a face refers to vertex 7, but there are 3 (counted from 0)");
  EXPECT_EQ(content_error("a.off", "OFG\n"),
            "FILE:1: 'OFG', expected 'OFF', or COFF, NOFF, STOFF and the like");
  EXPECT_EQ(content_error("a.stl", "solid a\nfacet normal 0 0 0\nvertex 0 0 0\nendfacet\nendsolid\n"),
            "FILE:4: a facet with 1 vertices, expected 3");
}

TEST(MeshFile, PlyErrorsNameLineOrElement) {
  const std::string vertex = "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
  const std::string face = "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
  const std::string ascii = "ply\nformat ascii 1.0\n" + vertex + face;
  EXPECT_EQ(content_error("a.ply", "plx\n"), "FILE:1: expected 'ply' at the start of the file");
  for (const char* name : {"a.ply", "a.obj", "a.stl", "a.off", "a.gltf", "a.glb"})
    EXPECT_EQ(content_error(name, ""), "FILE: the file is empty");
  EXPECT_EQ(content_error("a.ply", "ply\nformat ascii 1.0\n" + vertex),
            "FILE: truncated after line 6, expected 'end_header'");
  EXPECT_EQ(content_error("a.ply", "ply\nformat binary 1.0\n"),
            "FILE:2: unknown format 'binary', expected ascii, binary_little_endian or binary_big_endian");
  EXPECT_EQ(content_error("a.ply", "ply\nelement vertex 3\nproperty flt x\n"),
            "FILE:3: unknown type 'flt', expected such as float, uchar or int");
  EXPECT_EQ(
      content_error("a.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n0\n"),
      "FILE: element 'vertex' lacks the properties x, y and z");
  EXPECT_EQ(content_error("a.ply", "ply\nformat ascii 1.0\nend_header\n"),
            "FILE: no element 'vertex' in the header");
  EXPECT_EQ(content_error("a.ply", ascii + "0 0 0\n1 0 0\n0 1 0\n"),
            "FILE: truncated after line 12, expected face 0 of 1");
  EXPECT_EQ(content_error("a.ply", ascii + "0 0 0\n1 0 0\n0 nan 0\n3 0 1 2\n"),
            "FILE:12: vertex 2 is (0, nan, 0), expected finite numbers");
  EXPECT_EQ(content_error("a.ply", ascii + "0 0 0\n1 0 0\n0 1 0\n3 0 1 -2\n"),
            "FILE: face 0 refers to vertex -2, but there are 3 (counted from 0)");
  EXPECT_EQ(content_error("a.ply", ascii + "0 0 0\n1 0 0\n0 1 0\n3 0 1 1.5\n"),
            "FILE: face 0 holds 1.500000, expected a whole number");

  const std::string binary = "ply\nformat binary_little_endian 1.0\n" + vertex + face;
  const std::string points = bytes_of(std::vector<Vec3f>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
  EXPECT_EQ(content_error("a.ply", binary + points.substr(0, 30)), "FILE: truncated in vertex 2 of 3");
  EXPECT_EQ(content_error("a.ply", binary + points + "\x03"), "FILE: truncated in face 0 of 1");
  EXPECT_EQ(content_error("a.ply", binary + points + "\x03" + bytes_of(std::vector<std::int32_t>{0, 1, 3})),
            "FILE: face 0 refers to vertex 3, but there are 3 (counted from 0)");
  const float inf = std::numeric_limits<float>::infinity();
  EXPECT_EQ(content_error("a.ply", binary + bytes_of(std::vector<Vec3f>{{0, 0, 0}, {1, 0, inf}, {0, 1, 0}}) +
                                       "\x03" + bytes_of(std::vector<std::int32_t>{0, 1, 2})),
            "FILE: vertex 1 is (1, 0, inf), expected finite numbers");
  // A header that promises more than any file holds must not take its memory.
  EXPECT_EQ(content_error("a.ply",
                          "ply\nformat binary_little_endian 1.0\nelement vertex 4000000000000\n"
                          "property float x\nproperty float y\nproperty float z\nend_header\n"),
            "FILE: truncated in vertex 0 of 4000000000000");
}

TEST(MeshFile, StlErrors) {
  const std::string stl = binary_stl(tetrahedron());
  EXPECT_EQ(content_error("a.stl", stl.substr(0, 150)),
            "FILE: 4 triangles take 284 bytes, but the file has 150");
  EXPECT_EQ(content_error("a.stl", stl.substr(0, 10)), "FILE: truncated, 10 bytes are no STL file");
  TriangleMesh point = tetrahedron();
  for (Vec3f& p : point.positions_m) p = {1, 1, 1};
  EXPECT_EQ(content_error("a.stl", binary_stl(point)),
            "FILE: all its triangles are points or lines, expected a surface");
}

TEST(MeshFile, DamagedFilesAreRefusedOrValid) {
  const TempFolder folder;
  write_mesh(folder.path + "/a.ply", tetrahedron());
  write_mesh(folder.path + "/a.obj", tetrahedron());
  folder.write("a.stl", binary_stl(tetrahedron()));
  folder.write("a.off", "OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n");
  std::uint32_t state = 1;
  const auto random = [&](std::size_t below) {
    return ((state = state * 1664525U + 1013904223U) >> 8) % below;
  };
  for (const char* name : {"a.ply", "a.obj", "a.stl", "a.off"}) {
    const std::string whole = read_file(folder.path + "/" + name, kMaxMeshBytes);
    int refused = 0;
    for (int i = 0; i < 120; ++i) {
      std::string bytes = whole;
      for (int k = 0; k < 2; ++k) bytes[random(bytes.size())] = static_cast<char>(random(256));
      if (i % 3 == 0) bytes.resize(random(bytes.size()));
      const std::string path = folder.write(std::string("b") + (name + 1), bytes);
      try {
        const TriangleMesh mesh = read_mesh(path);
        for (const auto& triangle : mesh.triangles) {
          for (const Index v : triangle)
            ASSERT_TRUE(v >= 0 && static_cast<std::size_t>(v) < mesh.positions_m.size());
        }
      } catch (const Error& e) {
        ++refused;
        EXPECT_TRUE(std::string(e.what()).starts_with(path)) << e.what();
      }
    }
    EXPECT_GT(refused, 20) << name;  // half of the 40 cut files at the very least
  }
}

TEST(MeshFile, PathErrors) {
  EXPECT_EQ(read_error("none.ply"), "can't read 'none.ply': No such file or directory");
  EXPECT_EQ(read_error("a.fbx"),
            "can't read 'a.fbx': unknown extension '.fbx', expected .ply, .obj, .stl, .off, .gltf or .glb");
  const auto write_error = [](const std::string& path) -> std::string {
    return message_of([&] { write_mesh(path, tetrahedron()); });
  };
  EXPECT_EQ(write_error("a.stl"),
            "can't write 'a.stl': unknown extension '.stl', expected .ply, .obj, .glb or .gltf");
  EXPECT_EQ(write_error("no/such/a.ply"), "can't write 'no/such/a.ply': the folder 'no/such' does not exist");
  TriangleMesh mesh = tetrahedron();
  mesh.normals.pop_back();
  EXPECT_THROW(write_ply("a.ply", mesh), Error);
  EXPECT_FALSE(fs::exists("a.ply"));
}

TEST(MeshData, HandOffIsClosed) {
  TACTUS_DATA_OR_SKIP(data);
  const TriangleMesh hand = read_mesh(data + "/meshes/hand.off");
  EXPECT_EQ(hand.positions_m.size(), 1197U);
  EXPECT_TRUE(topology(hand).closed_manifold());
  EXPECT_GT(volume_m3(hand), 0);
}

/// The two lists "[[x,y,z],...]" of a JavaScript file, vertices and then triangles from 0, as OBJ.
std::string bunny_as_obj(const std::string& js) {
  std::string obj;
  std::size_t at = 0;
  for (const bool triangles : {false, true}) {
    const std::size_t begin = js.find("[[", at) + 2, end = js.find("]]", begin);
    std::string rows = js.substr(begin, end - begin);
    for (std::size_t gap; (gap = rows.find("],[")) != rows.npos;) rows.replace(gap, 3, "\n");
    std::replace(rows.begin(), rows.end(), ',', ' ');
    std::istringstream lines(rows);
    for (std::string line; std::getline(lines, line);) {
      if (triangles) {
        std::istringstream numbers(line);
        obj += "f";
        for (int v = 0; numbers >> v;) obj += " " + std::to_string(v + 1);
        obj += "\n";
      } else {
        obj += "v " + line + "\n";
      }
    }
    at = end;
  }
  return obj;
}

TEST(MeshData, BunnyIsClosed) {
  TACTUS_DATA_OR_SKIP(data);
  const TempFolder folder;
  const TriangleMesh bunny = read_mesh(
      folder.write("bunny.obj", bunny_as_obj(read_file(data + "/meshes/bunny_npm_index.js", kMaxMeshBytes))));
  EXPECT_EQ(bunny.positions_m.size(), 1839U);
  EXPECT_EQ(bunny.triangles.size(), 3674U);
  EXPECT_TRUE(topology(bunny).closed_manifold());
  EXPECT_EQ(topology(bunny).euler, 2);
  // Through every format that is written, and back.
  write_mesh(folder.path + "/b.ply", bunny);
  EXPECT_TRUE(same_bits(read_mesh(folder.path + "/b.ply").positions_m, bunny.positions_m));
  EXPECT_EQ(read_mesh(folder.path + "/b.ply").triangles, bunny.triangles);
}

TEST(MeshData, SkinnedGltfHandInItsRestPose) {
  TACTUS_DATA_OR_SKIP(data);
  const TriangleMesh hand = read_mesh(data + "/meshes/hand_webxr_right.glb");
  // 1,360 vertices with texture seams; the surface is open at the wrist only.
  EXPECT_LT(hand.positions_m.size(), 1360U);
  EXPECT_EQ(topology(hand).nonmanifold_edges, 0);
  EXPECT_EQ(topology(hand).components, 1);
  // The joints' rest pose is the pose of binding: the bounds in the file's POSITION accessor stay, up to the
  // rounding of the matrices in the file (6 digits of numbers below 1).
  const Box3f box = bounds(hand);
  EXPECT_NEAR(box.min.y, -0.133908F, 1e-5);
  EXPECT_NEAR(box.max.y, 0.078133F, 1e-5);
}

TEST(MeshData, DamagedGltfIsRefusedOrValid) {
  TACTUS_DATA_OR_SKIP(data);
  const std::string whole = read_file(data + "/meshes/hand_webxr_right.glb", kMaxMeshBytes);
  std::uint32_t json_bytes = 0;  // of the first chunk, after 20 bytes of headers
  std::memcpy(&json_bytes, whole.data() + 12, sizeof json_bytes);
  const TempFolder folder;
  std::uint32_t state = 1;
  const auto random = [&](std::size_t below) {
    return ((state = state * 1664525U + 1013904223U) >> 8) % below;
  };
  int refused = 0;
  for (int i = 0; i < 150; ++i) {
    std::string bytes = whole;
    for (int k = 0; k < 4; ++k) {
      // Digits become other digits: still JSON, with wrong indices, counts, offsets and types.
      std::size_t at = 20 + random(json_bytes);
      while (at < 20 + json_bytes && (bytes[at] < '0' || bytes[at] > '9')) ++at;
      bytes[at] = static_cast<char>('0' + random(10));
    }
    if (i % 5 == 0) bytes.resize(random(bytes.size()));
    const std::string path = folder.write("b.glb", bytes);
    try {
      const TriangleMesh mesh = read_mesh(path);
      for (const auto& triangle : mesh.triangles) {
        for (const Index v : triangle)
          ASSERT_TRUE(v >= 0 && static_cast<std::size_t>(v) < mesh.positions_m.size());
      }
    } catch (const Error& e) {
      ++refused;
      EXPECT_TRUE(std::string(e.what()).starts_with(path)) << e.what();
    }
  }
  EXPECT_GE(refused, 30);  // all that were cut
}

}  // namespace
}  // namespace tactus
