#pragma once
/// Results for ParaView and other readers of VTK's XML formats: cubes (.vtu), surfaces and particles (.vtp),
/// and the times of all of them (.pvd). Numbers are binary: they are read back bit for bit.
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "tactus/geom/mesh/mesh.h"
#include "tactus/tissue/body_monitors.h"

namespace tactus {

/// Hexahedra where they are now, with displacement and velocity of their nodes and, per cube, J, Green's
/// strain, Cauchy's stress, von Mises' stress, and `model`: 0 shape matching, 1 elements. Tensors are 3 x 3.
/// @param elements per cube; empty: all are elements. @throws Error naming the path.
void write_vtu(const std::string& path, const CubeLattice& lattice, std::span<const std::uint8_t> elements,
               std::span<const Vec3f> x_m, std::span<const Vec3f> v_m_s, std::span<const CubeStrain> strains);

/// A surface, with its normals where it has some; without triangles, its points. @throws Error naming the
/// path.
void write_vtp(const std::string& path, const TriangleMesh& mesh);

/// A file of a time series.
struct TimedFile {
  double time_s = 0;
  std::string part;  ///< what it shows: files of one part follow one another
  std::string name;  ///< in the folder of the collection
};
/// What ParaView opens to play all of it. @throws Error naming the path.
void write_pvd(const std::string& path, std::span<const TimedFile> files);

}  // namespace tactus
