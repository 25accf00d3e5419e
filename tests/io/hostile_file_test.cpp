// Files that ask for more than they are: memory, stack, other files.
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <filesystem>

#include "io/io_test_files.h"
#include "support/message_of.h"
#include "tactus/io/labels/label_file.h"
#include "tactus/io/mesh/mesh_file.h"

namespace tactus {
namespace {

namespace fs = std::filesystem;
using test::message_of;

/// Largest resident size so far.
std::int64_t peak_memory_bytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return std::int64_t{usage.ru_maxrss} * 1024;
}

std::string read_error(const std::string& path) {
  return message_of([&] { read_mesh(path); });
}

/// A triangle of one buffer; `nodes` and `more` as JSON, the buffer's URI as given.
std::string gltf_of(const std::string& nodes, const std::string& uri, const std::string& more = "") {
  return R"({"asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "scene": 0, "nodes": [)" + nodes +
         R"(], "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
  "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
  "bufferViews": [{"buffer": 0, "byteLength": 36}], "buffers": [{"uri": ")" +
         uri + R"(", "byteLength": 36}])" + more + "}";
}
std::string triangle_bytes() {
  const float corners[] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  return {reinterpret_cast<const char*>(corners), sizeof corners};
}

TEST(HostileFile, GltfOpensOnlyRegularFilesInItsFolder) {
  const TempFolder folder;
  folder.write("out.bin", triangle_bytes());
  fs::create_directories(folder.path + "/in/sub");
  folder.write("in/sub/a.bin", triangle_bytes());
  ASSERT_EQ(mkfifo((folder.path + "/in/fifo").c_str(), 0600), 0);
  fs::create_symlink("../out.bin", folder.path + "/in/link");
  const auto read = [&](const std::string& uri) {
    return read_error(folder.write("in/a.gltf", gltf_of(R"({"mesh": 0})", uri)));
  };
  EXPECT_EQ(read("sub/a.bin"), "");
  for (const std::string uri :
       {"../out.bin", "fifo", "link", "/dev/zero", "sub/../../out.bin", "%2e%2e/out.bin"}) {
    EXPECT_TRUE(read(uri).starts_with(folder.path + "/in/a.gltf: not a valid glTF file: File not found"))
        << uri;
    EXPECT_TRUE(read(uri).ends_with("(buffers must be regular files in the folder of the glTF file)")) << uri;
  }
  // tinygltf looks in the working folder, too.
  const fs::path before = fs::current_path();
  fs::current_path(folder.path);
  EXPECT_NE(read("out.bin"), "");
  fs::current_path(before);
}

TEST(HostileFile, GltfNestingAndChainsDoNotReachTheStack) {
  const TempFolder folder;
  folder.write("a.bin", triangle_bytes());
  const auto repeated = [](const std::string& text, int count) {
    std::string all;
    for (int i = 0; i < count; ++i) all += text;
    return all;
  };
  const std::string nested = R"(, "extras": )" + repeated("[", 15000) + repeated("]", 15000);
  const std::string deep = folder.path + "/deep.gltf:3: nested more than 64 deep";
  EXPECT_EQ(read_error(folder.write("deep.gltf", gltf_of(R"({"mesh": 0})", "a.bin", nested))), deep);
  std::string chain;
  for (int i = 1; i < 100000; ++i) chain += R"({"children": [)" + std::to_string(i) + "]},";
  EXPECT_EQ(read_error(folder.write("chain.gltf", gltf_of(chain + R"({"mesh": 0})", "a.bin"))), "");
}

/// Files of some hundred kilobytes that ask for many gigabytes.
TEST(HostileFile, BudgetsAreCheckedBeforeMemoryIsTaken) {
  const TempFolder folder;
  folder.write("a.bin", triangle_bytes());
  const std::string expected = ": too large, expected at most 67108864 vertices and 134217728 triangles";
  std::string crowd;
  for (int i = 1; i <= 25000; ++i) crowd += (i == 1 ? "" : ", ") + std::to_string(i);
  crowd = R"({"children": [)" + crowd + "]}";
  for (int i = 1; i <= 25000; ++i) crowd += R"(, {"mesh": 0})";
  std::string gltf = gltf_of(crowd, "a.bin");
  gltf.replace(gltf.find(R"("count": 3)"), 10, R"("count": 3000)");  // of which no buffer is asked before
  EXPECT_EQ(read_error(folder.write("crowd.gltf", gltf)), folder.path + "/crowd.gltf" + expected);
  gltf.replace(gltf.find(R"("count": 3000)"), 13, R"("count": 18446744073709551615)");
  EXPECT_EQ(read_error(folder.write("wrap.gltf", gltf)), folder.path + "/wrap.gltf" + expected);
  // Every buffer without a URI is a copy of a GLB's binary chunk.
  std::string json = R"({"asset": {"version": "2.0"}, "buffers": [{"byteLength": 9000000000}]})";
  json.resize((json.size() + 3) / 4 * 4, ' ');
  const auto word = [](std::size_t n) {
    const auto value = static_cast<std::uint32_t>(n);
    return std::string(reinterpret_cast<const char*>(&value), 4);
  };
  const std::string glb = "glTF" + word(2) + word(20 + json.size()) + word(json.size()) + "JSON" + json;
  EXPECT_EQ(read_error(folder.write("copies.glb", glb)),
            folder.path + "/copies.glb: its buffers take 9.0 GB, expected at most 4.3 GB");
}

/// Two gigabytes in a header of 256 bytes.
TEST(HostileFile, LabelVolumeTakesMemoryAsItsBytesCome) {
  std::string header =
      "#INRIMAGE-4#{\nXDIM=2047\nYDIM=1024\nZDIM=1024\nVDIM=1\nTYPE=unsigned fixed\nPIXSIZE=8 bits\n"
      "CPU=decm\nVX=1\nVY=1\nVZ=1\n";
  header.resize(252, '\n');
  const TempFolder folder;
  const std::string path = folder.write("a.inr", header + "##}\n" + "abc");
  const std::int64_t before = peak_memory_bytes();
  EXPECT_EQ(message_of([&] { read_label_volume(path); }),
            path + ": truncated, it holds 3 of 2146435072 voxels");
  EXPECT_LT(peak_memory_bytes() - before, 500000000);
}

}  // namespace
}  // namespace tactus
