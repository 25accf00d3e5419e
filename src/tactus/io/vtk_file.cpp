#include "tactus/io/vtk_file.h"

#include <algorithm>
#include <map>
#include <pugixml.hpp>
#include <sstream>
#include <type_traits>

#include "tactus/base/base64.h"
#include "tactus/base/safe_file.h"

namespace tactus {
namespace {

template <class T>
constexpr const char* type_name() {
  if constexpr (std::is_same_v<T, float>) return "Float32";
  if constexpr (std::is_same_v<T, double>) return "Float64";
  if constexpr (std::is_same_v<T, std::int32_t>) return "Int32";
  if constexpr (std::is_same_v<T, std::int64_t>) return "Int64";
  if constexpr (std::is_same_v<T, std::uint8_t>) return "UInt8";
}

/// A document of VTK's XML, little-endian, with one piece.
class VtkDocument {
 public:
  explicit VtkDocument(const char* kind) {
    pugi::xml_node file = document_.append_child("VTKFile");
    file.append_attribute("type") = kind;
    file.append_attribute("version") = "1.0";
    file.append_attribute("byte_order") = "LittleEndian";
    file.append_attribute("header_type") = "UInt64";
    content_ = file.append_child(kind);
  }
  pugi::xml_node content() { return content_; }
  void save(const std::string& path) const {
    std::ostringstream text;
    document_.save(text, " ");
    write_file(path, text.str());
  }

