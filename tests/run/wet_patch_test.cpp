#include "tactus/run/wet_patch.h"

#include <gtest/gtest.h>

namespace tactus {
namespace {

/// A square of 1 m in two triangles; the film's edge lies across it at x = 0.25, and dry is what is beyond.
TEST(WetPatch, IsCutAlongTheFilmsEdge) {
  TriangleMesh square{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}},
                      {{0, 0, 1}, {0, 0, 1}, {0, 0, 1}, {0, 0, 1}},
                      {{0, 1, 3}, {0, 3, 2}}};
  ViewFilm film;
  film.film_m = {0.002F, 0.002F, 0.002F, 0.002F};
  film.stain_m = {0, 0, 0, 0};
  film.edge_m = {0.25F, -0.75F, 0.25F, -0.75F};
  keep_wet(square, film);
  for (const std::vector<float>* m : {&film.film_m, &film.stain_m, &film.edge_m})
    EXPECT_EQ(m->size(), square.positions_m.size());
  EXPECT_EQ(square.normals.size(), square.positions_m.size());
  // Films are as thick as 2 mm within, 0 at the edge: its slope adds 2 mm^2 / 0.25 m to 0.25 m^2.
  EXPECT_NEAR(area_m2(square), 0.25, 1e-4);
  for (std::size_t v = 0; v < square.positions_m.size(); ++v) {
    EXPECT_LT(square.positions_m[v].x, 0.25F + 1e-5F);
    EXPECT_GT(square.positions_m[v].z, 0) << "above the square";
  }
}

TEST(WetPatch, KeepsStainsAndNothingThatIsDry) {
  TriangleMesh triangle{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 0, 1}, {0, 0, 1}, {0, 0, 1}}, {{0, 1, 2}}};
  ViewFilm film;
  film.film_m = {0, 0, 0};
  film.stain_m = {1e-4F, 1e-4F, 1e-4F};
  film.edge_m = {-1, -1, -1};
  keep_wet(triangle, film);
  EXPECT_EQ(triangle.triangles.size(), 1U);
  film.stain_m = {0, 0, 0};
  keep_wet(triangle, film);
  EXPECT_TRUE(triangle.triangles.empty());
  EXPECT_TRUE(film.edge_m.empty());
}

/// Two sides of a box that meet at its edge, x = y = 0, at right angles, with a vertex for each there.
TriangleMesh corner_of_box() {
  return {{{0, 0, 0}, {0, 0, 1}, {-1, 0, 0}, {-1, 0, 1}, {0, 0, 0}, {0, 0, 1}, {0, -1, 0}, {0, -1, 1}},
          {{0, 1, 0}, {0, 1, 0}, {0, 1, 0}, {0, 1, 0}, {1, 0, 0}, {1, 0, 0}, {1, 0, 0}, {1, 0, 0}},
          {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}}};
}

/// 2 mm on the one side and 1 mm on the other: their surfaces meet 1 mm beside the edge and 2 mm above it, to
/// the 0.1 mm that all is drawn above the surface.
TEST(WetPatch, IsOneSurfaceRoundAnEdge) {
  TriangleMesh corner = corner_of_box();
  ViewFilm film;
  film.film_m = {0.002F, 0.002F, 0.002F, 0.002F, 0.001F, 0.001F, 0.001F, 0.001F};
  film.stain_m.assign(8, 0);
  film.edge_m.assign(8, 0.1F);
  keep_wet(corner, film);
  int at_edge = 0;
  for (const Vec3f& p : corner.positions_m) {
    if (p.x < -0.5F || p.y < -0.5F) continue;
    EXPECT_NEAR(p.x, 0.0011F, 1e-6F);
    EXPECT_NEAR(p.y, 0.0021F, 1e-6F);
    ++at_edge;
  }
  EXPECT_EQ(at_edge, 4);
}

/// Where one side is dry, the other's film goes down to the edge between them.
TEST(WetPatch, EndsOnTheSurfaceAtAnEdgeWithADrySide) {
  TriangleMesh corner = corner_of_box();
  ViewFilm film;
  film.film_m = {0.002F, 0.002F, 0.002F, 0.002F, 0, 0, 0, 0};
  film.stain_m.assign(8, 0);
  film.edge_m = {0.1F, 0.1F, 0.1F, 0.1F, -0.1F, -0.1F, -0.1F, -0.1F};
  keep_wet(corner, film);
  int at_edge = 0, above = 0;
  for (const Vec3f& p : corner.positions_m) {
    const bool is_at_edge = p.x > -0.5F;
    ++(is_at_edge ? at_edge : above);
    EXPECT_NEAR(p.y, is_at_edge ? 1e-4F : 0.0021F, 1e-6F);
  }
  EXPECT_GT(at_edge, 0);
  EXPECT_EQ(above, 2);
  for (const std::array<Index, 3>& t : corner.triangles)
    for (const Index v : t) EXPECT_EQ(corner.normals[static_cast<std::size_t>(v)].x, 0) << "the other is dry";
}

}  // namespace
}  // namespace tactus
