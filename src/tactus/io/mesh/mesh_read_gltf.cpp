#include <algorithm>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string_view>

#include "tactus/base/compared_text.h"
#include "tactus/base/error.h"
#include "tactus/base/foreign_text.h"
#include "tactus/base/printable.h"
#include "tactus/base/read_file.h"
#include "tactus/io/mesh/gltf_accessor.h"
#include "tactus/io/mesh/mesh_reading.h"

namespace tactus::mesh_reading {
namespace {

/// p -> A p + t.
struct Affine {
  Mat3d A = Mat3d::identity();
  Vec3d t{};
  Vec3d operator*(Vec3d p) const { return A * p + t; }
  Affine operator*(const Affine& b) const { return {A * b.A, A * b.t + t}; }
};

/// From 16 numbers, column by column.
template <class Get>
Affine affine_of(const Get& m) {
  Affine a;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) a.A(i, j) = m(4 * j + i);
    a.t[i] = m(12 + i);
  }
  return a;
}

Affine local_transform(const tinygltf::Node& node) {
  if (node.matrix.size() == 16)
    return affine_of([&](int i) { return node.matrix[static_cast<std::size_t>(i)]; });
  Affine a;
  if (const auto& r = node.rotation; r.size() == 4)
    a.A = rotation_matrix(Quat<double>{r[3], r[0], r[1], r[2]});
  if (const auto& s = node.scale; s.size() == 3)
    a.A = a.A * Mat3d{{{s[0], 0, 0}, {0, s[1], 0}, {0, 0, s[2]}}};
  if (const auto& t = node.translation; t.size() == 3) a.t = {t[0], t[1], t[2]};
  return a;
}

class GltfReader {
 public:
  GltfReader(const std::string& path, const tinygltf::Model& model)
      : path_(path), model_(model), world_(model.nodes.size()), visited_(model.nodes.size()) {}

  RawMesh read() {
    if (!model_.scenes.empty()) {
      const int scene = std::max(model_.defaultScene, 0);
      for (const int root : item(model_.scenes, scene, "scene").nodes) place(root, {});
    } else {
      std::vector<char> child(model_.nodes.size(), 0);
      for (const auto& node : model_.nodes) {
        for (const int c : node.children) child[node_index(c)] = 1;
      }
      for (std::size_t i = 0; i < child.size(); ++i) {
        if (!child[i]) place(static_cast<int>(i), {});
      }
    }
    check_budget();
    for (std::size_t i = 0; i < model_.nodes.size(); ++i) {  // after all joints have their place
      if (visited_[i] && model_.nodes[i].mesh >= 0) add_mesh(i);
    }
    return std::move(raw_);
  }

 private:
  [[noreturn]] void fail(const std::string& message) const { throw Error(path_ + ": " + message); }

  template <class T>
  const T& item(const std::vector<T>& items, int i, const char* what) const {
    return gltf_item(path_, items, i, what);
  }
  std::size_t node_index(int i) const {
    item(model_.nodes, i, "node");
    return static_cast<std::size_t>(i);
  }

  /// Places a node and all below it; chains may be long, so they stand in a list and not on the stack.
  void place(int root, const Affine& parent) {
    std::vector<std::pair<int, Affine>> waiting{{root, parent}};
    while (!waiting.empty()) {
      const auto [i, above] = waiting.back();
      waiting.pop_back();
      const std::size_t n = node_index(i);
      if (visited_[n]) fail("node " + std::to_string(i) + " has two parents, expected a tree");
      visited_[n] = 1;
      world_[n] = above * local_transform(model_.nodes[n]);
      for (const int c : model_.nodes[n].children) waiting.emplace_back(c, world_[n]);
    }
  }

  /// A small file may show a large mesh in every node: vertices and corners are counted before they are made.
  void check_budget() const {
    std::size_t vertices = 0, displaced = 0, corners = 0, steps = 0;
    const auto add = [](std::size_t& sum, std::size_t n, std::size_t most) {
      if (n > most - sum) throw TooLarge();
      sum += n;
    };
    constexpr std::size_t kMaxSteps = 10000000;  // joints and primitives of all nodes
    for (std::size_t i = 0; i < model_.nodes.size(); ++i) {
      const tinygltf::Node& node = model_.nodes[i];
      if (!visited_[i] || node.mesh < 0) continue;
      if (node.skin >= 0) add(steps, item(model_.skins, node.skin, "skin").joints.size(), kMaxSteps);
      for (const auto& primitive : item(model_.meshes, node.mesh, "mesh").primitives) {
        add(steps, 1, kMaxSteps);
        const auto position = primitive.attributes.find("POSITION");
        if (position != primitive.attributes.end()) {
          const std::size_t count = item(model_.accessors, position->second, "accessor").count;
          add(vertices, count, kMaxVertices);
          for (std::size_t k = 0; k < primitive.targets.size(); ++k) add(displaced, count, 16 * kMaxVertices);
        }
        if (primitive.indices >= 0)
          add(corners, item(model_.accessors, primitive.indices, "accessor").count, 3 * kMaxTriangles);
      }
    }
  }

