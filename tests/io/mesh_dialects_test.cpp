// Files as other programs write them: line ends, encodings, headers, strips, several solids.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>

#include "io/io_test_files.h"
#include "io/mesh_texts.h"
#include "support/message_of.h"
#include "tactus/geom/mesh/mesh_defects.h"
#include "tactus/io/mesh/mesh_file.h"

namespace tactus {
namespace {

using test::message_of;
using test::PolygonMesh;
using test::triangle_cube;

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t at = 0; (at = text.find(from, at)) != text.npos; at += to.size())
    text.replace(at, from.size(), to);
  return text;
}

std::string utf16(const std::string& text, bool little) {
  std::string wide = little ? "\xff\xfe" : "\xfe\xff";
  for (const char c : text) {
    wide += little ? c : '\0';
    wide += little ? '\0' : c;
  }
  return wide;
}

void expect_litres(const TriangleMesh& mesh, double litres) {
  EXPECT_TRUE(find_edge_defects(mesh).bounds_solid());
  EXPECT_NEAR(1e3 * volume_m3(mesh), litres, 1e-5 * litres);  // sums of floats of 0.1 to 0.5
}

std::string text_of(const PolygonMesh& mesh, const std::string& format) {
  return format == ".stl" ? mesh.solid("a b") : mesh.text(format);
}

TEST(MeshDialects, LineEndsAndEncodings) {
  const TempFolder folder;
  const PolygonMesh cube = triangle_cube({0.1, 0.2, 0.3}, 0.1);
  for (const std::string format : {".obj", ".ply", ".off", ".stl"}) {
    const std::string text = text_of(cube, format);
    const std::string dialects[] = {text,
                                    replaced(text, "\n", "\r\n"),
                                    replaced(text, "\n", "\r"),
                                    "\n\n  \r\n" + text,
                                    "\xef\xbb\xbf" + text,
                                    utf16(text, true),
                                    utf16(replaced(text, "\n", "\r\n"), true),
                                    utf16(text, false),
                                    utf16(text, true).substr(2),  // without the mark of its order
                                    utf16(text, false).substr(2)};
    int number = 0;
    for (const std::string& dialect : dialects) {
      SCOPED_TRACE(format + ", dialect " + std::to_string(number++));
      expect_litres(read_mesh(folder.write("a" + format, dialect)), 1);
    }
  }
  // The line is counted with every kind of end.
  for (const std::string end : {"\n", "\r\n", "\r"}) {
    const std::string path = folder.write("b.obj", replaced("v 0 0 0\n\nv 1 x 0\n", "\n", end));
    EXPECT_EQ(message_of([&] { read_mesh(path); }), path + ":3: 'x', expected a number");
  }
}

TEST(MeshDialects, BinaryPlyBehindAHeaderOfCarriageReturns) {
  const TempFolder folder;
  const PolygonMesh cube = triangle_cube({0, 0, 0}, 0.1);
  TriangleMesh mesh = read_mesh(folder.write("a.obj", cube.text(".obj")));
  // The first byte behind the header is one that looks like the end of a line.
  std::uint32_t bits = 0x3e00000aU;
  std::memcpy(&mesh.positions_m[0].x, &bits, 4);
  write_ply(folder.path + "/b.ply", mesh);
  std::ifstream in(folder.path + "/b.ply", std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(in), {}};
  const std::size_t data = bytes.find("end_header\n") + 11;
  ASSERT_EQ(bytes[data], '\n');
  for (const std::string end : {"\r", "\r\n"}) {
    const std::string other = replaced(bytes.substr(0, data), "\n", end) + bytes.substr(data);
    EXPECT_EQ(read_mesh(folder.write("c.ply", other)).positions_m, mesh.positions_m);
  }
}

