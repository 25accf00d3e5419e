// Beams against CalculiX and beam theory.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "tactus/tissue/body_monitors.h"
#include "tissue/tled_bodies.h"

namespace tactus {
namespace {

namespace fs = std::filesystem;

/// 0.1 x 0.02 x 0.02 m, clamped at x = 0, with so many cubes across.
CubeLattice cantilever(Index across) {
  const float h = 0.02F / static_cast<float>(across);
  CubeLattice lattice = box({5 * across, across, across}, h);
  lattice.fix_half_space({0.01F * h, 0, 0}, {1, 0, 0});
  return lattice;
}

/// Under its weight along -z, settled by drag for some 20 time constants.
std::vector<Vec3f> settled(const CubeLattice& lattice, const ElasticMaterial& m, const TledOptions& options) {
  DeviceSet set("cpu");
  ExecContext& ctx = set.context(0);
  Tled tled(ctx, lattice, {&m, 1}, {}, options);
  BodyState body = rest_state(ctx, lattice);
  const float dt = tled.stable_step_s(), drag = 20 * std::sqrt(m.young_Pa / 30000);
  tled.step(ctx, body, {dt, {0, 0, -9.81F}, drag}, static_cast<int>(45 / drag / dt));
  return to_host(ctx, body.x_m.const_view());
}

/// Displacement of the middle of the free end.
Vec3f tip(const CubeLattice& lattice, const std::vector<Vec3f>& x_m) {
  const Vec3i last = lattice.node_dims - Vec3i{1, 1, 1};
  for (Index i = 0; i < lattice.node_count(); ++i) {
    if (lattice.nodes[at(i)] == Vec3i{last.x, last.y / 2, last.z / 2}) return x_m[at(i)] - lattice.rest_m(i);
  }
  return {};
}

/// Against CalculiX 2.20 with 20x4x4 quadratic elements (nu 0.45, 1000 kg/m^3): within 3 %, and converging.
TEST(TledBeam, BendsAsInCalculiX) {
  const TledOptions damped{.damping_ratio = 0.1F};
  const auto tip_of = [&](float young_Pa, Index across) {
    const CubeLattice lattice = cantilever(across);
    return tip(lattice, settled(lattice, {.young_Pa = young_Pa, .poisson = 0.45F}, damped));
  };
  const Vec3f soft = tip_of(30000, 4), softer = tip_of(10000, 4), finer = tip_of(30000, 8);
  EXPECT_NEAR(soft.x, -0.034324F, 0.03F * 0.034324F);
  EXPECT_NEAR(soft.z, -0.073296F, 0.03F * 0.073296F);
  EXPECT_NEAR(softer.x, -0.068710F, 0.03F * 0.068710F);
  EXPECT_NEAR(softer.z, -0.097023F, 0.03F * 0.097023F);
  EXPECT_LT(std::abs(finer.z + 0.073296F), std::abs(soft.z + 0.073296F) + 1e-4F);
  std::printf("tip 30 kPa (%.6f, %.6f), finer (%.6f, %.6f), 10 kPa (%.6f, %.6f) m\n",
              static_cast<double>(soft.x), static_cast<double>(soft.z), static_cast<double>(finer.x),
              static_cast<double>(finer.z), static_cast<double>(softer.x), static_cast<double>(softer.z));
}

/// A deck of incompatible-mode cubes (C3D8I), as many as ours; the tip's node is the last of its set.
void write_deck(const std::string& path, const CubeLattice& lattice, const ElasticMaterial& m) {
  std::ofstream out(path);
  out.precision(9);
  out << "*NODE,NSET=NALL\n";
  std::string fixed = "*NSET,NSET=FIX\n";
  Index tip_node = 0;
  const Vec3i last = lattice.node_dims - Vec3i{1, 1, 1};
  for (Index i = 0; i < lattice.node_count(); ++i) {
    const Vec3f p = lattice.rest_m(i);
    out << i + 1 << ',' << p.x << ',' << p.y << ',' << p.z << '\n';
    if (lattice.fixed[at(i)] != 0) fixed += std::to_string(i + 1) + ",\n";
    if (lattice.nodes[at(i)] == Vec3i{last.x, last.y / 2, last.z / 2}) tip_node = i + 1;
  }
  out << "*ELEMENT,TYPE=C3D8I,ELSET=EALL\n";
  for (std::size_t c = 0; c < lattice.cubes.size(); ++c) {
    out << c + 1;
    for (const std::size_t q : {0, 1, 3, 2, 4, 5, 7, 6}) out << ',' << lattice.cube_nodes[c][q] + 1;
    out << '\n';
  }
  // W = C10 (I1 - 3) + (J - 1)^2 / D1, isochoric I1: C10 = mu / 2, D1 = 2 / K.
  const double mu = static_cast<double>(m.mu_Pa()), bulk = static_cast<double>(m.lambda_Pa()) + 2 * mu / 3;
  out << fixed << "*NSET,NSET=TIP\n"
      << tip_node << "\n*BOUNDARY\nFIX,1,3\n*MATERIAL,NAME=M\n*HYPERELASTIC,NEO HOOKE\n"
      << mu / 2 << ',' << 2 / bulk << "\n*DENSITY\n1000.\n*SOLID SECTION,ELSET=EALL,MATERIAL=M\n"
      << "*STEP,NLGEOM,INC=200\n*STATIC\n0.05,1.,1e-5,0.1\n*DLOAD\nEALL,GRAV,9.81,0.,0.,-1.\n"
      << "*NODE PRINT,NSET=TIP,FREQUENCY=1000\nU\n*END STEP\n";
}

/// Runs CalculiX; the last displacement it prints.
Vec3f tip_of_calculix(const CubeLattice& lattice, const ElasticMaterial& m) {
  const fs::path folder = fs::temp_directory_path() / ("tactus_ccx_" + std::to_string(getpid()));
  fs::create_directories(folder);
  write_deck((folder / "beam.inp").string(), lattice, m);
  const std::string command = "cd '" + folder.string() + "' && OMP_NUM_THREADS=1 ccx beam > ccx.log 2>&1";
  EXPECT_EQ(std::system(command.c_str()), 0);
  std::ifstream result(folder / "beam.dat");
  Vec3f u{NAN, NAN, NAN};
  for (std::string line; std::getline(result, line);) {
    std::istringstream words(line);
    int node = 0;
    Vec3f found;
    if (words >> node >> found.x >> found.y >> found.z) u = found;
  }
  fs::remove_all(folder);
  return u;
}

/// The same material, size and load in both: incompatible modes bend as our hourglass control does, and both
/// are within 1.6 % of quadratic elements (method, TLED): 3 % between them. What CalculiX 2.20 gave is
/// written down in the test above and below, so a wrong run of it is seen.
TEST(TledBeam, BendsAsCalculiXSaysNow) {
  if (std::system("command -v ccx > /dev/null") != 0)
    GTEST_SKIP() << "ccx is not here: apt-get install calculix-ccx";
  const TledOptions isochoric{.law = MaterialLaw::isochoric_neo_hookean, .damping_ratio = 0.1F};
  const CubeLattice lattice = cantilever(4);
  for (const float poisson : {0.3F, 0.45F}) {
    const ElasticMaterial m{.young_Pa = 30000, .poisson = poisson};
    const Vec3f theirs = tip_of_calculix(lattice, m), ours = tip(lattice, settled(lattice, m, isochoric));
    std::printf("nu %.2f: CalculiX (%.6f, %.6f), Tactus (%.6f, %.6f) m\n", static_cast<double>(poisson),
                static_cast<double>(theirs.x), static_cast<double>(theirs.z), static_cast<double>(ours.x),
                static_cast<double>(ours.z));
    EXPECT_NEAR(ours.x / theirs.x, 1, 0.03);
    EXPECT_NEAR(ours.z / theirs.z, 1, 0.03);
    if (poisson == 0.45F) {
      EXPECT_NEAR(theirs.z, -0.072971, 0.002 * 0.072971);
    }
  }
}

/// Bending of a layer of one-point cubes is all in hourglass modes; of n layers, that part falls as 1 / n^2.
TEST(TledBeam, HourglassEnergyIsAFewPercent) {
  const ElasticMaterial m{.young_Pa = 30000, .poisson = 0.45F};
  const TledOptions options{.damping_ratio = 0.1F};
  for (const auto& [across, most] : {std::pair{4, 0.10}, {6, 0.05}}) {
    const CubeLattice lattice = cantilever(across);
    const std::vector<Vec3f> x = settled(lattice, m, options), v(x.size());
    const BodyMonitors b = measure_body(lattice, {}, {&m, 1}, {}, options, x, v);
    const double share = b.hourglass_J / (b.elastic_J + b.hourglass_J);
    std::printf("%d layers: hourglass energy is %.1f %% of the internal\n", across, 100 * share);
    EXPECT_LT(share, most) << across;
    EXPECT_GT(share, 0.1 / across / across) << across;  // it is measured at all
  }
}

}  // namespace
}  // namespace tactus
