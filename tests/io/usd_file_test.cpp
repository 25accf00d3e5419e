/// Surfaces that move, as USD's text.
#include "tactus/io/usd_file.h"

#include <gtest/gtest.h>

#include <fstream>

#include "io/io_test_files.h"

namespace tactus {
namespace {

TriangleMesh triangle_at(float y_m) {
  return {.positions_m = {{0, y_m, 0}, {1, y_m, 0}, {0, y_m, 0.1F}}, .normals = {}, .triangles = {{0, 1, 2}}};
}

std::string text_of(const std::string& path) {
  std::ifstream in(path);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// Topology that stays is said once, and once more when it changes; velocities are those of the vertices
/// since the last frame: 0.5 m in 1/30 s.
TEST(UsdFile, HasTimeSamplesOfWhatChanges) {
  const TempFolder folder;
  const std::string path = folder.path + "/a.usda";
  UsdWriter usd(path, 30);
  usd.add("5 % of it", triangle_at(0), {1, 0.5F, 0}, 0);
  usd.add_points("blood", std::vector<Vec3f>{{1, 2, 3}}, 0.01F, {1, 0, 0}, 0);
  usd.end_frame(0);
  usd.add("5 % of it", triangle_at(0.5F), {1, 0.5F, 0}, 1);
  usd.end_frame(1);
  TriangleMesh more = triangle_at(0.5F);
  more.positions_m.push_back({1, 1, 1});
  more.triangles.push_back({0, 1, 3});
  usd.add("5 % of it", more, {1, 0.5F, 0}, 2);
  usd.end_frame(2);
  EXPECT_FALSE(std::ifstream(path).is_open()) << "nothing before the end";
  usd.write();
  const std::string text = text_of(path);
  for (const char* part :
       {"#usda 1.0\n", "metersPerUnit = 1\n", "upAxis = \"Y\"", "endTimeCode = 2", "timeCodesPerSecond = 30",
        "def Mesh \"_5___of_it\"",
        "point3f[] points.timeSamples = {\n            0: [(0, 0, 0), (1, 0, 0), "
        "(0, 0, 0.100000001)],\n",
        "vector3f[] velocities.timeSamples = {\n            0: [(0, 0, 0), (0, 0, 0), (0, 0, 0)],\n          "
        "  1: "
        "[(0, 15, 0), (0, 15, 0), (0, 15, 0)],\n",
        "float3[] extent.timeSamples = {\n            0: [(0, 0, 0), (1, 0, 0.100000001)],",
        "int[] faceVertexCounts.timeSamples = {\n            0: [3],\n            2: [3, 3],\n        }\n",
        "int[] faceVertexIndices.timeSamples = {\n            0: [0, 1, 2],\n            2: [0, 1, 2, 0, 1, "
        "3],\n",
        "def Points \"blood\"", "float[] widths = [0.00999999978]",
        "0: [(0.995000005, 1.995, 2.99499989), (1.005, 2.00500011, 3.00500011)],"})
    EXPECT_NE(text.find(part), std::string::npos) << part << "\nis not in\n" << text;
  EXPECT_EQ(std::count(text.begin(), text.end(), '{'), std::count(text.begin(), text.end(), '}'));
}

/// USD has fewer signs in names than scenes. Things that differ stay two, and one that goes is gone from then
/// on, but for those that stand still.
TEST(UsdFile, ThingsStayApartAndGo) {
  const TempFolder folder;
  const std::string path = folder.path + "/a.usda";
  UsdWriter usd(path, 30);
  usd.add_still("table", triangle_at(-1), {1, 1, 1});
  for (int k = 0; k < 3; ++k) {
    usd.add("a b", triangle_at(0), {1, 0, 0}, k);
    if (k == 0) usd.add("a_b", triangle_at(1), {0, 1, 0}, k);
    usd.end_frame(k);
  }
  usd.write();
  const std::string text = text_of(path);
  const std::size_t table = text.find("def Mesh \"table\""), first = text.find("def Mesh \"a_b\""),
                    second = text.find("def Mesh \"a_b_\"");
  ASSERT_TRUE(table < first && first < second && second != std::string::npos) << text;
  EXPECT_EQ(text.substr(table, first - table).find("1: ["), std::string::npos) << "it stands still";
  EXPECT_NE(text.substr(first, second - first).find("2: [(0, 0, 0), (1, 0, 0)"), std::string::npos);
  EXPECT_NE(text.find("1: [],\n        }", second), std::string::npos) << "gone, and once is enough";
}

}  // namespace
}  // namespace tactus
