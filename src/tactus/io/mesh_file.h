#pragma once
/// Triangle meshes from and to files.
#include <span>
#include <string>

#include "tactus/geom/image.h"
#include "tactus/geom/mesh.h"
#include "tactus/geom/textured_mesh.h"

namespace tactus {

/// Reads a mesh by its extension: .ply (ASCII, binary), .obj, .stl (ASCII, binary), .off, .gltf, .glb.
/// Coordinates stay in the file's unit. Polygons become fans of triangles. glTF: all meshes of the scene in
/// their rest pose; glTF and STL, which repeat vertices along seams, are welded.
/// @throws Error naming the file, the line or element and the value: unreadable, unknown extension (lists
///         the known), truncated, malformed number, index out of range, vertex
///         not finite, no triangles, more than 4.3 GB, 2^26 vertices or 2^27 triangles.
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
/// none when there is no `uv`. What has colours is shown as it is (KHR_materials_unlit): photos hold their
/// light.
/// @throws Error: numbers that don't fit, an empty mesh, a path that can't be written.
void write_gltf(const std::string& path, const TexturedMesh& textured,
                std::span<const std::uint8_t> png = {});

/// Makes one vertex of those with exactly the same position (-0 equals 0), in order of first use. Triangles
/// that lose a corner are dropped, normals too: they may have differed.
TriangleMesh weld_exact(const TriangleMesh& mesh);

}  // namespace tactus
