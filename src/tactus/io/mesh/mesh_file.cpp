#include "tactus/io/mesh/mesh_file.h"
#include "tactus/geom/mesh/textured_mesh.h"

#include <algorithm>
#include <bit>
#include <cstdio>
#include <filesystem>
#include <iterator>
#include <string_view>

#include "tactus/base/error.h"
#include "tactus/base/read_file.h"
#include "tactus/base/safe_file.h"
#include "tactus/io/mesh/mesh_import.h"

namespace tactus {
namespace {

namespace read = mesh_reading;

std::string extension_of(const std::string& path) {
  return read::lower_case(std::filesystem::path(path).extension().string());
}

constexpr const char* kEndings = ".ply, .obj, .stl, .off, .gltf or .glb";

std::span<const std::string> known_extensions() {
  static const std::vector<std::string> known = {".ply", ".obj", ".stl", ".off", ".gltf", ".glb"};
  return known;
}

/// A label volume is told of as such.
std::string hint_of(const std::string& path) {
  static const std::string_view kLabels[] = {".nii", ".nii.gz", ".nrrd", ".nhdr",
                                             ".mha", ".mhd",    ".inr",  ".inr.gz"};
  const std::string name = read::lower_case(path);
  if (std::any_of(std::begin(kLabels), std::end(kLabels),
                  [&](auto ending) { return name.ends_with(ending); }))
    return "; a label volume is a body's shape with 'kind: labels'";
  return "";
}

void check_extension(const std::string& path) {
  if (is_mesh_path(path)) return;
  throw usage_error("can't read '" + path + "': unknown extension '" + extension_of(path) + "', expected " +
                    mesh_endings(path) + hint_of(path));
}

read::RawMesh parse_raw(const std::string& path, const std::string& bytes) {
  const std::string extension = extension_of(path);
  if (extension == ".ply") return read::read_ply(path, bytes);
  if (extension == ".obj") return read::read_obj(path, bytes);
  if (extension == ".off") return read::read_off(path, bytes);
  if (extension == ".stl") return read::read_stl(path, bytes);
  // Some are named as the other kind.
  const bool is_text =
      bytes.find_first_not_of(" \t\r\n") != bytes.npos && bytes[bytes.find_first_not_of(" \t\r\n")] == '{';
  return read::read_gltf(path, bytes, bytes.starts_with("glTF") || (extension == ".glb" && !is_text));
}

ImportedMesh parse(const std::string& path, const std::string& bytes, double unit_m) {
  if (bytes.empty()) throw Error(path + ": the file is empty");
  try {
    return read::import_raw(path, parse_raw(path, bytes), unit_m);
  } catch (const read::TooLarge&) {
    throw Error(path + ": too large, expected at most " + std::to_string(read::kMaxVertices) +
                " vertices and " + std::to_string(read::kMaxTriangles) + " triangles");
  }
}

TriangleMesh in_file_coordinates(ImportedMesh&& imported) {
  if (imported.origin_m == Vec3d{}) return std::move(imported.mesh);
  for (Vec3f& p : imported.mesh.positions_m) p = vec_cast<float>(vec_cast<double>(p) + imported.origin_m);
  return std::move(imported.mesh);
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

}  // namespace

bool is_mesh_path(const std::string& path) {
  const std::span<const std::string> known = known_extensions();
  return std::find(known.begin(), known.end(), extension_of(path)) != known.end();
}

std::string mesh_endings(const std::string& path) {
  const std::string near = nearest_spelling(extension_of(path), known_extensions());
  return kEndings + (near.empty() ? "" : "; did you mean '" + near + "'?");
}

ImportedMesh import_mesh(const std::string& path, double unit_m) {
  check_extension(path);
  return parse(path, read_file(path, kMaxMeshBytes, ReadFrom::regular_file), unit_m);
}

TriangleMesh read_mesh(const std::string& path) { return in_file_coordinates(import_mesh(path)); }

TriangleMesh parse_mesh(const std::string& path, const std::string& bytes) {
  check_extension(path);
  return in_file_coordinates(parse(path, bytes, 1));
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

}  // namespace tactus