 private:
  pugi::xml_document document_;
  pugi::xml_node content_;
};

/// The length in bytes and the values themselves are one run of base64.
template <class T>
void add_array(pugi::xml_node parent, const char* name, int components, const std::vector<T>& values) {
  pugi::xml_node array = parent.append_child("DataArray");
  array.append_attribute("type") = type_name<T>();
  array.append_attribute("Name") = name;
  if (components != 1) array.append_attribute("NumberOfComponents") = components;
  array.append_attribute("format") = "binary";
  const std::uint64_t bytes = values.size() * sizeof(T);
  std::string data(reinterpret_cast<const char*>(&bytes), sizeof bytes);
  data.append(reinterpret_cast<const char*>(values.data()), bytes);
  array.text().set(base64(data).c_str());
}

void add(std::vector<float>& values, Vec3f v) { values.insert(values.end(), {v.x, v.y, v.z}); }

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

void add_nodes(pugi::xml_node piece, const CubeLattice& lattice, const std::vector<Index>& number,
               std::span<const Vec3f> x_m, std::span<const Vec3f> v_m_s) {
  std::vector<float> at_m, moved_m, speed_m_s;
  for (std::size_t i = 0; i < x_m.size(); ++i) {
    if (number[i] < 0) continue;
    add(at_m, x_m[i]);
    add(moved_m, x_m[i] - lattice.rest_m(static_cast<Index>(i)));
    add(speed_m_s, v_m_s[i]);
  }
  piece.append_attribute("NumberOfPoints") = at_m.size() / 3;
  add_array(piece.append_child("Points"), "Points", 3, at_m);
  pugi::xml_node data = piece.append_child("PointData");
  add_array(data, "displacement_m", 3, moved_m);
  add_array(data, "velocity_m_s", 3, speed_m_s);
}

/// @param cubes that are there: neither cut nor capacity for copies
void add_cubes(pugi::xml_node piece, const CubeLattice& lattice, const std::vector<Index>& number,
               const std::vector<std::size_t>& cubes) {
  constexpr std::uint8_t kHexahedron = 12;
  std::vector<std::int32_t> corners;
  std::vector<std::int64_t> ends;
  for (const std::size_t c : cubes) {
    for (const std::size_t q : {0, 1, 3, 2, 4, 5, 7, 6})
      corners.push_back(number[static_cast<std::size_t>(lattice.cube_nodes[c][q])]);
    ends.push_back(static_cast<std::int64_t>(corners.size()));
  }
  piece.append_attribute("NumberOfCells") = cubes.size();
  pugi::xml_node cells = piece.append_child("Cells");
  add_array(cells, "connectivity", 1, corners);
  add_array(cells, "offsets", 1, ends);
  add_array(cells, "types", 1, std::vector<std::uint8_t>(cubes.size(), kHexahedron));
}

void add_strains(pugi::xml_node piece, std::span<const std::uint8_t> elements,
                 std::span<const CubeStrain> strains, const std::vector<std::size_t>& cubes) {
  std::vector<double> J, mises_Pa, green, cauchy_Pa;
  std::vector<std::uint8_t> model;
  const auto add_tensor = [](std::vector<double>& to, const Mat3d& m) {
    for (const Vec3d row : m.row) to.insert(to.end(), {row.x, row.y, row.z});
  };
  for (const std::size_t c : cubes) {
    J.push_back(strains[c].J);
    mises_Pa.push_back(strains[c].von_mises_Pa());
    add_tensor(green, strains[c].strain);
    add_tensor(cauchy_Pa, strains[c].stress_Pa);
    model.push_back(elements.empty() || elements[c] != 0 ? 1 : 0);
  }
  pugi::xml_node data = piece.append_child("CellData");
  add_array(data, "J", 1, J);
  add_array(data, "von_mises_Pa", 1, mises_Pa);
  add_array(data, "green_strain", 9, green);
  add_array(data, "cauchy_stress_Pa", 9, cauchy_Pa);
  add_array(data, "model", 1, model);
}

}  // namespace

void write_vtu(const std::string& path, const CubeLattice& lattice, std::span<const std::uint8_t> elements,
               std::span<const Vec3f> x_m, std::span<const Vec3f> v_m_s,
               std::span<const CubeStrain> strains) {
  std::vector<std::size_t> cubes;
  for (std::size_t c = 0; c < lattice.cubes.size(); ++c)
    if (lattice.has_cube(c)) cubes.push_back(c);
  const std::vector<Index> number = numbers_of_nodes(lattice);
  VtkDocument vtk("UnstructuredGrid");
  pugi::xml_node piece = vtk.content().append_child("Piece");
  add_nodes(piece, lattice, number, x_m, v_m_s);
  add_cubes(piece, lattice, number, cubes);
  add_strains(piece, elements, strains, cubes);
  vtk.save(path);
}

void write_vtp(const std::string& path, const TriangleMesh& mesh) {
  std::vector<float> at_m, normals;
  std::vector<std::int32_t> corners;
  std::vector<std::int64_t> ends;
  for (const Vec3f& p : mesh.positions_m) add(at_m, p);
  for (const Vec3f& n : mesh.normals) add(normals, n);
  const bool has_triangles = !mesh.triangles.empty();
  const auto cells = has_triangles ? mesh.triangles.size() : mesh.positions_m.size();
  for (std::size_t t = 0; t < cells; ++t) {
    if (has_triangles)
      corners.insert(corners.end(), mesh.triangles[t].begin(), mesh.triangles[t].end());
    else
      corners.push_back(static_cast<std::int32_t>(t));
    ends.push_back(static_cast<std::int64_t>(corners.size()));
  }
  VtkDocument vtk("PolyData");
  pugi::xml_node piece = vtk.content().append_child("Piece");
  piece.append_attribute("NumberOfPoints") = mesh.positions_m.size();
  piece.append_attribute(has_triangles ? "NumberOfPolys" : "NumberOfVerts") = cells;
  add_array(piece.append_child("Points"), "Points", 3, at_m);
  if (!normals.empty()) {
    pugi::xml_node data = piece.append_child("PointData");
    data.append_attribute("Normals") = "Normals";
    add_array(data, "Normals", 3, normals);
  }
  pugi::xml_node polys = piece.append_child(has_triangles ? "Polys" : "Verts");
  add_array(polys, "connectivity", 1, corners);
  add_array(polys, "offsets", 1, ends);
  vtk.save(path);
}

void write_pvd(const std::string& path, std::span<const TimedFile> files) {
  VtkDocument vtk("Collection");
  std::map<std::string, int> number_of;
  for (const TimedFile& file : files) {
    const auto [at, is_new] = number_of.try_emplace(file.part, static_cast<int>(number_of.size()));
    pugi::xml_node data = vtk.content().append_child("DataSet");
    data.append_attribute("timestep").set_value(file.time_s, 17);
    data.append_attribute("part") = at->second;
    data.append_attribute("name") = file.part.c_str();
    data.append_attribute("file") = file.name.c_str();
  }
  vtk.save(path);
}

}  // namespace tactus