  GltfAccessor accessor(int index, const char* what, int components) const {
    return {path_, model_, index, what, components};
  }

  /// Rest pose of a skin: where each joint takes the vertices bound to it.
  std::vector<Affine> joint_transforms(int skin_index) const {
    const auto& skin = item(model_.skins, skin_index, "skin");
    std::vector<Affine> joints;
    for (const int joint : skin.joints) joints.push_back(world_[node_index(joint)]);
    if (skin.inverseBindMatrices < 0) return joints;
    const GltfAccessor inverse_bind = accessor(skin.inverseBindMatrices, "inverseBindMatrices", 16);
    if (inverse_bind.count() < joints.size()) fail("skin " + std::to_string(skin_index) + " lacks matrices");
    for (std::size_t j = 0; j < joints.size(); ++j)
      joints[j] = joints[j] * affine_of([&](int i) { return inverse_bind(j, static_cast<std::size_t>(i)); });
    return joints;
  }

  void add_mesh(std::size_t node) {
    const tinygltf::Node& n = model_.nodes[node];
    std::vector<Affine> joints;
    if (n.skin >= 0) joints = joint_transforms(n.skin);
    const tinygltf::Mesh& mesh = item(model_.meshes, n.mesh, "mesh");
    const std::vector<double>& weights = n.weights.empty() ? mesh.weights : n.weights;
    for (const auto& primitive : mesh.primitives) {
      const bool surface = primitive.mode < 0 || primitive.mode >= TINYGLTF_MODE_TRIANGLES;
      if (surface && primitive.attributes.contains("POSITION"))
        add_primitive(primitive, world_[node], joints, weights);
    }
  }

  void add_primitive(const tinygltf::Primitive& primitive, const Affine& world,
                     const std::vector<Affine>& joints, const std::vector<double>& weights) {
    const auto base = static_cast<std::int64_t>(raw_.positions.size());
    const std::vector<Vec3d> positions = morphed_positions(primitive, weights);
    const bool skinned = !joints.empty() && primitive.attributes.contains("JOINTS_0") &&
                         primitive.attributes.contains("WEIGHTS_0");
    if (skinned) {
      const GltfAccessor joint = accessor(primitive.attributes.at("JOINTS_0"), "JOINTS_0", 4);
      const GltfAccessor weight = accessor(primitive.attributes.at("WEIGHTS_0"), "WEIGHTS_0", 4);
      if (joint.count() < positions.size() || weight.count() < positions.size())
        fail("JOINTS_0 or WEIGHTS_0 has fewer elements than POSITION");
      for (std::size_t i = 0; i < positions.size(); ++i)
        raw_.add_vertex(skinned_position(positions[i], joint, weight, i, joints));
    } else {
      for (const Vec3d p : positions) raw_.add_vertex(world * p);
    }
    const bool mirrored = !skinned && determinant(world.A) < 0;
    add_triangles(primitive, base, positions.size(), mirrored);
  }

  /// Positions and the weighted displacements of the morph targets.
  std::vector<Vec3d> morphed_positions(const tinygltf::Primitive& primitive,
                                       const std::vector<double>& weights) const {
    const GltfAccessor position = accessor(primitive.attributes.at("POSITION"), "POSITION", 3);
    std::vector<Vec3d> positions(position.count());
    for (std::size_t i = 0; i < positions.size(); ++i) positions[i] = position.vec(i);
    for (std::size_t k = 0; k < std::min(weights.size(), primitive.targets.size()); ++k) {
      const auto target = primitive.targets[k].find("POSITION");
      if (weights[k] == 0 || target == primitive.targets[k].end()) continue;
      const GltfAccessor displacement = accessor(target->second, "POSITION of a morph target", 3);
      if (displacement.count() < positions.size())
        fail("morph target " + std::to_string(k) + " has fewer elements than POSITION");
      for (std::size_t i = 0; i < positions.size(); ++i)
        positions[i] = positions[i] + weights[k] * displacement.vec(i);
    }
    return positions;
  }

