#pragma once
/// From the contents of a mesh file to the mesh that the program uses: one stage for all formats. Internal to
/// io.
#include "tactus/io/mesh/mesh_file.h"
#include "tactus/io/mesh/mesh_reading.h"

namespace tactus::mesh_reading {

/// Checks indices and numbers, makes triangles of polygons, drops vertices that no face uses, moves a mesh
/// that lies far from the origin of its file, makes one vertex of those at the same place, and rounds to
/// float last.
/// @throws Error naming the line or element and its value.
ImportedMesh import_raw(const std::string& path, RawMesh&& raw, double unit_m);

}  // namespace tactus::mesh_reading
