#pragma once
/// Triangle meshes from and to files.
#include <span>
#include <string>

#include "tactus/geom/image/image.h"
#include "tactus/geom/mesh/mesh.h"

namespace tactus {

struct TexturedMesh;

/// A mesh as it comes from a file: equal vertices are one, and none is there that no triangle uses.
struct ImportedMesh {
  TriangleMesh mesh;
  Vec3d origin_m;  ///< the mesh's zero in the file's coordinates: 0, or the middle of a far mesh
};

/// Whether the extension is one of those that import_mesh reads.
bool is_mesh_path(const std::string& path);
/// ".ply, .obj, ... or .glb", and the nearest to a path's extension where one is near, for messages.
std::string mesh_endings(const std::string& path);
/// Reads a mesh by its extension: .ply (ASCII, binary), .obj, .stl (ASCII, binary), .off (ASCII, binary),
/// .gltf, .glb. Concave polygons are clipped ear by ear. Vertices nearer than 1e-6 of the mesh's size become
/// one. A mesh more than 100 m and ten times its size from the origin of its file is moved there. glTF: all
/// meshes of the scene in their rest pose, with the default weights of their morph targets.
/// @param unit_m metres per unit of length in the file
/// @throws Error naming the file, the line or element and the value: unreadable, no regular file, unknown
/// extension
///         (lists the known), truncated, malformed number, index out of range, vertex not finite, no
///         triangles, more than 4.3 GB, 2^26 vertices or 2^27 triangles.
ImportedMesh import_mesh(const std::string& path, double unit_m = 1);
/// The same in the file's coordinates, which float rounds far from their origin.
TriangleMesh read_mesh(const std::string& path);
/// As read_mesh, from the bytes of the file.
TriangleMesh parse_mesh(const std::string& path, const std::string& bytes);

/// Writes a mesh by its extension: .ply, .obj, .glb or .gltf; PLY to "-", standard output. Either the whole
/// file is there afterwards or nothing is. `colors`: one a vertex, or none; OBJ doesn't hold them.
/// @throws Error: unknown extension (usage), path that can't be written, with the reason.
void write_mesh(const std::string& path, const TriangleMesh& mesh, std::span<const Rgb8> colors = {});
/// Binary little-endian PLY: positions bit for bit, normals when there are any.
void write_ply(const std::string& path, const TriangleMesh& mesh, std::span<const Rgb8> colors = {});
/// OBJ with 9 significant digits: positions come back with the same bits.
void write_obj(const std::string& path, const TriangleMesh& mesh);

/// glTF 2.0, one file: .glb is binary, otherwise all bytes are in the text. `png`: the atlas, encoded, or
/// none when there is no `uv`. A mesh with colours is shown as it is (KHR_materials_unlit): photos hold their
/// light.
/// @throws Error: numbers that don't fit, an empty mesh, a path that can't be written.
void write_gltf(const std::string& path, const TexturedMesh& textured,
                std::span<const std::uint8_t> png = {});

}  // namespace tactus