  Vec3d skinned_position(Vec3d p, const GltfAccessor& joint, const GltfAccessor& weight, std::size_t i,
                         const std::vector<Affine>& joints) const {
    Vec3d sum{};
    double total = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      const double w = weight(i, k);
      if (w == 0) continue;
      const double number = joint(i, k);
      if (!(number >= 0 && number < static_cast<double>(joints.size()))) {
        fail("vertex " + std::to_string(i) + " is bound to joint " + std::to_string(number) +
             ", but there are " + std::to_string(joints.size()));
      }
      const auto j = static_cast<std::size_t>(number);
      sum = sum + w * (joints[j] * p);
      total += w;
    }
    return total > 0 ? (1 / total) * sum : p;
  }

  void add_triangles(const tinygltf::Primitive& primitive, std::int64_t base, std::size_t vertices,
                     bool mirrored) {
    std::vector<std::int64_t> index;
    if (primitive.indices >= 0) {
      const GltfAccessor indices = accessor(primitive.indices, "indices", 1);
      if (!indices.whole_numbers())
        fail("indices (accessor " + std::to_string(primitive.indices) + ") are not whole numbers");
      for (std::size_t i = 0; i < indices.count(); ++i) {
        const auto v = static_cast<std::int64_t>(indices(i, 0));
        if (v < 0 || v >= static_cast<std::int64_t>(vertices)) {
          fail("face " + std::to_string(i / 3) + " refers to vertex " + std::to_string(v) +
               ", but there are " + std::to_string(vertices) + " (counted from 0)");
        }
        index.push_back(base + v);
      }
    } else {
      for (std::size_t i = 0; i < vertices; ++i) index.push_back(base + static_cast<std::int64_t>(i));
    }
    const bool strip = primitive.mode == TINYGLTF_MODE_TRIANGLE_STRIP,
               fan = primitive.mode == TINYGLTF_MODE_TRIANGLE_FAN;
    for (std::size_t i = 2; i < index.size(); i += strip || fan ? 1 : 3) {
      std::array<std::int64_t, 3> corners = {index[fan ? 0 : i - 2], index[i - 1], index[i]};
      const bool odd = strip && i % 2 == 1;
      if (odd != mirrored) std::swap(corners[1], corners[2]);
      raw_.add_face(corners, static_cast<std::int64_t>(raw_.triangles.size()));
    }
  }

  const std::string& path_;
  const tinygltf::Model& model_;
  std::vector<Affine> world_;
  std::vector<char> visited_;
  RawMesh raw_;
};

bool ignore_image(tinygltf::Image*, int, std::string*, std::string*, int, int, const unsigned char*, int,
                  void*) {
  return true;
}

/// The files that a glTF file may name: regular ones in its folder and below.
class BufferFolder {
 public:
  explicit BufferFolder(const std::string& folder)
      : folder_(std::filesystem::weakly_canonical(folder.empty() ? "." : folder)) {}

  /// All of them: tinygltf passes over a set that isn't whole.
  template <class Callbacks = tinygltf::FsCallbacks>
  Callbacks callbacks() {
    Callbacks c{};
    c.FileExists = exists;
    c.ExpandFilePath = expand;
    c.ReadWholeFile = read;
    c.WriteWholeFile = write;
    if constexpr (requires { c.GetFileSizeInBytes; }) c.GetFileSizeInBytes = size;  // since 2.9
    c.user_data = this;
    return c;
  }

 private:
  static bool exists(const std::string& path, void* self) {
    return static_cast<BufferFolder*>(self)->holds(path);
  }
  static std::string expand(const std::string& path, void*) { return path; }
  static bool write(std::string*, const std::string&, const std::vector<unsigned char>&, void*) {
    return false;
  }
  [[maybe_unused]] static bool size(std::size_t* out, std::string* error, const std::string& path,
                                    void* self) {
    std::error_code code;
    *out = static_cast<BufferFolder*>(self)->holds(path) ? std::filesystem::file_size(path, code) : 0;
    if (code) *error += code.message();
    return !code;
  }
  static bool read(std::vector<unsigned char>* out, std::string* error, const std::string& path, void* self) {
    try {
      if (!static_cast<BufferFolder*>(self)->holds(path)) throw Error("it lies outside of the folder");
      const std::string bytes = read_file(path, kMaxMeshBytes, ReadFrom::regular_file);
      out->assign(bytes.begin(), bytes.end());
      return true;
    } catch (const Error& e) {
      *error += e.what();
      return false;
    }
  }
  bool holds(const std::string& path) const {
    std::error_code failed;
    const std::filesystem::path real = std::filesystem::weakly_canonical(path, failed);
    if (failed || !std::filesystem::is_regular_file(real, failed)) return false;
    const auto [rest, end] = std::mismatch(folder_.begin(), folder_.end(), real.begin(), real.end());
    return rest == folder_.end();
  }
  std::filesystem::path folder_;
};

