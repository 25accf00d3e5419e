#include "tactus/io/vtk_file.h"

#include <cstdio>

#include "tactus/base/safe_file.h"

namespace tactus {
namespace {

void add(std::string& text, double value) {
  char line[32];
  std::snprintf(line, sizeof line, "%.9g\n", value);
  text += line;
}

void add(std::string& text, Vec3d v) {
  char line[96];
  std::snprintf(line, sizeof line, "%.9g %.9g %.9g\n", v.x, v.y, v.z);
  text += line;
}

void add_tensors(std::string& text, const char* name, std::span<const CubeStrain> strains,
                 Mat3d CubeStrain::*field) {
  text += std::string("TENSORS ") + name + " double\n";
  for (const CubeStrain& s : strains)
    for (const Vec3d row : (s.*field).row) add(text, row);
}

template <class F>
void add_scalars(std::string& text, const char* name, std::span<const CubeStrain> strains, F&& value) {
  text += std::string("SCALARS ") + name + " double 1\nLOOKUP_TABLE default\n";
  for (const CubeStrain& s : strains) add(text, value(s));
}

}  // namespace

void write_vtk(const std::string& path, const CubeLattice& lattice, std::span<const Vec3f> x_m,
               std::span<const Vec3f> v_m_s, std::span<const CubeStrain> strains) {
  const std::string nodes = std::to_string(lattice.nodes.size()),
                    cubes = std::to_string(lattice.cubes.size());
  std::string text = "# vtk DataFile Version 3.0\nTactus, SI units\nASCII\nDATASET UNSTRUCTURED_GRID\n";
  text += "POINTS " + nodes + " float\n";
  for (const Vec3f x : x_m) add(text, vec_cast<double>(x));
  text += "CELLS " + cubes + " " + std::to_string(9 * lattice.cubes.size()) + "\n";
  for (const auto& corners : lattice.cube_nodes) {
    text += "8";
    for (const std::size_t q : {0, 1, 3, 2, 4, 5, 7, 6}) text += " " + std::to_string(corners[q]);
    text += "\n";
  }
  text += "CELL_TYPES " + cubes + "\n";
  for (std::size_t c = 0; c < lattice.cubes.size(); ++c) text += "12\n";  // VTK_HEXAHEDRON
  text += "POINT_DATA " + nodes + "\nVECTORS displacement_m float\n";
  for (std::size_t i = 0; i < x_m.size(); ++i)
    add(text, vec_cast<double>(x_m[i] - lattice.rest_m(static_cast<Index>(i))));
  text += "VECTORS velocity_m_s float\n";
  for (const Vec3f v : v_m_s) add(text, vec_cast<double>(v));
  text += "CELL_DATA " + cubes + "\n";
  add_scalars(text, "J", strains, [](const CubeStrain& s) { return s.J; });
  add_scalars(text, "von_mises_Pa", strains, [](const CubeStrain& s) { return s.von_mises_Pa(); });
  add_tensors(text, "green_strain", strains, &CubeStrain::strain);
  add_tensors(text, "cauchy_stress_Pa", strains, &CubeStrain::stress_Pa);
  write_file(path, text);
}

}  // namespace tactus
