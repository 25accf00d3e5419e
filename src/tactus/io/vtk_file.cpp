#include "tactus/io/vtk_file.h"

#include <algorithm>
#include <cstdio>
#include <vector>

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

/// Strains of those of its cubes that are there: neither cut nor capacity for copies.
struct Shown {
  std::span<const CubeStrain> strains;
  std::vector<std::size_t> cubes;
};

void add_tensors(std::string& text, const char* name, const Shown& shown, Mat3d CubeStrain::*field) {
  text += std::string("TENSORS ") + name + " double\n";
  for (const std::size_t c : shown.cubes)
    for (const Vec3d row : (shown.strains[c].*field).row) add(text, row);
}

template <class F>
void add_scalars(std::string& text, const char* name, const Shown& shown, F&& value) {
  text += std::string("SCALARS ") + name + " double 1\nLOOKUP_TABLE default\n";
  for (const std::size_t c : shown.cubes) add(text, value(shown.strains[c]));
}

/// Places for virtual nodes that no cube has yet are left out: @returns the number of each node in the file.
std::vector<Index> numbers_of_nodes(const CubeLattice& lattice) {
  std::vector<Index> number;
  Index count = 0;
  for (Index i = 0; i < lattice.node_count(); ++i) {
    const Index k = i - lattice.regular_nodes();
    number.push_back(k < 0 || lattice.virtual_nodes[static_cast<std::size_t>(k)] >= 0 ? count++ : -1);
  }
  return number;
}

}  // namespace

void write_vtk(const std::string& path, const CubeLattice& lattice, std::span<const Vec3f> x_m,
               std::span<const Vec3f> v_m_s, std::span<const CubeStrain> strains) {
  Shown shown{strains, {}};
  for (std::size_t c = 0; c < lattice.cubes.size(); ++c)
    if (lattice.has_cube(c)) shown.cubes.push_back(c);
  const std::vector<Index> number = numbers_of_nodes(lattice);
  const auto node_count = std::count_if(number.begin(), number.end(), [](Index n) { return n >= 0; });
  const std::string nodes = std::to_string(node_count), cubes = std::to_string(shown.cubes.size());
  std::string text = "# vtk DataFile Version 3.0\nTactus, SI units\nASCII\nDATASET UNSTRUCTURED_GRID\n";
  text += "POINTS " + nodes + " float\n";
  for (std::size_t i = 0; i < x_m.size(); ++i)
    if (number[i] >= 0) add(text, vec_cast<double>(x_m[i]));
  text += "CELLS " + cubes + " " + std::to_string(9 * shown.cubes.size()) + "\n";
  for (const std::size_t c : shown.cubes) {
    text += "8";
    for (const std::size_t q : {0, 1, 3, 2, 4, 5, 7, 6})
      text += " " + std::to_string(number[static_cast<std::size_t>(lattice.cube_nodes[c][q])]);
    text += "\n";
  }
  text += "CELL_TYPES " + cubes + "\n";
  for (std::size_t c = 0; c < shown.cubes.size(); ++c) text += "12\n";  // VTK_HEXAHEDRON
  text += "POINT_DATA " + nodes + "\nVECTORS displacement_m float\n";
  for (std::size_t i = 0; i < x_m.size(); ++i)
    if (number[i] >= 0) add(text, vec_cast<double>(x_m[i] - lattice.rest_m(static_cast<Index>(i))));
  text += "VECTORS velocity_m_s float\n";
  for (std::size_t i = 0; i < v_m_s.size(); ++i)
    if (number[i] >= 0) add(text, vec_cast<double>(v_m_s[i]));
  text += "CELL_DATA " + cubes + "\n";
  add_scalars(text, "J", shown, [](const CubeStrain& s) { return s.J; });
  add_scalars(text, "von_mises_Pa", shown, [](const CubeStrain& s) { return s.von_mises_Pa(); });
  add_tensors(text, "green_strain", shown, &CubeStrain::strain);
  add_tensors(text, "cauchy_stress_Pa", shown, &CubeStrain::stress_Pa);
  write_file(path, text);
}

}  // namespace tactus
