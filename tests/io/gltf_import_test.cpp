// What glTF files of other programs hold beside plain accessors: sparse ones, morph targets, extensions.
#include <gtest/gtest.h>

#include "io/io_test_files.h"
#include "support/message_of.h"
#include "tactus/io/mesh/mesh_file.h"

namespace tactus {
namespace {

using test::message_of;

/// A tetrahedron in "data.bin": positions at 0, indices at 48, an index at 72 and the displacement (0, 0, 2)
/// of vertex 3 at 76.
std::string tetrahedron_buffer() {
  std::string bytes;
  const auto add = [&](auto value) { bytes.append(reinterpret_cast<const char*>(&value), sizeof value); };
  for (const Vec3f p : {Vec3f{0, 0, 0}, Vec3f{1, 0, 0}, Vec3f{0, 1, 0}, Vec3f{0, 0, 1}}) add(p);
  for (const std::uint16_t v : {0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3}) add(v);
  add(std::uint32_t{3});
  add(Vec3f{0, 0, 2});
  return bytes;
}

/// @param position how accessor 0 goes on @param primitive, mesh, node, top: more of each
std::string gltf(const std::string& position, const std::string& primitive = "", const std::string& mesh = "",
                 const std::string& node = "", const std::string& top = "") {
  return R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0)" +
         node + R"(}], "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1)" + primitive +
         "}]" + mesh +
         R"(}], "buffers": [{"byteLength": 88, "uri": "data.bin"}],
  "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 24},
                  {"buffer": 0, "byteOffset": 72, "byteLength": 4}, {"buffer": 0, "byteOffset": 76, "byteLength": 12}],
  "accessors": [{"componentType": 5126, "count": 4, "type": "VEC3")" +
         position + R"(}, {"bufferView": 1, "componentType": 5123, "count": 12, "type": "SCALAR"},
    {"componentType": 5126, "count": 4, "type": "VEC3",
     "sparse": {"count": 1, "indices": {"bufferView": 2, "componentType": 5125}, "values": {"bufferView": 3}}}])" +
         top + "}";
}
const std::string kView = R"(, "bufferView": 0)";
std::string sparse_at(const std::string& count, const std::string& type = "5125") {
  return kView + R"(, "sparse": {"count": )" + count + R"(, "indices": {"bufferView": 2, "componentType": )" +
         type + R"(}, "values": {"bufferView": 3}})";
}

double volume_of(const std::string& text) {
  const TempFolder folder;
  folder.write("data.bin", tetrahedron_buffer());
  const TriangleMesh mesh = read_mesh(folder.write("a.gltf", text));
  EXPECT_TRUE(topology(mesh).closed_manifold());
  return volume_m3(mesh);
}
std::string error_of(const std::string& text) {
  const TempFolder folder;
  folder.write("data.bin", tetrahedron_buffer());
  const std::string message = message_of([&] { read_mesh(folder.write("a.gltf", text)); });
  return message.starts_with(folder.path) ? message.substr(folder.path.size() + 1) : message;
}

constexpr double kRounding = 1e-6;

TEST(GltfImport, SparseAccessors) {
  EXPECT_NEAR(volume_of(gltf(kView)), 1. / 6, kRounding);
  EXPECT_NEAR(volume_of(gltf(sparse_at("1"))), 2. / 6, kRounding);  // vertex 3 stands at z = 2
  EXPECT_NEAR(volume_of(gltf(sparse_at("1", "5121"))), 2. / 6, kRounding);
  EXPECT_EQ(error_of(gltf(sparse_at("2"))),
            "a.gltf: POSITION (accessor 0) reaches beyond its buffer of 88 bytes");
  EXPECT_EQ(error_of(gltf(sparse_at("1", "5126"))),
            "a.gltf: POSITION (accessor 0) is sparse with 1 values and indices of type 5126, expected 5121, "
            "5123 or "
            "5125");
  std::string few = gltf(sparse_at("1"));
  few.replace(few.find(R"("count": 4)"), 10, R"("count": 3)");
  EXPECT_EQ(error_of(few),
            "a.gltf: POSITION (accessor 0) is sparse and replaces element 3 of 3, expected growing numbers "
            "below that");
}

