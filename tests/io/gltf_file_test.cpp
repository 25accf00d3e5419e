// Written glTF, read again by tinygltf with its pictures decoded, against what was written.
#include <gtest/gtest.h>
#include <tiny_gltf.h>

#include <cmath>
#include <cstring>

#include "io/io_test_files.h"
#include "support/message_of.h"
#include "tactus/geom/mesh/textured_mesh.h"
#include "tactus/io/mesh/mesh_file.h"

namespace tactus {
namespace {

using test::message_of;

// 2 x 2: red, green / blue, white.
constexpr std::uint8_t kPng[] = {0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a, 0x00, 0x00, 0x00, 0x0d, 0x49,
                                 0x48, 0x44, 0x52, 0x00, 0x00, 0x00, 0x02, 0x00, 0x00, 0x00, 0x02, 0x08, 0x02,
                                 0x00, 0x00, 0x00, 0xfd, 0xd4, 0x9a, 0x73, 0x00, 0x00, 0x00, 0x12, 0x49, 0x44,
                                 0x41, 0x54, 0x78, 0x9c, 0x63, 0xf8, 0xcf, 0xc0, 0xc0, 0x00, 0xc2, 0x0c, 0xff,
                                 0x81, 0x00, 0x00, 0x1f, 0xee, 0x05, 0xfb, 0x0b, 0xd9, 0x68, 0x8b, 0x00, 0x00,
                                 0x00, 0x00, 0x49, 0x45, 0x4e, 0x44, 0xae, 0x42, 0x60, 0x82};

TexturedMesh textured_triangles() {
  TexturedMesh t;
  t.mesh.positions_m = {{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {0, 0, -3}};
  t.mesh.normals = {{0, 0, 1}, {0, 0, 1}, {0, 0, 1}, {-1, 0, 0}};
  t.mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  t.uv = {{0.25F, 0.25F}, {0.75F, 0.25F}, {0.25F, 0.75F}, {1, 1}};
  t.colors = {{255, 255, 255}, {255, 255, 255}, {255, 128, 0}, {0, 0, 0}};
  return t;
}

tinygltf::Model reload(const std::string& path) {
  tinygltf::TinyGLTF loader;
  tinygltf::Model model;
  std::string error, warning;
  const bool ok = path.ends_with(".glb") ? loader.LoadBinaryFromFile(&model, &error, &warning, path)
                                         : loader.LoadASCIIFromFile(&model, &error, &warning, path);
  EXPECT_TRUE(ok) << error;
  EXPECT_EQ(error + warning, "");
  return model;
}

template <class T>
std::vector<T> values(const tinygltf::Model& model, int accessor, std::size_t components) {
  const tinygltf::Accessor& a = model.accessors.at(static_cast<std::size_t>(accessor));
  const tinygltf::BufferView& view = model.bufferViews.at(static_cast<std::size_t>(a.bufferView));
  EXPECT_EQ((view.byteOffset + a.byteOffset) % 4, 0U);
  std::vector<T> out(a.count * components);
  EXPECT_EQ(view.byteLength, out.size() * sizeof(T));
  std::memcpy(out.data(), model.buffers.at(0).data.data() + view.byteOffset + a.byteOffset,
              out.size() * sizeof(T));
  return out;
}

TEST(GltfFile, HoldsMeshAtlasAndColours) {
  const TempFolder folder;
  const TexturedMesh t = textured_triangles();
  for (const char* name : {"/a.glb", "/a.gltf"}) {
    write_gltf(folder.path + name, t, kPng);
    const tinygltf::Model model = reload(folder.path + name);
    ASSERT_EQ(model.meshes.size(), 1U);
    const tinygltf::Primitive& p = model.meshes[0].primitives.at(0);
    const std::vector<float> positions = values<float>(model, p.attributes.at("POSITION"), 3);
    EXPECT_EQ(positions, (std::vector<float>{0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0, -3}));
    const tinygltf::Accessor& box = model.accessors[static_cast<std::size_t>(p.attributes.at("POSITION"))];
    EXPECT_EQ(box.minValues, (std::vector<double>{0, 0, -3}));
    EXPECT_EQ(box.maxValues, (std::vector<double>{1, 2, 0}));
    EXPECT_EQ(values<float>(model, p.attributes.at("NORMAL"), 3)[9], -1);
    EXPECT_EQ(values<float>(model, p.attributes.at("TEXCOORD_0"), 2),
              (std::vector<float>{0.25F, 0.25F, 0.75F, 0.25F, 0.25F, 0.75F, 1, 1}));
    EXPECT_EQ(values<std::uint32_t>(model, p.indices, 1), (std::vector<std::uint32_t>{0, 1, 2, 0, 2, 3}));
    // sRGB 128 is 0.2158605 in linear light.
    const std::vector<std::uint16_t> colors = values<std::uint16_t>(model, p.attributes.at("COLOR_0"), 4);
    EXPECT_EQ(colors[8], 65535);
    EXPECT_EQ(colors[9], std::lround(0.2158605 * 65535));
    EXPECT_EQ(colors[10], 0);
    const int texture = model.materials.at(0).pbrMetallicRoughness.baseColorTexture.index;
    const tinygltf::Image& image = model.images.at(
        static_cast<std::size_t>(model.textures.at(static_cast<std::size_t>(texture)).source));
    EXPECT_EQ(image.width, 2);
    EXPECT_EQ(image.height, 2);
    ASSERT_GE(image.image.size(), 4U * static_cast<std::size_t>(image.component));
    const auto texel = [&](int i) { return image.image.data() + i * image.component; };
    EXPECT_EQ(std::vector<int>(texel(0), texel(0) + 3), (std::vector<int>{255, 0, 0}));
    EXPECT_EQ(std::vector<int>(texel(1), texel(1) + 3), (std::vector<int>{0, 255, 0}));
    EXPECT_EQ(std::vector<int>(texel(2), texel(2) + 3), (std::vector<int>{0, 0, 255}));
    EXPECT_EQ(model.materials[0].extensions.count("KHR_materials_unlit"), 1U);
  }
}

TEST(GltfFile, MeshesComeBackAsTheyWere) {
  const TempFolder folder;
  const TexturedMesh t = textured_triangles();
  for (const char* name : {"/b.glb", "/b.gltf"}) {
    write_mesh(folder.path + name, t.mesh);
    const TriangleMesh read = read_mesh(folder.path + name);
    EXPECT_EQ(read.positions_m, t.mesh.positions_m);
    EXPECT_EQ(read.triangles, t.mesh.triangles);
    const tinygltf::Model model = reload(folder.path + name);
    EXPECT_TRUE(model.images.empty());
    EXPECT_TRUE(model.extensionsUsed.empty());
  }
}

TEST(GltfFile, RefusesWhatDoesNotFit) {
  const TempFolder folder;
  const std::string path = folder.path + "/c.glb";
  const auto message = [&](const TexturedMesh& t, std::span<const std::uint8_t> png) -> std::string {
    return message_of([&] { write_gltf(path, t, png); });
  };
  TexturedMesh t = textured_triangles();
  EXPECT_NE(message(t, {}).find("an atlas of 0 bytes"), std::string::npos);
  t.colors.pop_back();
  EXPECT_NE(message(t, kPng).find("3 colours"), std::string::npos);
  EXPECT_NE(message({}, {}).find("no empty mesh"), std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(path));
}

}  // namespace
}  // namespace tactus
