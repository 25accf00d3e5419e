#include <tiny_gltf.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <sstream>

#include "tactus/base/error.h"
#include "tactus/base/safe_file.h"
#include "tactus/geom/mesh/textured_mesh.h"
#include "tactus/io/mesh/mesh_file.h"

namespace tactus {
namespace {

/// glTF multiplies vertex colours in linear light.
std::uint16_t to_linear16(std::uint8_t srgb) {
  const double s = srgb / 255.0;
  const double linear = s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4);
  return static_cast<std::uint16_t>(std::lround(65535 * linear));
}

class GltfWriter {
 public:
  GltfWriter() {
    model_.asset.version = "2.0";
    model_.asset.generator = "tactus";
    model_.buffers.resize(1);
  }

  /// Appends the values as an accessor; returns its number.
  template <class T>
  int add(const std::vector<T>& values, int target, int component, int type) {
    const int view = add_bytes(values.data(), values.size() * sizeof(T), target);
    tinygltf::Accessor accessor;
    accessor.bufferView = view;
    accessor.componentType = component;
    accessor.type = type;
    accessor.count = values.size();
    model_.accessors.push_back(accessor);
    return static_cast<int>(model_.accessors.size()) - 1;
  }
  int add_bytes(const void* data, std::size_t bytes, int target) {
    std::vector<unsigned char>& buffer = model_.buffers[0].data;
    buffer.resize((buffer.size() + 3) / 4 * 4);  // accessors lie on multiples of four
    tinygltf::BufferView view;
    view.buffer = 0;
    view.byteOffset = buffer.size();
    view.byteLength = bytes;
    view.target = target;
    const auto* first = static_cast<const unsigned char*>(data);
    buffer.insert(buffer.end(), first, first + bytes);
    model_.bufferViews.push_back(view);
    return static_cast<int>(model_.bufferViews.size()) - 1;
  }
  void add_atlas(std::span<const std::uint8_t> png) {
    tinygltf::Image image;
    image.name = "atlas";
    image.mimeType = "image/png";
    image.bufferView = add_bytes(png.data(), png.size(), 0);
    model_.images.push_back(image);
    tinygltf::Sampler sampler;
    sampler.minFilter = TINYGLTF_TEXTURE_FILTER_LINEAR;  // mipmaps would mix neighbouring photos
    sampler.magFilter = TINYGLTF_TEXTURE_FILTER_LINEAR;
    sampler.wrapS = sampler.wrapT = TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE;
    model_.samplers.push_back(sampler);
    tinygltf::Texture texture;
    texture.sampler = 0;
    texture.source = 0;
    model_.textures.push_back(texture);
  }
  tinygltf::Model& model() { return model_; }

  std::string finish(bool binary) {
    tinygltf::Node node;
    node.mesh = 0;
    model_.nodes.push_back(node);
    tinygltf::Scene scene;
    scene.nodes = {0};
    model_.scenes.push_back(scene);
    model_.defaultScene = 0;
    std::ostringstream stream;
    tinygltf::TinyGLTF writer;
    if (!writer.WriteGltfSceneToStream(&model_, stream, !binary, binary)) return {};
    return std::move(stream).str();
  }

 private:
  tinygltf::Model model_;
};

void check_textured(const std::string& path, const TexturedMesh& textured,
                    std::span<const std::uint8_t> png) {
  const std::size_t n = textured.mesh.positions_m.size();
  const auto fits = [n](std::size_t size) { return size == 0 || size == n; };
  if (!fits(textured.mesh.normals.size()) || !fits(textured.uv.size()) || !fits(textured.colors.size()) ||
      textured.uv.empty() != png.empty())
    throw Error("can't write '" + path + "': " + std::to_string(n) + " vertices with " +
                std::to_string(textured.mesh.normals.size()) + " normals, " +
                std::to_string(textured.uv.size()) + " places in an atlas of " + std::to_string(png.size()) +
                " bytes and " + std::to_string(textured.colors.size()) +
                " colours, expected one a vertex or none");
  if (n == 0 || textured.mesh.triangles.empty())
    throw Error("can't write '" + path + "': glTF holds no empty mesh, and there is no surface");
}

}  // namespace

void write_gltf(const std::string& path, const TexturedMesh& textured, std::span<const std::uint8_t> png) {
  check_textured(path, textured, png);
  const TriangleMesh& mesh = textured.mesh;
  GltfWriter gltf;
  tinygltf::Primitive primitive;
  primitive.mode = TINYGLTF_MODE_TRIANGLES;
  const auto attribute = [&](const char* name, const auto& values, int component, int type) {
    if (values.empty()) return;
    primitive.attributes[name] = gltf.add(values, TINYGLTF_TARGET_ARRAY_BUFFER, component, type);
  };
  attribute("POSITION", mesh.positions_m, TINYGLTF_COMPONENT_TYPE_FLOAT, TINYGLTF_TYPE_VEC3);
  const Box3f box = bounds(mesh);
  tinygltf::Accessor& positions = gltf.model().accessors.back();
  for (int i = 0; i < 3; ++i) {
    positions.minValues.push_back(static_cast<double>(box.min[i]));
    positions.maxValues.push_back(static_cast<double>(box.max[i]));
  }
  attribute("NORMAL", mesh.normals, TINYGLTF_COMPONENT_TYPE_FLOAT, TINYGLTF_TYPE_VEC3);
  attribute("TEXCOORD_0", textured.uv, TINYGLTF_COMPONENT_TYPE_FLOAT, TINYGLTF_TYPE_VEC2);
  std::vector<std::array<std::uint16_t, 4>> colors;
  for (const Rgb8 c : textured.colors)
    colors.push_back({to_linear16(c.r), to_linear16(c.g), to_linear16(c.b), 65535});
  attribute("COLOR_0", colors, TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT, TINYGLTF_TYPE_VEC4);
  if (!colors.empty()) gltf.model().accessors.back().normalized = true;
  primitive.indices = gltf.add(mesh.triangles, TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER,
                               TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT, TINYGLTF_TYPE_SCALAR);
  gltf.model().accessors.back().count = 3 * mesh.triangles.size();
  tinygltf::Material material;
  material.pbrMetallicRoughness.metallicFactor = 0;
  if (!png.empty()) {
    gltf.add_atlas(png);
    material.pbrMetallicRoughness.baseColorTexture.index = 0;
  }
  if (!png.empty() || !colors.empty()) {  // photos hold their light already
    material.extensions["KHR_materials_unlit"] = tinygltf::Value(tinygltf::Value::Object{});
    gltf.model().extensionsUsed.emplace_back("KHR_materials_unlit");
  }
  primitive.material = 0;
  gltf.model().materials.push_back(material);
  tinygltf::Mesh out;
  out.primitives.push_back(primitive);
  gltf.model().meshes.push_back(out);
  const std::string bytes =
      gltf.finish(path.size() >= 4 && (path.ends_with(".glb") || path.ends_with(".GLB")));
  if (bytes.empty()) throw Error("can't write '" + path + "': the glTF encoder failed");
  write_file(path, bytes);
}

}  // namespace tactus