TEST(MeshDialects, AllSolidsOfAnAsciiStl) {
  const TempFolder folder;
  const std::string one = triangle_cube({0, 0, 0}, 0.1).solid("one"),
                    two = triangle_cube({0.3, 0, 0}, 0.1).solid("two");
  expect_litres(read_mesh(folder.write("two.stl", one + two)), 2);
  expect_litres(read_mesh(folder.write("gap.stl", "\n" + one + "\n\n" + two + "\n")), 2);
  std::string upper = one + two;
  std::transform(upper.begin(), upper.end(), upper.begin(), [](unsigned char c) { return std::toupper(c); });
  expect_litres(read_mesh(folder.write("upper.stl", upper)), 2);
  const std::string cut = folder.write("cut.stl", one + two.substr(0, two.find("endsolid")));
  EXPECT_EQ(message_of([&] { read_mesh(cut); }), cut + ": truncated after line 171, expected 'endsolid'");
}

TEST(MeshDialects, BytesBehindABinaryStl) {
  const TempFolder folder;
  const PolygonMesh cube = triangle_cube({0, 0, 0}, 0.1);
  std::string bytes = "solid of another program";  // a binary file whose header begins so
  bytes.resize(80, ' ');
  const auto add = [&](auto value) { bytes.append(reinterpret_cast<const char*>(&value), sizeof value); };
  add(std::uint32_t{12});
  for (const auto& face : cube.faces) {
    add(Vec3f{});
    for (const int v : face) add(vec_cast<float>(cube.vertices.at(static_cast<std::size_t>(v))));
    add(std::uint16_t{0});
  }
  expect_litres(read_mesh(folder.write("a.stl", bytes)), 1);
  testing::internal::CaptureStderr();
  const std::string path = folder.write("b.stl", bytes + "\r\nmade by someone");
  expect_litres(read_mesh(path), 1);
  const std::string reported = testing::internal::GetCapturedStderr();
  EXPECT_NE(reported.find(path + ": 17 bytes behind its 12 triangles are not read"), reported.npos)
      << reported;
}

TEST(MeshDialects, ObjLinesGoOnBehindABackslash) {
  const TempFolder folder;
  std::string text = triangle_cube({0, 0, 0}, 0.1).text(".obj");
  text = replaced(text, "f 1 3 4\n", "f 1 3 \\\n4\n");
  text = replaced(text, "f 5 6 8\n", "f 5\\\r\n 6 \\\r\n\\\r\n8\n");
  expect_litres(read_mesh(folder.write("a.obj", text)), 1);
  // A comment doesn't: it may be the name of a folder.
  expect_litres(read_mesh(folder.write("b.obj", "# from C:\\models\\\n" + text)), 1);
  const std::string path = folder.write("c.obj", "v 0 0 \\\n0\nv 1 x\\\n 0\n");
  EXPECT_EQ(message_of([&] { read_mesh(path); }), path + ":4: 'x', expected a number");
}

TEST(MeshDialects, PlyTriangleStrips) {
  // Two tetrahedra: one strip of four triangles, and two of two triangles that equal corners join.
  const TempFolder folder;
  const std::string head =
      "element vertex 8\nproperty float x\nproperty float y\nproperty float z\nelement tristrips 1\n"
      "property list int int vertex_indices\nend_header\n";
  const std::vector<int> strip = {0, 2, 1, 3, 0, 2, -1, 4, 6, 5, 7, 7, 5, 5, 7, 4, 6};
  const Vec3f corners[] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  std::string text = "ply\nformat ascii 1.0\n" + head,
              binary = "ply\nformat binary_little_endian 1.0\n" + head;
  const auto add = [&](auto value) { binary.append(reinterpret_cast<const char*>(&value), sizeof value); };
  for (int k = 0; k < 8; ++k) {
    const Vec3f p = corners[k % 4] + Vec3f{k < 4 ? 0.F : 5.F, 0, 0};
    text += test::digits(p.x) + " " + test::digits(p.y) + " " + test::digits(p.z) + "\n";
    add(p);
  }
  text += std::to_string(strip.size());
  add(static_cast<std::int32_t>(strip.size()));
  for (const int v : strip) {
    text += " " + std::to_string(v);
    add(std::int32_t{v});
  }
  for (const std::string& path : {folder.write("a.ply", text + "\n"), folder.write("b.ply", binary)}) {
    const TriangleMesh mesh = read_mesh(path);
    EXPECT_EQ(mesh.triangles.size(), 8U);
    EXPECT_TRUE(topology(mesh).closed_manifold());
    EXPECT_NEAR(volume_m3(mesh), 2. / 6, 1e-6);
  }
}