/// The JSON of either kind of file. A GLB begins with magic, version and length, then the JSON chunk's length
/// and kind.
std::string_view json_of(const std::string& path, const std::string& bytes, bool binary) {
  if (!binary) return bytes;
  constexpr std::size_t kHeader = 20;
  std::uint32_t size = 0;
  if (bytes.size() >= kHeader) std::memcpy(&size, bytes.data() + 12, sizeof size);
  if (bytes.size() < kHeader || !bytes.starts_with("glTF") || bytes.compare(16, 4, "JSON") != 0 ||
      size > bytes.size() - kHeader)
    throw Error(path + ": not a valid glTF file: no GLB header, or it is cut short");
  std::string_view json(bytes.data() + kHeader, size);
  while (!json.empty() && json.back() == '\0') json.remove_suffix(1);  // some pad with zeros
  return json;
}

/// Extensions that change no shape: how it looks, and numbers that all readers of accessors understand.
bool is_harmless(std::string_view extension) {
  for (const std::string_view start : {"KHR_materials_", "KHR_texture_", "EXT_texture_", "MSFT_texture_dds",
                                       "KHR_lights_", "KHR_xmp", "KHR_mesh_quantization"}) {
    if (extension.starts_with(start)) return true;
  }
  return false;
}

[[noreturn]] void refuse_extension(const std::string& path, const std::string& name) {
  throw Error(path + ": needs the glTF extension '" + name +
              "', which is not supported; export it without (gltf-transform and Blender can)");
}

/// False where an accessor has nothing to read from: a program packed the mesh, and didn't say that readers
/// have to unpack it.
bool has_all_numbers(const nlohmann::json& json) {
  const auto accessors = json.find("accessors");
  if (accessors == json.end() || !accessors->is_array()) return true;
  return std::all_of(accessors->begin(), accessors->end(), [](const nlohmann::json& a) {
    return !a.is_object() || a.contains("bufferView") || a.contains("sparse");
  });
}

/// Refuses required extensions unless they are harmless; instances also where they are not required, as their
/// bodies would be missing.
void check_extensions(const std::string& path, const nlohmann::json& json) {
  const auto each = [&](const char* list, auto&& check) {
    const auto found = json.find(list);
    if (found == json.end() || !found->is_array()) return;
    for (const nlohmann::json& name : *found) {
      if (name.is_string()) check(name.get<std::string>());
    }
  };
  each("extensionsRequired", [&](const std::string& name) {
    if (!is_harmless(name)) refuse_extension(path, printable(name));
  });
  each("extensionsUsed", [&](const std::string& name) {
    const bool lacks_numbers = name == "KHR_draco_mesh_compression" && !has_all_numbers(json);
    if (name == "EXT_mesh_gpu_instancing" || lacks_numbers) refuse_extension(path, name);
  });
}

/// tinygltf recurses with the nesting and copies the binary chunk into every buffer without a URI.
void check_json(const std::string& path, std::string_view text) {
  check_foreign_text(text, TextSyntax::json, path);
  const nlohmann::json json = nlohmann::json::parse(text, nullptr, false);
  if (json.is_object()) check_extensions(path, json);
  const auto buffers = json.is_object() ? json.find("buffers") : json.end();
  if (!json.is_object() || buffers == json.end() || !buffers->is_array()) return;
  double bytes = 0;
  for (const nlohmann::json& buffer : *buffers) {
    const auto length = buffer.is_object() ? buffer.find("byteLength") : buffer.end();
    if (buffer.is_object() && length != buffer.end() && length->is_number()) bytes += length->get<double>();
  }
  if (bytes > static_cast<double>(kMaxMeshBytes))
    throw Error(path + ": its buffers take " + bytes_text(bytes, static_cast<double>(kMaxMeshBytes)) +
                ", expected at most " + bytes_text(static_cast<double>(kMaxMeshBytes)));
}

}  // namespace

RawMesh read_gltf(const std::string& path, const std::string& bytes, bool binary) {
  check_json(path, json_of(path, bytes, binary));
  const std::string folder = std::filesystem::path(path).parent_path().string();
  BufferFolder files(folder);
  tinygltf::TinyGLTF loader;
  loader.SetFsCallbacks(files.callbacks());
  loader.SetImageLoader(ignore_image, nullptr);  // pictures aren't needed
  tinygltf::Model model;
  std::string error, warning;
  const auto size = static_cast<unsigned>(bytes.size());
  bool ok = false;
  try {
    ok = binary
             ? loader.LoadBinaryFromMemory(&model, &error, &warning,
                                           reinterpret_cast<const unsigned char*>(bytes.data()), size, folder)
             : loader.LoadASCIIFromString(&model, &error, &warning, bytes.data(), size, folder);
  } catch (const std::exception& e) {
    error = e.what();
  }
  if (!ok) {
    std::replace(error.begin(), error.end(), '\n', ' ');
    const bool missing = error.find("File not found") != std::string::npos;
    throw Error(path + ": not a valid glTF file: " + error +
                (missing ? "(buffers must be regular files in the folder of the glTF file)" : ""));
  }
  return GltfReader(path, model).read();
}

}  // namespace tactus::mesh_reading
