#include "tactus/io/mesh_file.h"

#include <algorithm>
#include <bit>
#include <cstdio>
#include <filesystem>
#include <unordered_map>

#include "tactus/base/error.h"
#include "tactus/base/read_file.h"
#include "tactus/base/safe_file.h"
#include "tactus/io/mesh_reading.h"

namespace tactus {
namespace {

namespace read = mesh_reading;

std::string extension_of(const std::string& path) {
  std::string extension = std::filesystem::path(path).extension().string();
  for (char& c : extension) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return extension;
}

void check_extension(const std::string& path) {
  const std::string extension = extension_of(path);
  static const std::vector<std::string> known = {".ply", ".obj", ".stl", ".off", ".gltf", ".glb"};
  if (std::find(known.begin(), known.end(), extension) != known.end()) return;
  throw usage_error("can't read '" + path + "': unknown extension '" + extension +
                    "', expected .ply, .obj, .stl, .off, .gltf or .glb");
}

read::RawMesh parse_raw(const std::string& path, const std::string& bytes) {
  const std::string extension = extension_of(path);
  if (extension == ".ply") return read::read_ply(path, bytes);
  if (extension == ".obj") return read::read_obj(path, bytes);
  if (extension == ".off") return read::read_off(path, bytes);
  if (extension == ".stl") return read::read_stl(path, bytes);
  return read::read_gltf(path, bytes, extension == ".glb");
}

void check_counts(const std::string& path, const TriangleMesh& mesh, std::span<const Rgb8> colors) {
  const std::size_t n = mesh.positions_m.size();
  if ((!mesh.normals.empty() && mesh.normals.size() != n) || (!colors.empty() && colors.size() != n)) {
    throw Error("can't write '" + path + "': " + std::to_string(n) + " vertices with " +
                std::to_string(mesh.normals.size()) + " normals and " + std::to_string(colors.size()) +
                " colours, expected one a vertex or none");
  }
}

template <class T>
void append(std::string& bytes, const T& value) {
  static_assert(std::endian::native == std::endian::little);
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

struct PositionHash {
  std::size_t operator()(Vec3f p) const {
    std::uint64_t h = 0;
    for (int i = 0; i < 3; ++i) h = (h ^ std::bit_cast<std::uint32_t>(p[i])) * 0x9e3779b97f4a7c15ULL;
    return h ^ (h >> 32);
  }
};

}  // namespace

TriangleMesh read_mesh(const std::string& path) {
  check_extension(path);
  return parse_mesh(path, read_file(path, kMaxMeshBytes));
}

TriangleMesh parse_mesh(const std::string& path, const std::string& bytes) {
  check_extension(path);
  const std::string extension = extension_of(path);
  TriangleMesh mesh;
  try {
    mesh = read::finish(path, parse_raw(path, bytes));
  } catch (const read::TooLarge&) {
    throw Error(path + ": too large, expected at most " + std::to_string(read::kMaxVertices) +
                " vertices and " + std::to_string(read::kMaxTriangles) + " triangles");
  }
  if (extension != ".stl" && extension != ".gltf" && extension != ".glb") return mesh;
  TriangleMesh welded = weld_exact(mesh);
  if (welded.triangles.empty())
    throw Error(path + ": all its triangles are points or lines, expected a surface");
  return welded;
}

void write_mesh(const std::string& path, const TriangleMesh& mesh, std::span<const Rgb8> colors) {
  const std::string extension = path == "-" ? ".ply" : extension_of(path);
  if (extension == ".ply") {
    write_ply(path, mesh, colors);
  } else if (extension == ".obj") {
    write_obj(path, mesh);
  } else if (extension == ".glb" || extension == ".gltf") {
    check_counts(path, mesh, colors);
    write_gltf(path, {.mesh = mesh, .uv = {}, .colors = {colors.begin(), colors.end()}, .atlas = {}});
  } else {
    throw usage_error("can't write '" + path + "': unknown extension '" + extension +
                      "', expected .ply, .obj, .glb or .gltf");
  }
}

void write_ply(const std::string& path, const TriangleMesh& mesh, std::span<const Rgb8> colors) {
  check_counts(path, mesh, colors);
  const bool normals = !mesh.normals.empty();
  std::string bytes = "ply\nformat binary_little_endian 1.0\ncomment metres\nelement vertex " +
                      std::to_string(mesh.positions_m.size()) +
                      "\nproperty float x\nproperty float y\nproperty float z\n";
  if (normals) bytes += "property float nx\nproperty float ny\nproperty float nz\n";
  if (!colors.empty()) bytes += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
  bytes += "element face " + std::to_string(mesh.triangles.size()) +
           "\nproperty list uchar int vertex_indices\nend_header\n";
  bytes.reserve(bytes.size() + mesh.positions_m.size() * 27 + mesh.triangles.size() * 13);
  for (std::size_t i = 0; i < mesh.positions_m.size(); ++i) {
    append(bytes, mesh.positions_m[i]);
    if (normals) append(bytes, mesh.normals[i]);
    if (!colors.empty()) append(bytes, colors[i]);
  }
  for (const std::array<Index, 3>& triangle : mesh.triangles) {
    append(bytes, std::uint8_t{3});
    append(bytes, triangle);
  }
  write_file(path, bytes);
}

void write_obj(const std::string& path, const TriangleMesh& mesh) {
  check_counts(path, mesh, {});
  std::string text = "# metres\n";
  char line[128];
  const auto write_vectors = [&](const char* key, const std::vector<Vec3f>& vectors) {
    for (const Vec3f v : vectors) {
      const int n = std::snprintf(line, sizeof line, "%s %.9g %.9g %.9g\n", key, static_cast<double>(v.x),
                                  static_cast<double>(v.y), static_cast<double>(v.z));
      text.append(line, static_cast<std::size_t>(n));
    }
  };
  write_vectors("v", mesh.positions_m);
  write_vectors("vn", mesh.normals);
  const bool normals = !mesh.normals.empty();
  for (const auto& [a, b, c] : mesh.triangles) {
    const int i = a + 1, j = b + 1, k = c + 1;  // OBJ counts from 1
    const int n = normals ? std::snprintf(line, sizeof line, "f %d//%d %d//%d %d//%d\n", i, i, j, j, k, k)
                          : std::snprintf(line, sizeof line, "f %d %d %d\n", i, j, k);
    text.append(line, static_cast<std::size_t>(n));
  }
  write_file(path, text);
}

TriangleMesh weld_exact(const TriangleMesh& mesh) {
  TriangleMesh welded;
  std::unordered_map<Vec3f, Index, PositionHash> index_of;
  index_of.reserve(mesh.positions_m.size());
  std::vector<Index> target(mesh.positions_m.size());
  for (std::size_t i = 0; i < target.size(); ++i) {
    const Vec3f p = mesh.positions_m[i] + Vec3f{};  // + 0 turns -0 into 0: one hash for both
    const auto [found, added] = index_of.try_emplace(p, static_cast<Index>(welded.positions_m.size()));
    if (added) welded.positions_m.push_back(p);
    target[i] = found->second;
  }
  for (const auto& [a, b, c] : mesh.triangles) {
    const std::array<Index, 3> t = {target[static_cast<std::size_t>(a)], target[static_cast<std::size_t>(b)],
                                    target[static_cast<std::size_t>(c)]};
    if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) welded.triangles.push_back(t);
  }
  return welded;
}

}  // namespace tactus