/// Case ply_tristrips: the second strip repeats two faces of a tetrahedron, whose edges would then have three
/// triangles. Both sides of a sheet stay.
TEST(MeshDialects, ply_tristrips) {
  const TempFolder folder;
  const std::string head =
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float "
      "z\nelement "
      "tristrips 1\nproperty list int int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n";
  const TriangleMesh solid = read_mesh(folder.write("a.ply", head + "11 0 2 1 3 0 2 -1 0 1 3 2\n"));
  EXPECT_EQ(solid.triangles.size(), 4U);
  EXPECT_TRUE(topology(solid).closed_manifold());
  EXPECT_NEAR(volume_m3(solid), 1. / 6, 1e-7);
  const TriangleMesh sheet =
      read_mesh(folder.write("b.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 3 2 1\nf 2 3 1\n"));
  EXPECT_EQ(sheet.triangles.size(), 2U);
}

TEST(MeshDialects, OffHeadersOfOtherPrograms) {
  const TempFolder folder;
  const PolygonMesh cube = triangle_cube({0, 0, 0}, 0.1);
  const std::string counts = cube.counts(), faces = cube.face_lines(true, 0);
  const auto litres = [&](const std::string& text) {
    expect_litres(read_mesh(folder.write("a.off", text)), 1);
  };
  litres("COFF\n" + counts + cube.vertex_lines("", " 255 0 0 255") + faces);
  litres("coff " + counts + cube.vertex_lines("", " 255 0 0 255") + faces);
  litres("NOFF\n" + counts + cube.vertex_lines("", " 0 0 1") + faces);
  litres("STOFF\n" + counts + cube.vertex_lines("", " 0.5 0.5") + faces);
  litres("CNOFF\n" + counts + cube.vertex_lines("", " 0 0 1 255 0 0 255") + faces);
  litres("STCNOFF\n" + counts + cube.vertex_lines("", " 0 0 1 1 0 0 1 0.5 0.5") + faces);
  litres("# nothing\n" + counts + cube.vertex_lines("") + faces);
  for (const std::string word : {"4OFF", "nOFF", "C4nOFF"}) {
    const std::string path = folder.write("b.off", word + "\n" + counts);
    EXPECT_EQ(
        message_of([&] { read_mesh(path); }),
        path + ":1: '" + word + "' has not three coordinates a vertex, expected OFF, COFF, NOFF or STOFF");
  }
}

TEST(MeshDialects, BinaryOff) {
  const TempFolder folder;
  const PolygonMesh cube = triangle_cube({0, 0, 0}, 0.1);
  for (const auto& [word, more] :
       std::vector<std::pair<std::string, int>>{{"OFF", 0}, {"CNOFF", 7}, {"STOFF", 2}}) {
    std::string bytes = word + " BINARY\n";
    const auto add = [&](auto value) {
      const std::size_t at = bytes.size();
      bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
      std::reverse(bytes.begin() + static_cast<std::ptrdiff_t>(at), bytes.end());
    };
    for (const int n : {8, 12, 0}) add(std::int32_t{n});
    for (const Vec3d p : cube.vertices) {
      for (int k = 0; k < 3; ++k) add(static_cast<float>(p[k]));
      for (int k = 0; k < more; ++k) add(0.5F);
    }
    for (const auto& face : cube.faces) {
      add(std::int32_t{3});
      for (const int v : face) add(std::int32_t{v});
      add(std::int32_t{3});
      for (int k = 0; k < 3; ++k) add(1.F);
    }
    SCOPED_TRACE(word);
    expect_litres(read_mesh(folder.write("a.off", bytes)), 1);
    const std::string path = folder.write("b.off", bytes.substr(0, bytes.size() - 3));
    EXPECT_EQ(message_of([&] { read_mesh(path); }), path + ": truncated in face 11 of 12");
  }
}

}  // namespace
}  // namespace tactus
