/// Strained lattices as VTK, read back as a viewer does.
#include "tactus/io/vtk_file.h"
#include "tactus/geom/lattice/lattice_cut.h"

#include <gtest/gtest.h>

#include <cstring>
#include <fstream>
#include <map>
#include <pugixml.hpp>

#include "io/io_test_files.h"

namespace tactus {
namespace {

std::string decoded(const std::string& text) {
  std::string bytes;
  std::uint32_t group = 0, bits = 0;
  for (const char c : text) {
    const char* digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    const char* at = c == '\0' ? nullptr : std::strchr(digits, c);
    if (at == nullptr) continue;  // padding
    group = group << 6U | static_cast<std::uint32_t>(at - digits);
    if ((bits += 6) >= 8) bytes += static_cast<char>(group >> (bits -= 8) & 255U);
  }
  return bytes;
}

/// The values of an array of that name.
template <class T>
std::vector<T> array_of(pugi::xml_node parent, const char* name, const char* type) {
  const pugi::xml_node array = parent.find_child_by_attribute("DataArray", "Name", name);
  EXPECT_STREQ(array.attribute("type").value(), type) << name;
  EXPECT_STREQ(array.attribute("format").value(), "binary") << name;
  const std::string bytes = decoded(array.text().get());
  std::uint64_t length = 0;
  if (bytes.size() < sizeof length) {
    ADD_FAILURE() << name;
    return {};
  }
  std::memcpy(&length, bytes.data(), sizeof length);
  EXPECT_EQ(length, bytes.size() - sizeof length) << name;
  std::vector<T> values(length / sizeof(T));
  std::memcpy(values.data(), bytes.data() + sizeof length, values.size() * sizeof(T));
  return values;
}

struct Grid {
  std::vector<Vec3d> points;
  std::vector<std::vector<int>> cells;
  std::vector<std::uint8_t> types, model;
  std::map<std::string, std::vector<double>> of_points, of_cells;  ///< all components, one after the other
};

pugi::xml_node piece_of(pugi::xml_document& document, const std::string& path, const char* kind) {
  EXPECT_TRUE(document.load_file(path.c_str())) << path;
  const pugi::xml_node file = document.child("VTKFile");
  EXPECT_STREQ(file.attribute("type").value(), kind);
  EXPECT_STREQ(file.attribute("byte_order").value(), "LittleEndian");
  EXPECT_STREQ(file.attribute("header_type").value(), "UInt64");
  return file.child(kind).child("Piece");
}

Grid read_grid(const std::string& path) {
  pugi::xml_document document;
  const pugi::xml_node piece = piece_of(document, path, "UnstructuredGrid");
  Grid grid;
  const auto at = array_of<float>(piece.child("Points"), "Points", "Float32");
  for (std::size_t i = 0; i + 2 < at.size(); i += 3)
    grid.points.push_back({double{at[i]}, double{at[i + 1]}, double{at[i + 2]}});
  EXPECT_EQ(piece.attribute("NumberOfPoints").as_ullong(), grid.points.size());
  const pugi::xml_node cells = piece.child("Cells");
  const auto corners = array_of<std::int32_t>(cells, "connectivity", "Int32");
  std::size_t begin = 0;
  for (const std::int64_t end : array_of<std::int64_t>(cells, "offsets", "Int64")) {
    grid.cells.emplace_back(corners.begin() + static_cast<std::ptrdiff_t>(begin), corners.begin() + end);
    begin = static_cast<std::size_t>(end);
  }
  EXPECT_EQ(piece.attribute("NumberOfCells").as_ullong(), grid.cells.size());
  grid.types = array_of<std::uint8_t>(cells, "types", "UInt8");
  grid.model = array_of<std::uint8_t>(piece.child("CellData"), "model", "UInt8");
  for (const char* name : {"displacement_m", "velocity_m_s"}) {
    const auto values = array_of<float>(piece.child("PointData"), name, "Float32");
    grid.of_points[name].assign(values.begin(), values.end());
  }
  for (const char* name : {"J", "von_mises_Pa", "green_strain", "cauchy_stress_Pa"})
    grid.of_cells[name] = array_of<double>(piece.child("CellData"), name, "Float64");
  return grid;
}

/// Six times the volume of the corners 0, 1, 3, 4 of a hexahedron: positive when they are in VTK's order.
double orientation(const Grid& grid, const std::vector<int>& cell) {
  const auto edge = [&](std::size_t to) {
    return grid.points[static_cast<std::size_t>(cell[to])] - grid.points[static_cast<std::size_t>(cell[0])];
  };
  return dot(edge(4), cross(edge(1), edge(3)));
}

/// Two cubes of 1 cm stretched by 1.25 along x and held across: Cauchy's stress is mu (s - 1/s) + lambda (s -
/// 1) along x and lambda (s - 1) across (material_laws.h). Positions are floats: 1e-6 of strain.
TEST(VtkFile, AStretchedBarIsReadBack) {
  const CubeLattice lattice = lattice_from_box({0, 0, 0}, {2, 1, 1}, {.spacing_m = 0.01F});
  std::vector<Vec3f> x = lattice.rest_positions_m(), v(x.size(), Vec3f{0, 0.5F, -2});
  for (Vec3f& p : x) p.x *= 1.25F;
  const ElasticMaterial m{.young_Pa = 5000, .poisson = 0.4F};
  const TempFolder folder;
  const std::string path = folder.path + "/bar.vtu";
  write_vtu(path, lattice, {}, x, v, cube_strains(lattice, {}, {&m, 1}, {}, {}, x));
  const Grid grid = read_grid(path);
  ASSERT_EQ(grid.points.size(), 12U);
  ASSERT_EQ(grid.cells.size(), 2U);
  EXPECT_EQ(grid.types, (std::vector<std::uint8_t>{12, 12}));
  EXPECT_EQ(grid.model, (std::vector<std::uint8_t>{1, 1}));
  for (std::size_t i = 0; i < x.size(); ++i) {
    const Vec3f rest = lattice.rest_m(static_cast<Index>(i));
    for (int a = 0; a < 3; ++a) {
      const std::size_t at = 3 * i + static_cast<std::size_t>(a);
      EXPECT_EQ(static_cast<float>(grid.points[i][a]), x[i][a]) << "bit for bit";
      EXPECT_EQ(static_cast<float>(grid.of_points.at("displacement_m")[at]), x[i][a] - rest[a]);
      EXPECT_EQ(static_cast<float>(grid.of_points.at("velocity_m_s")[at]), v[i][a]);
    }
  }
  for (const std::vector<int>& cell : grid.cells) {
    ASSERT_EQ(cell.size(), 8U);
    EXPECT_NEAR(orientation(grid, cell), 1.25e-6, 1e-11);
  }
  const double s = 1.25, mu = double{m.mu_Pa()}, lambda = double{m.lambda_Pa()};
  const double along_Pa = mu * (s - 1 / s) + lambda * (s - 1), across_Pa = lambda * (s - 1);
  const double stress[9] = {along_Pa, 0, 0, 0, across_Pa, 0, 0, 0, across_Pa};
  for (std::size_t c = 0; c < 2; ++c) {
    EXPECT_NEAR(grid.of_cells.at("J")[c], s, 1e-5);
    EXPECT_NEAR(grid.of_cells.at("von_mises_Pa")[c], along_Pa - across_Pa, 1e-4 * along_Pa);
    for (std::size_t k = 0; k < 9; ++k) {
      EXPECT_NEAR(grid.of_cells.at("cauchy_stress_Pa")[9 * c + k], stress[k], 1e-4 * along_Pa);
      EXPECT_NEAR(grid.of_cells.at("green_strain")[9 * c + k], k == 0 ? (s * s - 1) / 2 : 0, 1e-5);
    }
  }
}

/// Of a body that is cut, copies are shown with their nodes; neither what was cut nor room is.
TEST(VtkFile, ACutBodyHasItsCopies) {
  const CubeLattice lattice =
      cut_lattice(lattice_from_box({0, 0, 0}, {3, 1, 1}, {.spacing_m = 0.01F}),
                  [](Vec3i p, int axis) { return axis == 0 && p.x == 1; }, {.copies = 9, .nodes = 30});
  std::vector<Vec3f> x = lattice.rest_positions_m();
  const std::vector<Vec3f> v(x.size());
  const ElasticMaterial m{};
  const TempFolder folder;
  const std::string path = folder.path + "/cut.vtu";
  write_vtu(path, lattice, {}, x, v, cube_strains(lattice, {}, {&m, 1}, {}, {}, x));
  const Grid grid = read_grid(path);
  EXPECT_EQ(grid.points.size(), 16U + 8U);
  ASSERT_EQ(grid.cells.size(), 4U);
  EXPECT_EQ(grid.of_cells.at("J").size(), 4U);
  for (const std::vector<int>& cell : grid.cells) EXPECT_NEAR(orientation(grid, cell), 1e-6, 1e-11);
}

TriangleMesh a_triangle() {
  return {.positions_m = {{0, 0, 0}, {1, 0, 0}, {0, 1.0F / 3, 0}},
          .normals = {{0, 0, 1}, {0, 0, 1}, {0, 0, 1}},
          .triangles = {{0, 1, 2}}};
}

TEST(VtkFile, SurfacesAndParticlesAreReadBack) {
  const TempFolder folder;
  TriangleMesh mesh = a_triangle();
  for (const bool is_surface : {true, false}) {
    if (!is_surface) mesh.triangles.clear(), mesh.normals.clear();
    const std::string path = folder.path + "/a.vtp";
    write_vtp(path, mesh);
    pugi::xml_document document;
    const pugi::xml_node piece = piece_of(document, path, "PolyData");
    EXPECT_EQ(array_of<float>(piece.child("Points"), "Points", "Float32"),
              (std::vector<float>{0, 0, 0, 1, 0, 0, 0, 1.0F / 3, 0}));
    EXPECT_EQ(piece.attribute(is_surface ? "NumberOfPolys" : "NumberOfVerts").as_int(), is_surface ? 1 : 3);
    const pugi::xml_node cells = piece.child(is_surface ? "Polys" : "Verts");
    EXPECT_EQ(array_of<std::int32_t>(cells, "connectivity", "Int32"), (std::vector<std::int32_t>{0, 1, 2}));
    EXPECT_EQ(array_of<std::int64_t>(cells, "offsets", "Int64"),
              is_surface ? (std::vector<std::int64_t>{3}) : (std::vector<std::int64_t>{1, 2, 3}));
    EXPECT_EQ(piece.child("PointData").empty(), !is_surface);
  }
}

TEST(VtkFile, ACollectionHasTimesAndParts) {
  const TempFolder folder;
  const std::string path = folder.path + "/a.pvd";
  write_pvd(path,
            std::vector<TimedFile>{{0, "a", "a-0.vtu"}, {0, "b", "b<0.vtp"}, {1.0 / 30, "a", "a-1.vtu"}});
  pugi::xml_document document;
  ASSERT_TRUE(document.load_file(path.c_str()));
  std::vector<std::string> files;
  for (const pugi::xml_node data : document.child("VTKFile").child("Collection").children("DataSet"))
    files.push_back(std::string(data.attribute("file").value()) + " " + data.attribute("part").value());
  EXPECT_EQ(files, (std::vector<std::string>{"a-0.vtu 0", "b<0.vtp 1", "a-1.vtu 0"}));
  EXPECT_EQ(document.child("VTKFile").child("Collection").last_child().attribute("timestep").as_double(),
            1.0 / 30);
}

}  // namespace
}  // namespace tactus
