/// Strained lattices as VTK, read back as a viewer does.
#include "tactus/io/vtk_file.h"
#include "tactus/geom/lattice/lattice_cut.h"

#include <gtest/gtest.h>

#include <fstream>
#include <map>

#include "io/io_test_files.h"

namespace tactus {
namespace {

/// A legacy VTK file of one unstructured grid, by its keywords.
struct Grid {
  std::vector<Vec3d> points;
  std::vector<std::vector<int>> cells;
  std::vector<int> types;
  std::map<std::string, std::vector<double>> of_points, of_cells;  ///< all components, one after the other
};

std::vector<double> numbers(std::istream& in, std::size_t count) {
  std::vector<double> all(count);
  for (double& x : all) in >> x;
  return all;
}

Grid read_grid(const std::string& path) {
  std::ifstream in(path);
  std::string line, word;
  std::getline(in, line);
  EXPECT_EQ(line, "# vtk DataFile Version 3.0");
  std::getline(in, line);
  std::getline(in, line);
  EXPECT_EQ(line, "ASCII");
  Grid grid;
  auto* data = &grid.of_points;
  std::size_t tuples = 0;
  while (in >> word) {
    std::size_t count = 0;
    std::string name, type;
    if (word == "DATASET") {
      in >> word;
      EXPECT_EQ(word, "UNSTRUCTURED_GRID");
    } else if (word == "POINTS") {
      in >> count >> type;
      const std::vector<double> x = numbers(in, 3 * count);
      for (std::size_t i = 0; i < count; ++i) grid.points.push_back({x[3 * i], x[3 * i + 1], x[3 * i + 2]});
    } else if (word == "CELLS") {
      std::size_t size = 0;
      in >> count >> size;
      for (std::size_t c = 0; c < count; ++c) {
        std::size_t corners = 0;
        in >> corners;
        size -= corners + 1;
        for (const double node : numbers(in, corners)) {
          if (grid.cells.size() <= c) grid.cells.emplace_back();
          grid.cells[c].push_back(static_cast<int>(node));
        }
      }
      EXPECT_EQ(size, 0U);
    } else if (word == "CELL_TYPES") {
      in >> count;
      for (const double t : numbers(in, count)) grid.types.push_back(static_cast<int>(t));
    } else if (word == "POINT_DATA" || word == "CELL_DATA") {
      data = word == "POINT_DATA" ? &grid.of_points : &grid.of_cells;
      in >> tuples;
    } else if (word == "VECTORS" || word == "TENSORS") {
      in >> name >> type;
      (*data)[name] = numbers(in, (word == "VECTORS" ? 3 : 9) * tuples);
    } else if (word == "SCALARS") {
      in >> name >> type >> count >> word >> word;
      (*data)[name] = numbers(in, count * tuples);
    } else {
      ADD_FAILURE() << "no keyword of VTK: " << word;
      return grid;
    }
    EXPECT_FALSE(in.fail()) << word << ' ' << name;
  }
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
  const std::string path = folder.path + "/bar.vtk";
  write_vtk(path, lattice, x, v, cube_strains(lattice, {}, {&m, 1}, {}, {}, x));
  const Grid grid = read_grid(path);
  ASSERT_EQ(grid.points.size(), 12U);
  ASSERT_EQ(grid.cells.size(), 2U);
  EXPECT_EQ(grid.types, (std::vector<int>{12, 12}));
  for (std::size_t i = 0; i < x.size(); ++i) {
    const Vec3f rest = lattice.rest_m(static_cast<Index>(i));
    for (int a = 0; a < 3; ++a) {
      const std::size_t at = 3 * i + static_cast<std::size_t>(a);
      EXPECT_FLOAT_EQ(static_cast<float>(grid.points[i][a]), x[i][a]);
      EXPECT_FLOAT_EQ(static_cast<float>(grid.of_points.at("displacement_m")[at]), x[i][a] - rest[a]);
      EXPECT_FLOAT_EQ(static_cast<float>(grid.of_points.at("velocity_m_s")[at]), v[i][a]);
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
  const std::string path = folder.path + "/cut.vtk";
  write_vtk(path, lattice, x, v, cube_strains(lattice, {}, {&m, 1}, {}, {}, x));
  const Grid grid = read_grid(path);
  EXPECT_EQ(grid.points.size(), 16U + 8U);
  ASSERT_EQ(grid.cells.size(), 4U);
  EXPECT_EQ(grid.of_cells.at("J").size(), 4U);
  for (const std::vector<int>& cell : grid.cells) EXPECT_NEAR(orientation(grid, cell), 1e-6, 1e-11);
}

}  // namespace
}  // namespace tactus