/// Signed integers and doubles are no components of glTF; parsers know them.
TEST(GltfImport, RefusesComponentsThatGltfDoesNotHave) {
  for (const std::string type : {"5124", "5130"}) {
    std::string text = gltf(kView);
    text.replace(text.find("5123"), 4, type);
    EXPECT_NE(error_of(text).find("indices (accessor 1) has an unknown component type"), std::string::npos)
        << error_of(text);
  }
}

TEST(GltfImport, MorphTargetsByTheirWeights) {
  const std::string target = R"(, "targets": [{"POSITION": 2}])";
  EXPECT_NEAR(volume_of(gltf(kView, target)), 1. / 6, kRounding);
  EXPECT_NEAR(volume_of(gltf(kView, target, R"(, "weights": [0.5])")), 2. / 6, kRounding);
  // A node's own weights go first.
  EXPECT_NEAR(volume_of(gltf(kView, target, R"(, "weights": [0.5])", R"(, "weights": [1])")), 3. / 6,
              kRounding);
  EXPECT_NEAR(
      volume_of(gltf(kView, R"(, "targets": [{"NORMAL": 2}, {"POSITION": 2}])", R"(, "weights": [1, 2])")),
      5. / 6, kRounding);
}

TEST(GltfImport, RefusesRequiredExtensionsByName) {
  const auto with = [](const std::string& list, const std::string& name) {
    return gltf(kView, "", "", "", ", \"" + list + "\": [\"" + name + "\"]");
  };
  for (const std::string name : {"KHR_draco_mesh_compression", "EXT_meshopt_compression",
                                 "EXT_mesh_gpu_instancing", "VENDOR_of_the_future"}) {
    EXPECT_EQ(error_of(with("extensionsRequired", name)),
              "a.gltf: needs the glTF extension '" + name +
                  "', which is not supported; export it without (gltf-transform and Blender can)");
  }
  // Instances would lack, whether they are required or not.
  EXPECT_NE(error_of(with("extensionsUsed", "EXT_mesh_gpu_instancing")), "");
  EXPECT_NEAR(volume_of(with("extensionsUsed", "KHR_draco_mesh_compression")), 1. / 6, kRounding);
  // Packed, and not said to be required: there are no numbers beside.
  EXPECT_NE(error_of(gltf("", "", "", "", R"(, "extensionsUsed": ["KHR_draco_mesh_compression"])"))
                .find("needs the glTF extension 'KHR_draco_mesh_compression'"),
            std::string::npos);
  EXPECT_NEAR(volume_of(with("extensionsRequired", "KHR_materials_unlit")), 1. / 6, kRounding);
  EXPECT_NEAR(volume_of(with("extensionsRequired", "KHR_mesh_quantization")), 1. / 6, kRounding);
}

/// Each kind under the other's name.
TEST(GltfImport, KindsAreToldByContent) {
  const TempFolder folder;
  folder.write("data.bin", tetrahedron_buffer());
  EXPECT_NEAR(volume_m3(read_mesh(folder.write("a.glb", gltf(kView)))), 1. / 6, kRounding);
  std::string json = gltf(kView);
  json.append((4 - json.size() % 4) % 4, ' ');
  const auto word = [](std::size_t n) {
    const auto value = static_cast<std::uint32_t>(n);
    return std::string(reinterpret_cast<const char*>(&value), sizeof value);
  };
  const std::string binary = "glTF" + word(2) + word(20 + json.size()) + word(json.size()) + "JSON" + json;
  EXPECT_NEAR(volume_m3(read_mesh(folder.write("b.gltf", binary))), 1. / 6, kRounding);
}

}  // namespace
}  // namespace tactus
